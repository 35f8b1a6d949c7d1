// Load cells: how far each calibration point is from the line, and the certificate's verdict.

const pointStates = {
  used: {symbol: 'circle', size: 8},
  suspicious: {symbol: 'diamond-open', size: 11},
  'left out': {symbol: 'x', size: 10}
};

function drawResiduals(cell, colour, forces, reach) {
  const data = Object.entries(pointStates).flatMap(([state, marker]) => {
    const chosen = cell.state.map((s, i) => (s === state ? i : -1)).filter((i) => i >= 0);
    if (!chosen.length) return [];
    return [{
      type: 'scatter',
      mode: 'markers',
      name: state,
      x: chosen.map((i) => cell.force_N[i]),
      y: chosen.map((i) => 1000 * cell.residual_N[i]),
      text: chosen.map((i) => `line ${cell.line[i]} of calibration.csv, ${state}`),
      marker: {color: colour, ...marker},
      hovertemplate: '%{text}<br>%{x:.3f} N applied<br>%{y:+.1f} mN off<extra></extra>'
    }];
  });
  const two = 2000 * cell.residual_std_N;
  return {
    data,
    layout: {
      xaxis: axis('applied force [N]', {zeroline: false, range: forces}),
      yaxis: axis('residual [mN]', {range: [-reach, reach]}),
      shapes: [band(-two, two, colour, {opacity: 0.12})],
      showlegend: data.length > 1,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom'}
    }
  };
}

/** Panels on common axes, so that cells can be compared. */
function residualFigure(cells) {
  const residuals = cells.flatMap((c) => [2 * c.residual_std_N, ...c.residual_N.map(Math.abs)]);
  const reach = 1150 * Math.max(...residuals);
  const applied = cells.flatMap((c) => c.force_N);
  const [low, high] = [Math.min(...applied), Math.max(...applied)];
  const room = 0.06 * (high - low);
  const panels = cells.map((cell, i) => {
    const build = () => drawResiduals(cell, rotorColours()[i], [low - room, high + room], reach);
    return h(
        'div', {}, h('h4', {}, `Cell ${cell.cell}`),
        plot(`Residuals of cell ${cell.cell} against force`, () => 260, build));
  });
  const caption = sentences(
      'How much more force the fitted line gives than was applied, point by point; band: twice the',
      'standard deviation of the residuals. A bow, a trend or a fan says that a straight line with',
      'one noise is not the whole truth. Open diamonds: points that stick out; crosses: gross errors, left out.');
  return figure(
      'Residuals of the calibration', [], h('div', {class: 'panels'}, panels), caption, command('calibrate'));
}

function cellTable(cells) {
  const milli = (value, u95) => withU95(1000 * value, 1000 * u95);
  return table(
      'Fitted lines: voltage = zero + gain · force',
      [
        {name: 'cell', cell: (c) => String(c.cell)},
        {name: 'points', cell: (c) => String(c.points_used)},
        {name: 'zero ± U95 [mV]', cell: (c) => milli(c.zero_V, c.zero_u95_V)},
        {name: 'gain ± U95 [mV/N]', cell: (c) => milli(c.gain_V_per_N, c.gain_u95_V_per_N)},
        {name: 'residual std [mN]', cell: (c) => fixed(1000 * c.residual_std_N, 1)},
        {name: 'correlation', cell: (c) => fixed(c.correlation, 6)},
      ],
      cells);
}

const propellerTable = (propellers) => table(
    'Propellers: thrust of each over the mean of those mounted',
    [
      {name: 'rotor', cell: (p) => String(p.rotor)},
      {name: 'propeller', cell: (p) => p.propeller, text: true},
      {name: 'tests', cell: (p) => String(p.tests)},
      {name: 'factor', cell: (p) => fixed(p.factor, 4)},
      {name: 'standard uncertainty', cell: (p) => fixed(p.standard_uncertainty, 5)},
    ],
    propellers);

const verdictOf = ({passed}) => badge(passed ? 'ok' : 'problem', passed ? 'passed' : 'not passed');

const gateTable = (gates) => table(
    'Gates of the certificate',
    [
      {name: 'cell', cell: (g) => String(g.cell)},
      {name: 'gate', cell: (g) => g.name, text: true},
      {name: 'verdict', cell: verdictOf, text: true},
      {name: 'found', cell: (g) => g.finding, text: true},
    ],
    gates);

function calibrationSection({id, passed, cells, gates, warnings, propellers}) {
  const failed = gates.filter((gate) => !gate.passed);
  const all = counted(gates.length, 'gate');
  const verdict = passed ? `all ${all} passed.` :
                           `${failed.length} of ${all} not passed; the coefficients rest on it all the same.`;
  return [
    h('p', {}, verdictOf({passed}), ` Certificate ${id}: ${verdict}`),
    failed.length ? gateTable(failed) : [],
    warnings.length ? h('ul', {}, warnings.map((warning) => h('li', {}, warning))) : [],
    residualFigure(cells),
    cellTable(cells),
    propellers.length ? propellerTable(propellers) : [],
    folded('All gates', () => gateTable(gates)),
  ];
}
