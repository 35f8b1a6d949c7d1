// Alarms, seen and heard: a list that screen readers speak out, and a beep.

const beepAgain_ms = 10_000;
const mutedKey = 'tunnelrig-muted';

const sound = {
  context: null,
  muted: false,
  last_ms: 0
};

/** What the browser does not let a page keep is forgotten with it. */
function remembered(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

function remember(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // a browser without storage
  }
}

/** Browsers let a page be heard once it was clicked or typed on. */
function wakeSound() {
  if (!('AudioContext' in window)) return;
  sound.context ??= new AudioContext();
  if (sound.context.state === 'suspended') sound.context.resume().then(showSound, () => {});
  showSound();
}

/** Two short tones, the second higher. */
function beep() {
  sound.last_ms = performance.now();
  if (sound.muted || sound.context?.state !== 'running') return;
  ++account.beeps;
  const start = sound.context.currentTime;
  for (const [at, frequency_hz] of [[0, 880], [0.2, 1175]]) {
    const tone = new OscillatorNode(sound.context, {type: 'square', frequency: frequency_hz});
    const volume = new GainNode(sound.context, {gain: 0.15});
    tone.connect(volume).connect(sound.context.destination);
    tone.start(start + at);
    tone.stop(start + at + 0.15);
  }
}

function showSound() {
  const button = byId('sound');
  const waiting = !sound.muted && sound.context?.state !== 'running';
  setText(button, sound.muted ? 'Sound is off' : waiting ? 'Sound: click to switch on' : 'Sound is on');
  button.setAttribute('aria-pressed', String(!sound.muted && !waiting));
}

function toggleSound() {
  const waiting = sound.context?.state !== 'running';
  sound.muted = waiting ? false : !sound.muted;
  remember(mutedKey, sound.muted ? 'yes' : 'no');
  wakeSound();
  showSound();
}

const since = (utcText) => {
  const date = new Date(utcText);
  return Number.isNaN(date.getTime()) ? '' : `since ${clock(date)}`;
};

const alarmKey = ({kind, rotor}) => `${kind} ${rotor ?? ''}`;

/** "Rotor 2: 12 samples …" */
const alarmText = ({rotor, text}) =>
    (rotor ? `Rotor ${rotor}: ${text}` : text[0].toUpperCase() + text.slice(1));

const alarmItem = (alarm) =>
    h('li', {}, h('span', {class: 'sign', 'aria-hidden': 'true'}, '⚠'), ' ',
      h('strong', {}, alarmText(alarm)), ' ', h('span', {class: 'since'}, since(alarm.since_utc)));

function startAlarms() {
  const none = h('p', {class: 'none'}, '✓ No alarms');
  // there from the start: what is added to a live region is spoken, the region itself is not
  const list = h('ul'), spoken = h('div', {role: 'alert'}, list);
  byId('alarms').append(none, spoken);
  sound.muted = remembered(mutedKey) === 'yes';
  byId('sound').addEventListener('click', toggleSound);
  for (const gesture of ['pointerdown', 'keydown'])
    addEventListener(
        gesture,
        (event) => event.target !== byId('sound') && sound.context?.state !== 'running' && wakeSound());
  showSound();
  let active = [];
  on('alarms', (alarms) => {
    const before = new Set(active.map(alarmKey));
    active = alarms.active;
    none.hidden = active.length > 0;
    setClass(byId('alarms'), 'active', active.length > 0);
    const keys = active.map((a) => alarmKey(a) + a.text).join();
    if (list.dataset.keys !== keys) list.replaceChildren(...active.map(alarmItem));
    list.dataset.keys = keys;
    account.alarms = active.length;
    if (active.some((alarm) => !before.has(alarmKey(alarm)))) beep();
  });
  setInterval(() => active.length > 0 && performance.now() - sound.last_ms > beepAgain_ms && beep(), 1000);
}
