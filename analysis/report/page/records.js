// Findings, the table of locations, and where everything came from.

function findingItem({severity, check, found, advice}) {
  const todo = advice ? h('div', {class: 'advice'}, '→ ', prose(advice)) : [];
  return h('li', {}, badge(severity, severity), ' ', h('strong', {}, check), ' ', prose(found), todo);
}

const findingsSection = (findings) =>
    [h('ul', {class: 'findings'}, findings.map(findingItem)), h('p', {}, remade(command('doctor')))];

function leftOut(runs) {
  if (!runs.length) return [];
  return [
    h('p', {}, `${counted(runs.length, 'run')} left out of the reduction:`),
    h('ul', {}, runs.map(({run, reason}) => h('li', {}, `${run}: ${reason}`)))
  ];
}

/** Mean, scatter and U95 of a quantity, to as many decimals as the smallest U95 asks for. */
function valueColumns(locations, quantity, name, signed) {
  const decimals = Math.max(...locations.map((l) => decimalsFor(l[quantity].u95)));
  return [
    {name, cell: (l) => fixed(l[quantity].mean, decimals, signed)},
    {name: 'std', cell: (l) => fixed(l[quantity].std, decimals)},
    {name: 'U95', cell: (l) => (l[quantity].u95 > 0 ? fixed(l[quantity].u95, decimals) : '–')},
  ];
}

function locationTable({locations, left_out: left}) {
  const {maps} = report.sections;
  const change = new Map((maps.locations ?? []).map((l) => [l.location, withU95(...l.delta_ct, true)]));
  const columns = [
    {name: 'location', cell: (l) => l.location, text: true},
    {name: 'ȳ', cell: (l) => fixed(l.y_norm, 2)},
    {name: 'z̄', cell: (l) => fixed(l.z_norm, 2)},
    {name: 'runs', cell: (l) => String(l.runs)},
    {name: 'sessions', cell: (l) => String(l.sessions)},
    ...valueColumns(locations, 'c_t', 'C_T', false),
    {name: 'ΔC_T ± U95 [%]', cell: (l) => change.get(l.location) ?? '–'},
    ...(report.rotors === 4 ? valueColumns(locations, 'u_percent', 'U [%]', true) : []),
    {name: 'thrust [N]', cell: (l) => fixed(l.thrust_N, 3)},
  ];
  return [
    table('C_T and U by location', columns, locations),
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

const documentTable = (documents) => table(
    'What the campaign file holds that was derived; the newest calibration is the one in force',
    [
      {name: 'document', cell: (d) => String(d.id)},
      {name: 'kind', cell: (d) => d.kind, text: true},
      {name: 'made (UTC)', cell: (d) => d.created_utc, text: true},
      {name: 'program', cell: (d) => d.program, text: true},
      {name: 'command', cell: (d) => h('span', {class: 'wrap'}, code(d.arguments)), text: true},
      {name: 'from', cell: (d) => h('span', {class: 'wrap'}, inputsText(d.inputs)), text: true},
    ],
    documents);

/** What this page itself was made from. */
function facts() {
  const {program, arguments: made, created_utc: created, db, model} = report.made;
  const {calibration} = report.sections;
  const list = [
    ['This page', [code(made), h('br'), `${program}, ${created}`]],
    ['Campaign file', h('code', {}, db)],
  ];
  if (report.kind === 'campaign')
    list.push(['Model', model === 'thesis' ? 'thesis: dry air at 101325 Pa, nominal speed' : model]);
  if (calibration?.points_hash)
    list.push(
        ['Calibration', [`document ${calibration.id}, of points `, h('code', {}, calibration.points_hash)]]);
  return h('dl', {}, list.map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
}

function provenanceSection(documents) {
  const runs = report.runs?.run.length ?? 0;
  return [
    facts(),
    documents.length ? documentTable(documents) : h('p', {}, 'The file holds nothing derived yet.'),
    runs ? folded(`All ${counted(runs, 'run')}, with the hashes of their raw data`, runTable) : [],
  ];
}
