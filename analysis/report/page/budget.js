// What the uncertainty of C_T is made of, location by location.

const sources = {
  run: 'repeatability',
  visit: 'coming back',
  session: 'between sessions',
  calibration: 'calibration',
  propellers: 'propellers',
  tare: 'zero (tares)',
  speed: 'tachometer',
  temperature: 'thermometer',
  pressure: 'barometer',
  model: 'adopted effects'
};

const budgetColours = () =>
    (isDark() ?
         ['#56b4e9', '#e69f00', '#3fcf9f', '#e39ac4', '#f0e442', '#e8743b', '#c9ccd1', '#8fa3ff', '#b08968', '#5ad0d6'] :
         ['#0072b2', '#b97a00', '#00855f', '#a03f90', '#7a7000', '#c2410c', '#5f6770', '#3d4fd1', '#7b5230', '#0b7a80']);
const patterns = ['', '', '', '', '/', '\\', '.', 'x', '-', '|'];

const usedSources = (locations) =>
    Object.keys(sources).filter((source) => locations.some((l) => l.c_t_budget[source] > 0));

/** One source in all bars; squares add up, so each part is drawn as large as its share of the variance. */
function budgetBars(locations, source) {
  const k = Object.keys(sources).indexOf(source);
  const colour = budgetColours()[k];
  const parts = locations.map(({location, c_t: {mean}, c_t_budget: budget}) => {
    const combined = Math.hypot(...Object.values(budget));
    const share = combined > 0 ? (budget[source] / combined) ** 2 : 0;
    const u = `u ${fixed((100 * budget[source]) / mean, 3)} % of C<sub>T</sub>`;
    const text =
        `${plain(location)}, ${sources[source]}<br>${u}<br>${fixed(100 * share, 0)} % of the variance`;
    return {height: (100 * share * combined) / mean, text};
  });
  return {
    type: 'bar',
    name: sources[source],
    x: locations.map((l) => plain(l.location)),
    y: parts.map((part) => part.height),
    text: parts.map((part) => part.text),
    textposition: 'none',
    hovertemplate: '%{text}<extra></extra>',
    marker: {
      color: colour,
      pattern: {shape: patterns[k], fillmode: 'overlay', fgcolor: style('--page'), size: 5},
      line: {width: 0},
    },
  };
}

function drawBudget(locations, width) {
  const labels = {
    tickangle: -90,
    tickfont: {size: 10},
    tickmode: width > 14 * locations.length ? 'linear' : 'auto'
  };
  return {
    data: usedSources(locations).map((source) => budgetBars(locations, source)),
    layout: {
      barmode: 'stack',
      bargap: 0.15,
      xaxis: axis('location', {type: 'category', showgrid: false, ...labels}),
      yaxis: axis('u(C<sub>T</sub>) [% of C<sub>T</sub>]', {rangemode: 'tozero'}),
      showlegend: true,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', traceorder: 'normal'},
    },
  };
}

function budgetTable(locations) {
  const relative = (l, value) => fixed((100 * value) / l.c_t.mean, 4);
  return table(
      'Standard uncertainties of C_T by source, in per cent of C_T',
      [
        {name: 'location', cell: (l) => l.location, text: true},
        ...usedSources(locations).map(
            (source) => ({name: sources[source], cell: (l) => relative(l, l.c_t_budget[source])})),
        {name: 'combined', cell: (l) => relative(l, l.c_t.standard_uncertainty)},
        {name: 'degrees of freedom', cell: (l) => (known(l.c_t.dof) ? fixed(l.c_t.dof, 1) : '∞')},
        {name: 'U95', cell: (l) => relative(l, l.c_t.u95)},
      ],
      locations);
}

function budgetSection() {
  const {locations, notes} = report.sections.locations;
  const place = plot(
      'Standard uncertainty of C_T by source and location; the table beneath has the numbers',
      (width) => (isNarrow(width) ? 520 : 480), (width) => drawBudget(locations, width));
  const caption = sentences(
      'The height of a bar is the combined standard uncertainty u; squares of parts add up, so each',
      'part is drawn as large as its share of the variance. U95 is u times Student’s t, about 2.',
      'Calibration, propellers and instruments are shared by all locations and cancel for the most',
      'part in ΔC_T. Coming back: what changes when the rig is set up at a location anew.');
  const leftOutOfIt =
      [h('p', {}, 'What the budget leaves out:'), h('ul', {}, notes.map((note) => h('li', {}, note)))];
  return [
    figure(
        'Standard uncertainty of C_T by source', [], place, caption,
        command('reduce', '--csv coefficients.csv')),
    notes.length ? leftOutOfIt : [],
    folded('The budget as a table', () => budgetTable(locations)),
  ];
}
