// The run: what is being recorded, and the buttons and keys that drive it.

const phases = {
  idle: 'Idle',
  waiting: 'Waiting',
  recording: 'Recording',
  finished: 'Finished',
};

/** "Recording R0012 at H4V-2 (session S2, repeat 3)" */
function runText({phase, run, location, next_location: next, session, repeat, kind}) {
  const name = phases[phase] ?? phase;
  const details = [session && `session ${session}`, kind !== 'tare' && known(repeat) && `repeat ${repeat}`];
  const where = `${kind === 'tare' ? 'tare at ' : ''}${location} (${details.filter(Boolean).join(', ')})`;
  if (phase === 'recording' && !controls.writable)
    return `Another process records ${run}: ${where}; its traces are on its own page`;
  if (phase === 'recording') return `${name} ${run}: ${where}`;
  if (phase === 'waiting') return `${name}: bring the rig to ${next ?? 'the next location'}, then press Next`;
  return run ? `${name}; the last run was ${run}: ${where}` : `${name}; no run yet`;
}

/** What a new run is, where the plan does not say it. */
function startForm(hello) {
  const fields = {
    location: field('Location', 'label: OT, H4V-2, OS, GND1.25 …', {maxlength: '64', required: ''}),
    session: field('Session', 'empty: the one under way', {maxlength: '64'}),
    repeat: field('Repeat', 'empty: the next', {type: 'number', min: '1', step: '1'}),
    kind: field('Kind', '', {}, ['thrust', 'tare']),
    duration_s: field('Duration [s]', 'empty: as --duration says', {type: 'number', min: '0', step: 'any'}),
  };
  const form =
      h('form', {class: 'start'}, Object.values(fields).map((f) => f.place),
        h('button', {type: 'submit', class: 'main'}, 'Start this run'));
  const entered = () => Object.fromEntries(
      Object.entries(fields)
          .filter(([, {input}]) => input.value.trim() !== '')
          .map(([name,
                 {input}]) => [name, input.type === 'number' ? Number(input.value) : input.value.trim()]));
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    send('start', entered(), 'Started.');
  });
  form.hidden = !hello.writable;
  return {form, fields};
}

const controls = {
  state: {phase: 'idle'},
  writable: false,
  lastRun: null,
  keys: true,
  form: null,
  planned: false
};

const notWhileRecording = () =>
    (controls.state.phase === 'recording' ? 'A run is being recorded: stop it first.' : '');

/** Keys, what they do, and why they cannot just now. */
const actions = [
  {
    key: 's',
    name: 'Start',
    why: notWhileRecording,
    act: async () => {
      const {ok, text} = await answerTo('start', {});
      if (!ok) openStartForm();
      say(ok ? text ?? 'Started.' : `Not started: ${text}`, ok);
    },
  },
  {
    key: 'x',
    name: 'Stop',
    why: () => (controls.state.phase === 'recording' ? '' : 'No run is being recorded.'),
    act: () => send('stop', {run: controls.state.run}, 'Stopped; the run is kept as partial.'),
  },
  {
    key: 't',
    name: 'Tare',
    why: notWhileRecording,
    act: async () => {
      const sure = await ask('Tare', {
        accept: 'Record tare',
        explain: 'Motors stopped, propellers at rest? The tare is what all thrusts are measured from.'
      });
      if (sure) send('tare', {}, 'The tare is being recorded.');
    },
  },
  {key: 'n', name: 'Next', why: notWhileRecording, act: () => send('next', {}, 'On to the next.')},
  {
    key: 'm',
    name: 'Note',
    why: () => (controls.lastRun ? '' : 'There is no run yet that a note could be on.'),
    act: () => noteOn(controls.lastRun),
  },
];

function openStartForm() {
  const details = byId('start-form').querySelector('details');
  if (!details) return;
  details.open = true;
  details.querySelector('input')?.focus();
}

function makeButtons() {
  for (const action of actions) {
    action.button = actionButton(
        action.name, action.act,
        {'aria-keyshortcuts': action.key.toUpperCase(), 'data-action': action.name.toLowerCase()});
    action.button.append(' ', h('kbd', {}, action.key.toUpperCase()));
  }
  const keys = tick('Keys', controls.keys, (wanted) => (controls.keys = wanted));
  byId('buttons').append(...actions.map(({button}) => button), keys);
  addEventListener('keydown', (event) => {
    const {target, key, repeat} = event;
    if (!controls.keys || repeat || event.ctrlKey || event.altKey || event.metaKey) return;
    if (document.querySelector('dialog[open]') ||
        target.closest?.('input:not([type=checkbox], [type=radio]), select, textarea'))
      return;
    const action = actions.find((a) => a.key === key.toLowerCase());
    if (!action) return;
    event.preventDefault();  // the letter would end up in the dialog that opens
    action.button.click();
  });
}

/** What somebody at the rig most likely does next. */
const expected = {
  idle: 'Start',
  waiting: 'Next',
  recording: 'Stop'
};

function showButtons() {
  for (const {name, button, why} of actions) {
    const readOnly =
        controls.writable ? '' : 'The page shows a file, read-only: nothing can be recorded from here.';
    refuse(button, !link.connected ? 'There is no connection to the server.' : readOnly || why());
    setClass(button, 'main', !button.refuse && expected[controls.state.phase] === name);
  }
}

function startControls() {
  const text = h('p', {class: 'phase'}), bar = h('span', {class: 'fill'}), time = h('span', {class: 'time'});
  const progress =
      h('div', {class: 'progress'}, h('div', {class: 'gauge', 'aria-hidden': 'true'}, bar), time);
  byId('run-state').append(text, progress);
  makeButtons();
  on('hello', (hello) => {
    controls.writable = hello.writable;
    if (!controls.form) {
      controls.form = startForm(hello);
      byId('start-form')
          .append(h('details', {}, h('summary', {}, 'Record a run of your own'), controls.form.form));
    }
    byId('start-form').hidden = !hello.writable;
    byId('buttons').hidden = !hello.writable;
    showButtons();
  });
  on('link', showButtons);
  on('state', (state) => {
    controls.state = state;
    controls.lastRun = state.run ?? controls.lastRun;
    const recording = state.phase === 'recording';
    setText(text, runText(state) + (state.silent ? ' — SILENT: no frames come' : ''));
    setClass(byId('run'), 'recording', recording);
    progress.hidden = !recording || !controls.writable;
    bar.style.width = `${fixed(Math.min(100, (100 * state.elapsed_s) / state.duration_s || 0), 1)}%`;
    setText(time, `${fixed(state.elapsed_s, 1)} of ${fixed(state.duration_s, 0)} s`);
    account.phase = state.phase;
    account.run = state.run;
    showButtons();
  });
  on('campaign', ({runs}) => (controls.lastRun = runs.at(-1)?.run ?? controls.lastRun));
}
