// Colours of plots, light and dark. All sets stay apart without the medium-wave or the long-wave cones, and
// from the page's background by a contrast of 3.

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const isDark = () => style('--dark') === '1';

/** Rotors and cells 1 to 4. */
const rotorColours = () =>
    isDark() ? ['#56b4e9', '#e69f00', '#3fcf9f', '#e39ac4'] : ['#0072b2', '#c75500', '#00855f', '#a03f90'];

const symbols = ['circle', 'square', 'diamond', 'triangle-up', 'triangle-down', 'star', 'hexagon', 'cross'];

// plasma (van der Walt and Smith 2015): lightness rises all the way
const plasma = [
  '#0d0887', '#41049d', '#6a00a8', '#8f0da4', '#b12a90', '#cc4778', '#e16462', '#f2844b', '#fca636',
  '#fcce25', '#f0f921'
];

/** The i-th of n colours of an ordered set, from the tunnel's middle outwards. */
function orderedColour(i, n) {
  const [from, to] = isDark() ? [4.5, 10] : [0, 6];
  const at = n < 2 ? from : from + ((to - from) * i) / (n - 1);
  const k = Math.min(Math.floor(at), plasma.length - 2);
  const channel = (colour, c) => parseInt(colour.slice(1 + 2 * c, 3 + 2 * c), 16);
  const mix = [0, 1, 2].map(
      (c) => Math.round(channel(plasma[k], c) * (1 - at + k) + channel(plasma[k + 1], c) * (at - k)));
  return `rgb(${mix.join(',')})`;
}

const scale = (...colours) => colours.map((colour, i) => [i / (colours.length - 1), colour]);

// The colours of the pictures that `map` writes (analysis/maps/picture.cpp), white at 0.
const diverging =
    scale('#2166ac', '#4393c3', '#92c5de', '#d1e5f0', '#f7f7f7', '#fddbc7', '#f4a582', '#d6604d', '#b2182b');
const sequential =
    scale('#f9f9f9', '#eae6f1', '#dad2ea', '#cabfe2', '#bbacda', '#ab9ad2', '#9b88ca', '#8a76c1', '#7a64b9');

/** An axis with its title, which ends with the unit ([–]: none), and what else is said of it. */
const axis = (title, more = {}) => ({
  title: {text: title, standoff: 8},
  gridcolor: style('--line'),
  zerolinecolor: style('--line'),
  linecolor: style('--soft'),
  tickcolor: style('--soft'),
  ticks: 'outside',
  ticklen: 4,
  automargin: true,
  ...more,
});

/** Numbers of an axis with as many decimals as tell its ticks apart, however near they are, and no powers of ten. */
const bySteps = {exponentformat: 'none'};

const heightTitle = '← ground  z̄ = 2z/(h<sub>t</sub> − h<sub>q</sub>) [–]  ceiling →';

const isNarrow = (width) => width < 560;

/** What all plots share; `legend` stands on the right, below on narrow pages. */
const baseLayout = (width) => ({
  paper_bgcolor: 'rgba(0,0,0,0)',
  plot_bgcolor: 'rgba(0,0,0,0)',
  font: {family: style('--font'), size: isNarrow(width) ? 11 : 13, color: style('--ink')},
  hoverlabel:
      {bgcolor: style('--panel'), bordercolor: style('--soft'), font: {color: style('--ink')}, align: 'left'},
  modebar: {bgcolor: 'rgba(0,0,0,0)', color: style('--soft'), activecolor: style('--ink')},
  margin: {l: 10, r: 12, t: 30, b: 10},
  legend: isNarrow(width) ? {orientation: 'h', y: -0.2, yanchor: 'top'} : {},
  hovermode: 'closest',
  // A finger scrolls the page; a mouse zooms.
  dragmode: matchMedia('(pointer: coarse)').matches ? false : 'zoom',
});

/** A horizontal band or line across a plot. */
const band = (from, to, colour, more = {}) => ({
  type: 'rect',
  xref: 'paper',
  x0: 0,
  x1: 1,
  y0: from,
  y1: to,
  fillcolor: colour,
  line: {width: 0},
  layer: 'below',
  ...more
});
const rule = (at, colour, more = {}) => ({
  type: 'line',
  xref: 'paper',
  x0: 0,
  x1: 1,
  y0: at,
  y1: at,
  line: {color: colour, width: 1, dash: 'dot'},
  layer: 'below',
  ...more
});
