// The page: its sections in their order. One whose data are absent says why; only a model and flights need not be
// there.

const campaignSections = [
  {id: 'model', title: 'What the model lacked: error before and after', build: modelSection},
  {id: 'maps', title: 'Disturbance maps', build: mapsSection},
  {id: 'flights', title: 'Controllers flown in the map (simulated)', build: flightsSection},
  {id: 'locations', title: 'C_T by location', build: locationsSection},
  {id: 'open_space', title: 'The tunnel against open space', build: openSpaceSection},
  {id: 'uneven', title: 'Uneven thrust by location', build: unevenSection},
  {id: 'budget', title: 'What the uncertainty is made of', build: budgetSection},
  {id: 'calibration', title: 'Calibration', build: calibrationSection},
  {id: 'health', title: 'Health of the runs', build: healthSection},
  {id: 'tares', title: 'Zeros of the sessions', build: taresSection},
  {id: 'findings', title: 'What the doctor finds', build: findingsSection},
  {id: 'table', title: 'Table of locations', build: locationTable, data: 'locations'},
  {id: 'provenance', title: 'Provenance', build: provenanceSection},
];
const tableSections = [
  {id: 'table', title: 'C_T against speed', build: tableSection},
  {id: 'flights', title: 'Controllers flown in the map (simulated)', build: flightsSection},
  {id: 'provenance', title: 'Provenance', build: provenanceSection},
];

function section({id, title, build, data = id}) {
  const material = report.sections[data];
  const content = material.absent ? h('p', {class: 'absent'}, prose(material.absent)) : build(material);
  return h(
      'section', {id, 'aria-labelledby': `${id}-title`}, h('h2', {id: `${id}-title`}, prose(title)), content);
}

const contents = (sections) =>
    h('nav', {'aria-label': 'Contents'},
      h('ol', {}, sections.map(({id, title}) => h('li', {}, h('a', {href: `#${id}`}, prose(title))))));

const sections = (report.kind === 'table' ? tableSections : campaignSections)
                     .filter(({id, data = id}) => report.sections[data]);
document.getElementById('head').replaceChildren(...head(), contents(sections));
document.getElementById('main').replaceChildren(...sections.map(section));
startPlots();
