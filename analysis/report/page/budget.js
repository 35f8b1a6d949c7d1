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
  pressure: 'barometer'
};

const budgetColours = () =>
    (isDark() ?
         ['#56b4e9', '#e69f00', '#3fcf9f', '#e39ac4', '#f0e442', '#e8743b', '#c9ccd1', '#8fa3ff', '#b08968'] :
         ['#0072b2', '#b97a00', '#00855f', '#a03f90', '#7a7000', '#c2410c', '#5f6770', '#3d4fd1', '#7b5230']);
const patterns = ['', '', '', '', '/', '\\', '.', 'x', '-'];

const usedSources = (locations) =>
    Object.keys(sources).filter((source) => locations.some((l) => l.c_t_budget[source] > 0));
const combined = ({c_t_budget: budget}) =>
    Math.sqrt(Object.values(budget).reduce((sum, u) => sum + u * u, 0));

function drawBudget(locations, width) {
  const colours = budgetColours();
  const data = usedSources(locations).map((source) => {
    const k = Object.keys(sources).indexOf(source);
    const percent = (l, value) => (100 * value) / l.c_t.mean;
    return {
      type: 'bar',
      name: sources[source],
      x: locations.map((l) => plain(l.location)),
      y: locations.map((l) => percent(l, l.c_t_budget[source] ** 2 / (combined(l) || 1))),
      text: locations.map(
          (l) => `${plain(l.location)}, ${sources[source]}<br>u ${
                     fixed(percent(l, l.c_t_budget[source]), 3)} % of C<sub>T</sub><br>` +
              `${fixed((100 * l.c_t_budget[source] ** 2) / (combined(l) ** 2 || 1), 0)} % of the variance`),
      textposition: 'none',
      hovertemplate: '%{text}<extra></extra>',
      marker: {
        color: colours[k],
        pattern: {shape: patterns[k], fillmode: 'overlay', fgcolor: style('--page'), size: 5},
        line: {width: 0}
      }
    };
  });
  return {
    data,
    layout: {
      barmode: 'stack',
      bargap: 0.15,
      xaxis: axis('location', {
        type: 'category',
        showgrid: false,
        tickangle: -90,
        tickfont: {size: 10},
        tickmode: width > 14 * locations.length ? 'linear' : 'auto'
      }),
      yaxis: axis('u(C<sub>T</sub>) [% of C<sub>T</sub>]', {rangemode: 'tozero'}),
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', traceorder: 'normal'}
    }
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
      'Stacked bars of the standard uncertainty of C_T by source and location; the table beneath has the numbers',
      (width) => (isNarrow(width) ? 520 : 480), (width) => drawBudget(locations, width));
  return [
    figure(
        'Standard uncertainty of C_T by source', [], place,
        'The height of a bar is the combined standard uncertainty u; squares of parts add up, so each part is drawn as large as its share of the variance. ' +
            'U95 is u times Student\'s t, about 2. Calibration, propellers and instruments are shared by all locations and cancel for the most part in ΔC_T.',
        command('reduce', '--csv coefficients.csv')),
    notes.length ?
        [h('p', {}, 'What the budget leaves out:'), h('ul', {}, notes.map((note) => h('li', {}, note)))] :
        [],
    folded('The budget as a table', () => budgetTable(locations)),
  ];
}
