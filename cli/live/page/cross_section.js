// The tunnel's cross-section with the locations of the plan: what is done, what is next. One of them can be
// chosen.

/** Signs, so that no state is told by colour alone. */
const locationStates = {
  done: {sign: '✓', name: 'done'},
  present: {sign: '●', name: 'present'},
  next: {sign: '→', name: 'next'},
  partial: {sign: '', name: 'begun'},  // shows its number of runs
  planned: {sign: '', name: 'planned'},
};

const chosen = {
  label: null,
  listeners: []
};

function chooseLocation(label) {
  chosen.label = label;
  for (const listen of chosen.listeners) listen();
}

const inTunnel = ({y_norm, z_norm}) => known(y_norm) && known(z_norm);

const signOf = ({state, done}) => (state === 'partial' ? String(done) : locationStates[state]?.sign ?? '');

const stateText = ({label, state, done, planned}) => `${label}: ${locationStates[state]?.name ?? state}, ${
    planned ? `${done} of ${counted(planned, 'run')}` : counted(done, 'run')}`;

/** The nearest location in the direction of an arrow key; sideways distance counts double. */
function neighbour(locations, from, key) {
  const [dy, dz] = {ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[key];
  const list = locations.filter(inTunnel);
  if (!inTunnel(from)) return list[0];
  let best = null, least = Infinity;
  for (const to of list) {
    const y = to.y_norm - from.y_norm, z = to.z_norm - from.z_norm;
    const ahead = y * dy + z * dz, aside = Math.abs(y * dz) + Math.abs(z * dy);
    if (ahead > 1e-6 && ahead + 2 * aside < least) [best, least] = [to, ahead + 2 * aside];
  }
  return best;
}

/** One tab stop for all: arrows go from one to the next, as among radio buttons. */
function locationButton(location, locations, isTabStop) {
  const {label, state} = location;
  const button =
      h('button', {
        type: 'button',
        role: 'radio',
        class: `location ${state}`,
        'aria-checked': String(label === chosen.label),
        'aria-label': stateText(location),
        title: stateText(location),
        tabindex: isTabStop ? '0' : '-1',
        'data-label': label,
      },
        h('span', {'aria-hidden': 'true'}, signOf(location)));
  if (inTunnel(location)) {
    button.style.left = across(location.y_norm);
    button.style.top = down(location.z_norm);
  } else {
    button.append(h('span', {'aria-hidden': 'true'}, ` ${label}`));
  }
  button.addEventListener('click', () => chooseLocation(label === chosen.label ? null : label));
  button.addEventListener('keydown', (event) => {
    if (!/^Arrow/.test(event.key)) return;
    event.preventDefault();
    const outside = locations.filter((l) => !inTunnel(l)), at = outside.indexOf(location);
    const along = {ArrowRight: 1, ArrowLeft: -1}[event.key];
    const to =
        at >= 0 && along ? outside[at + along] : neighbour(locations, location, event.key) ?? outside[0];
    if (!to) return;
    chooseLocation(to.label);
    document.querySelector(`.location[data-label="${CSS.escape(to.label)}"]`).focus();
  });
  return button;
}

function fillLocations({tunnel, others, summary}, {locations}) {
  const focused = document.activeElement?.dataset?.label;
  const stop = (locations.find((l) => l.label === chosen.label) ??
                locations.find((l) => l.state === 'present') ?? locations[0])
                   ?.label;
  const button = (location) => locationButton(location, locations, location.label === stop);
  tunnel.replaceChildren(...locations.filter(inTunnel).map(button));
  others.replaceChildren(...locations.filter((l) => !inTunnel(l)).map(button));
  if (focused !== undefined)
    document.querySelector(`.location[data-label="${CSS.escape(focused)}"]`)?.focus();
  const done = locations.filter((l) => l.done > 0 && l.done >= l.planned).length;
  setText(summary, `${done} of ${counted(locations.length, 'location')} done.`);
}

function startCrossSection() {
  const tunnel = h('div', {class: 'tunnel'}), others = h('div', {class: 'outside'});
  const summary = h('p', {id: 'locations-summary'});
  const legend =
      h('p', {class: 'legend', 'aria-hidden': 'true'},
        Object.entries(locationStates)
            .map(
                ([state, {sign, name}]) => h(
                    'span', {}, h('span', {class: `location key ${state}`}, state === 'partial' ? '3' : sign),
                    ` ${name} `)));
  const group =
      h('div', {role: 'radiogroup', 'aria-label': 'Locations; arrow keys go from one to the next'},
        tunnelFrame(tunnel), others);
  byId('cross-section')
      .append(
          summary, group, legend,
          h('p', {class: 'soft'}, 'Choose one to see its runs; 3: so many of its runs are done.'));
  let latest = null;
  const refill = () => latest && fillLocations({tunnel, others, summary}, latest);
  on('campaign', (campaign) => {
    latest = campaign;
    refill();
  });
  chosen.listeners.push(refill);
}
