// How candidates ranked, and what the largest evidence is where there is no effect.

const kBars = 15;

const verticalLine = (x, colour, dash) =>
    ({type: 'line', yref: 'paper', y0: 0, y1: 1, x0: x, x1: x, line: {color: colour, width: 2, dash}});
const note = (x, y, text, colour, anchor = 'left') => ({
  x,
  y,
  yref: 'paper',
  text,
  showarrow: false,
  xanchor: anchor,
  yanchor: 'top',
  font: {color: colour, size: 12},
  bgcolor: style('--page')
});

const kLetters = 30;  // of a line beside a bar

/** A label in one line or two, broken between words where it can be. */
function inLines(label) {
  const cut = (line) => (line.length > kLetters ? `${line.slice(0, kLetters - 1)}…` : line);
  if (label.length <= kLetters) return [label];
  const space = label.lastIndexOf(' ', kLetters);
  return (space > 0 ? [label.slice(0, space), label.slice(space + 1)] : [label]).map(cut);
}

/** Room for every bar's label. */
const rankingHeight = ({ranking}) => {
  const best = ranking.slice(0, kBars);
  return 90 + (best.some((r) => inLines(r.label).length > 1) ? 31 : 24) * best.length;
};

function drawRanking({ranking, critical}) {
  const best = ranking.slice(0, kBars).reverse();
  const [blue] = rotorColours();
  const names = best.map((r) => inLines(r.label).map(plain).join('<br>'));
  return {
    data: [{
      type: 'bar',
      orientation: 'h',
      x: best.map((r) => Math.max(0, r.evidence)),
      y: best.map((_, i) => i),
      marker: {color: best.map((r) => (r.evidence >= critical ? blue : style('--soft')))},
      text: best.map((r) => `${plain(r.label)}<br>evidence ${digits(r.evidence)}, ${sayP(r.p)}`),
      textposition: 'none',
      hovertemplate: '%{text}<extra></extra>'
    }],
    layout: {
      xaxis: axis('evidence [–]', {rangemode: 'tozero'}),
      yaxis: axis(
          '', {tickmode: 'array', tickvals: best.map((_, i) => i), ticktext: names, tickfont: {size: 11}}),
      shapes: [verticalLine(critical, style('--ink'), 'dash')],
      showlegend: false
    }
  };
}

function drawNull({null_maxima: maxima, observed, critical}) {
  const [blue, orange] = rotorColours();
  const most = Math.max(observed, critical, ...maxima) * 1.08;
  const right = observed > 0.6 * most;
  return {
    data: [{
      type: 'histogram',
      x: maxima,
      xbins: {start: 0, end: most, size: most / Math.max(24, Math.min(60, most * 5))},
      marker: {color: style('--soft')},
      hovertemplate: '%{y} of the simulated campaigns<br>%{x}<extra></extra>'
    }],
    layout: {
      xaxis: axis('largest evidence of all candidates [–]', {range: [Math.min(0, ...maxima), most]}),
      yaxis: axis('simulated campaigns [–]'),
      shapes: [verticalLine(critical, blue, 'dash'), verticalLine(observed, orange, 'solid')],
      annotations: [
        note(critical, 1, ` α = ${digits(report.settings.alpha)} `, blue),
        note(observed, 0.88, ' observed ', orange, right ? 'right' : 'left')
      ],
      showlegend: false,
      bargap: 0.05
    }
  };
}

const rankingTable = (ranking) => table(
    'All candidates that can be seen: the best way of each effect',
    [
      {name: 'candidate', cell: (r) => r.label, text: true},
      {name: 'evidence', cell: (r) => digits(r.evidence)},
      {name: 'p of the maximum', cell: (r) => digitsOfP(r.p)},
      {name: 'parameter', cell: (r) => r.parameter, text: true},
      {name: 'value', cell: (r) => digits(r.amplitude)},
      {name: 'standard error', cell: (r) => (r.standard_error > 0 ? digits(r.standard_error) : '–')},
      {name: 'unit', cell: (r) => (r.unit === '1' ? '–' : r.unit), text: true},
    ],
    ranking);

function roundFigure(round, i, made) {
  const outcome = round.outcome.replace(/; $/, '');
  const caption = sentences(
      'Bars: each candidate’s evidence in its best way, −log10 of its own p with its prior weight; dashed: what α asks for. Histogram: the largest evidence of all',
      `candidates together in ${
          counted(round.null_maxima.length, 'campaign')} simulated without effect, on this`,
      'campaign’s own design; the share beyond the observed one is its p.');
  const panels =
      h('div', {class: 'pair'},
        h('div', {},
          plot(
              `Evidence of the candidates in round ${i + 1}`,
              () => rankingHeight(round), () => drawRanking(round))),
        h('div', {}, plot(`Null distribution of round ${i + 1}`, () => 360, () => drawNull(round))));
  return [
    figure(`Round ${i + 1}: ${outcome}`, [], panels, caption, made),
    folded(`All candidates of round ${i + 1} with standard errors`, () => rankingTable(round.ranking)),
  ];
}

function curveRoundFigure(round, i, made) {
  const caption = sentences(
      'Smooth dependence on each covariate, the order of runs and the time within them, tried together:',
      `the largest evidence in ${counted(round.null_maxima.length, 'campaign')} simulated without any.`);
  const place =
      plot(`Null distribution of structure without a name, ${i + 1}`, () => 320, () => drawNull(round));
  return figure(`Structure without a name: ${round.outcome}`, [], place, caption, made);
}
