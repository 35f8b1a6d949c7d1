// Plots are drawn when they come near the window, the rest when the browser has nothing else to do: a page of
// a thousand runs answers at once, and is whole when it is searched or printed.

const plots = [];
const errors = [];

/** For tests, and for whoever wonders: how far the page is. */
function tell() {
  const drawn = plots.filter((plot) => plot.drawn).length;
  document.documentElement.dataset.report = JSON.stringify({plots: plots.length, drawn, errors});
}

function fail(error) {
  errors.push(String(error?.stack ?? error));
  tell();
}
addEventListener('error', (event) => fail(event.error ?? event.message));
addEventListener('unhandledrejection', (event) => fail(event.reason));

// The buttons are named one by one: among Plotly's own is one that sends the data to its makers' server.
const config = {
  displaylogo: false,
  displayModeBar: matchMedia('(hover: hover)').matches ? 'hover' : false,
  modeBarButtons: [['toImage', 'zoom2d', 'pan2d', 'autoScale2d', 'resetScale2d']],
  toImageButtonOptions: {format: 'svg'},
  plotlyServerURL: ''
};

/**
 * A place for a plot. `build(width)` gives {data, layout}, anew for every width and theme, and `afterwards(place)`
 * where something is left to do once it is drawn; `height(width)` is in pixels. `label` says what it shows to those who cannot see it.
 */
function plot(label, height, build) {
  const place = h('div', {class: 'plot', role: 'group', 'aria-label': label});
  plots.push({place, height, build, begun: false, drawn: false});
  return place;
}

function reserve(plot) {
  plot.place.style.height = `${plot.height(plot.place.clientWidth)}px`;
}

async function draw(plot) {
  plot.begun = true;
  const width = plot.place.clientWidth;
  const {data, layout, afterwards} = plot.build(width);
  await Plotly.react(
      plot.place, data, {...baseLayout(width), ...layout, width, height: plot.height(width)}, config);
  afterwards?.(plot.place);
  plot.drawn = true;
  tell();
}

/** Draws again a plot whose data or look have changed. */
const redraw = (place) => draw(plots.find((plot) => plot.place === place)).catch(fail);

function redrawAll() {
  plots.forEach(reserve);
  return Promise.all(plots.filter((plot) => plot.begun).map(draw)).catch(fail);
}

function drawWhenNear() {
  const near = new IntersectionObserver((entries) => {
    for (const entry of entries.filter((e) => e.isIntersecting)) {
      near.unobserve(entry.target);
      const plot = plots.find((p) => p.place === entry.target);
      if (!plot.begun) draw(plot).catch(fail);
    }
  }, {rootMargin: '400px'});
  plots.forEach((plot) => near.observe(plot.place));
}

function drawWhenIdle() {
  const next = plots.find((plot) => !plot.begun);
  if (!next) return;
  const later = window.requestIdleCallback ?? ((work) => setTimeout(work, 50));
  later(() => (next.begun ? Promise.resolve() : draw(next)).catch(fail).then(drawWhenIdle));
}

/** On paper everything is there, light, and as wide as a page. */
function drawForPaper(onPaper) {
  document.documentElement.classList.toggle('paper', onPaper);
  for (const plot of plots) plot.begun ||= onPaper;
  redrawAll();
}

function startPlots() {
  plots.forEach(reserve);
  tell();
  drawWhenNear();
  setTimeout(drawWhenIdle, 200);
  let width = innerWidth, timer;
  addEventListener('resize', () => {
    clearTimeout(timer);
    if (innerWidth !== width)
      timer = setTimeout(() => {
        width = innerWidth;
        redrawAll();
      }, 150);
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawAll);
  addEventListener('beforeprint', () => drawForPaper(true));
  addEventListener('afterprint', () => drawForPaper(false));
}
