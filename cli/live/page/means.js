// Whether the run is known well enough: C_T and U with their U95 against the target that the user sets.

const wanted = {
  c_t: {title: 'C_T', target: 'c_t_u95', unit: ''},
  u_percent: {title: 'Uneven thrust U', target: 'u_percent_u95', unit: ' %'},
};

/** Seconds that are still to be recorded: the uncertainty of a mean falls with the root of the time. */
const secondsLeft = (elapsed_s, u95, target) => elapsed_s * ((u95 / target) ** 2 - 1);

function verdictOf(state, estimate, target) {
  if (!estimate || !known(estimate.u95) || !(target > 0))
    return {kind: 'none', sign: '', text: whyNone(state, target)};
  if (estimate.u95 <= target) return {kind: 'enough', sign: '✓', text: 'known well enough'};
  const times = `U95 is ${fixed(estimate.u95 / target, 1)} times the target`;
  if (state.phase !== 'recording' || state.elapsed_s < 2)
    return {kind: 'not-yet', sign: '…', text: `not yet: ${times}`};
  const left_s = secondsLeft(state.elapsed_s, estimate.u95, target);
  const beyond = state.elapsed_s + left_s > state.duration_s ? ', longer than this run' : '';
  return {kind: 'not-yet', sign: '…', text: `not yet: ${times}; about ${duration(left_s)} more${beyond}`};
}

function whyNone({phase, kind, means}, target) {
  if (kind === 'tare') return 'a tare has none';
  if (means?.some((mean) => mean.unit === 'V')) return 'needs a calibration: tunnelrig calibrate';
  if (phase !== 'recording' && phase !== 'finished') return 'no run yet';
  return target > 0 ? 'not enough frames yet' : 'no target is set';
}

function makeVerdict({title}) {
  const parts = {
    value: h('p', {class: 'value'}, '–'),
    bar: h('span', {class: 'fill'}),
    sign: h('span', {class: 'sign', 'aria-hidden': 'true'}),
    text: h('span', {}, ''),
  };
  parts.element =
      h('div', {class: 'verdict none'}, h('h3', {}, prose(title)), parts.value,
        h('div', {class: 'gauge', 'aria-hidden': 'true'}, parts.bar),
        h('p', {class: 'says'}, parts.sign, parts.text));
  return parts;
}

function showVerdict(parts, {unit, target: name}, state, estimate) {
  const target = state.target?.[name];
  const {kind, sign, text} = verdictOf(state, estimate, target);
  setText(parts.value, estimate ? withU95(estimate.mean, estimate.u95) + unit : '–');
  setText(parts.sign, sign);
  setText(parts.text, text);
  const className = `verdict ${kind}`;
  if (parts.element.className !== className) parts.element.className = className;
  const reached = kind === 'none' ? 0 : Math.min(1, target / estimate.u95);
  parts.bar.style.width = `${fixed(100 * reached, 0)}%`;
}

/** The form that sets the targets; what is being typed is not overwritten. */
function targetForm() {
  const fields = Object.values(wanted).map(
      ({title, target, unit}) => ({
        name: target,
        ...field(
            `Target U95 of ${title.split(' ').at(-1)}${unit && ` [${unit.trim()}]`}`, '',
            {type: 'number', min: '0', step: 'any', inputmode: 'decimal'}),
      }));
  const button = h('button', {type: 'submit'}, 'Set');
  const form = h('form', {class: 'target'}, fields.map((f) => f.place), button);
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const values = {};
    for (const {name, input} of fields) values[name] = Number(input.value);
    if (await send('target', values, 'The target is set.')) form.dataset.edited = '';
  });
  form.addEventListener('input', () => (form.dataset.edited = 'yes'));
  const show = (target) => {
    if (form.dataset.edited || !target) return;
    for (const {name, input} of fields) {
      const text = known(target[name]) ? String(target[name]) : '';
      if (input.value !== text) input.value = text;
    }
  };
  return {form, show};
}

function startMeans() {
  const verdicts = Object.entries(wanted).map(([name, what]) => ({name, what, parts: makeVerdict(what)}));
  const {form, show} = targetForm();
  const of = h('p', {class: 'soft'}, '');
  byId('means').append(
      ...verdicts.map(({parts}) => parts.element), form, of,
      h('p', {class: 'soft'},
        prose(
            'U95 is that of the run\'s mean, as its frames scatter and hang together. What the ' +
            'calibration, other runs and other sessions add is in the report.')));
  on('hello', ({rotors}) => {  // U compares the right pair with the left one
    verdicts.find(({name}) => name === 'u_percent').parts.element.hidden = rotors !== 4;
  });
  on('state', (state) => {
    for (const {name, what, parts} of verdicts) showVerdict(parts, what, state, state[name]);
    show(state.target);
    setText(
        of,
        state.run ? `Run ${state.run}, ${state.location ?? ''}: ${duration(state.elapsed_s)} recorded.` : '');
  });
}
