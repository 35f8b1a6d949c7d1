// Findings, the table of locations, and where everything came from.

const badge = (kind, text) => h('span', {class: `badge ${kind}`}, text);

const findingsSection = (findings) =>
    [h('ul', {class: 'findings'},
       findings.map(
           ({severity, check, found, advice}) =>
               h('li', {}, badge(severity, severity), ' ', h('strong', {}, check), ' ', prose(found),
                 advice ? h('div', {class: 'advice'}, '→ ', prose(advice)) : []))),
     h('p', {}, remade(command('doctor'))),
];

function leftOut(runs) {
  if (!runs.length) return [];
  return [
    h('p', {}, `${counted(runs.length, 'run')} left out of the reduction:`),
    h('ul', {}, runs.map(({run, reason}) => h('li', {}, `${run}: ${reason}`)))
  ];
}

function locationTable({locations, left_out: left}) {
  const {maps} = report.sections;
  const change = new Map((maps.absent ? [] : maps.locations).map((l) => [l.location, l.delta_ct]));
  const decimals = (quantity) => Math.max(...locations.map((l) => decimalsFor(l[quantity].u95)));
  const value = (name, quantity, part, signed = false) => ({
    name,
    cell: (l) =>
        fixed(part === 'u95' && l[quantity].u95 === 0 ? null : l[quantity][part], decimals(quantity), signed)
  });
  const uneven = report.rotors === 4 ?
      [
        value('U [%]', 'u_percent', 'mean', true), value('std', 'u_percent', 'std'),
        value('U95', 'u_percent', 'u95')
      ] :
      [];
  return [
    table(
        'C_T and U by location',
        [
          {name: 'location', cell: (l) => l.location, text: true},
          {name: 'ȳ', cell: (l) => fixed(l.y_norm, 2)},
          {name: 'z̄', cell: (l) => fixed(l.z_norm, 2)},
          {name: 'runs', cell: (l) => String(l.runs)},
          {name: 'sessions', cell: (l) => String(l.sessions)},
          value('C_T', 'c_t', 'mean'),
          value('std', 'c_t', 'std'),
          value('U95', 'c_t', 'u95'),
          {
            name: 'ΔC_T ± U95 [%]',
            cell: (l) => (change.has(l.location) ? withU95(...change.get(l.location), true) : '–')
          },
          ...uneven,
          {name: 'thrust [N]', cell: (l) => fixed(l.thrust_N, 3)},
        ],
        locations),
    h('p', {}, remade(command('reduce', '--csv coefficients.csv'))),
    leftOut(left),
  ];
}

/** Every run with the hash of its raw data. */
function runTable() {
  const {runs} = report;
  return table(
      'All runs',
      [
        {name: 'run', cell: (i) => runs.run[i], text: true},
        {name: 'kind', cell: (i) => (runs.tare[i] ? 'tare' : 'thrust'), text: true},
        {name: 'location', cell: (i) => runs.location[i], text: true},
        {name: 'session', cell: (i) => runs.session[i], text: true},
        {name: 'start (UTC)', cell: (i) => utc(runs.start_s[i]), text: true},
        {name: 'C_T', cell: (i) => fixed(runs.c_t[i], 6)},
        {name: 'U [%]', cell: (i) => fixed(runs.u_percent[i], 3)},
        {name: 'recording', cell: (i) => runs.state[i] ?? 'thrusts given', text: true},
        {name: 'hash of the raw data', cell: (i) => h('code', {}, runs.hash[i] ?? '–'), text: true},
      ],
      runs.run.map((_, i) => i));
}

const inputsText = (inputs) =>
    Object.entries(inputs)
        .map(([name, value]) => `${name} ${typeof value === 'object' ? JSON.stringify(value) : value}`)
        .join(', ');

function provenanceSection(documents) {
  const {program, arguments: made, created_utc: created, db, model} = report.made;
  const {calibration} = report.sections;
  const facts = [
    ['This page', [code(made), h('br'), `${program}, ${created}`]],
    ['Campaign file', h('code', {}, db)],
    ...(report.kind === 'table' ?
            [] :
            [['Model', `${model}${model === 'thesis' ? ': dry air at 101325 Pa, nominal speed' : ''}`]]),
    ...(calibration && !calibration.absent ? [[
      'Calibration', [`document ${calibration.id}, of points `, h('code', {}, calibration.points_hash)]
    ]] :
                                             []),
  ];
  return [
    h('dl', {}, facts.map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)])),
    documents.length ?
        table(
            'What the campaign file holds that was derived; the newest calibration is the one in force',
            [
              {name: 'document', cell: (d) => String(d.id)},
              {name: 'kind', cell: (d) => d.kind, text: true},
              {name: 'made (UTC)', cell: (d) => d.created_utc, text: true},
              {name: 'program', cell: (d) => d.program, text: true},
              {name: 'command', cell: (d) => code(d.arguments), text: true},
              {name: 'from', cell: (d) => h('span', {class: 'wrap'}, inputsText(d.inputs)), text: true},
            ],
            documents) :
        h('p', {}, 'The file holds nothing derived yet.'),
    report.runs ?
        folded(`All ${counted(report.runs.run.length, 'run')}, with the hashes of their raw data`, runTable) :
        [],
  ];
}
