// The page, put together.

function showLink({connected, refused, since: from}) {
  const line = byId('connection');
  const lost = refused ?
      'Refused: the server was started anew with another token. Open the address that it printed.' :
      `Disconnected since ${clock(from)}. The page tries to reconnect.`;
  setText(byId('connection-text'), connected ? '✓ Connected' : lost);
  // apart from the text, which is spoken whenever it changes
  setText(byId('connection-time'), connected ? '' : ` ${duration(Math.round((Date.now() - from) / 1000))}`);
  setClass(line, 'lost', !connected);
  setClass(document.body, 'disconnected', !connected);
  if (account.connected !== connected) {
    account.connected = connected;
    tell();
  }
}

function showHead({campaign, program, mode, source, simulated, writable}) {
  setText(byId('campaign'), campaign ?? '');
  byId('facts').replaceChildren(
      ...(simulated ? [badge('note', 'simulated: no rig is behind this'), ' '] : []),
      ...(writable ? [] : [badge('note', 'read-only'), ' ']),
      // the whole version, with its commit, is behind the short one
      h('span', {title: program}, program.replace(/\+.*/, '')),
      mode === 'file' ? ', campaign file' : `, source ${source}`);
  const file = mode === 'file';
  for (const id of ['alarms', 'sound', 'measurement', 'spectrum', 'metadata']) byId(id).hidden = file;
  for (const id of ['signal', 'records']) setClass(byId(id), 'alone', file);
}

/** The window's title tells the run and alarms while the page stands behind others. */
function showTitle() {
  const {phase, run, alarms, connected} = account;
  const sign = !connected ? '✕ ' : alarms ? '⚠ ' : phase === 'recording' ? '● ' : '';
  const title = `${sign}${run ? `${run} – ` : ''}tunnelrig live`;
  if (document.title !== title) document.title = title;
}

function startPage() {
  if (!('EventSource' in window)) return;  // the page says so already
  byId('unsupported').remove();
  byId('page').hidden = false;
  for (const event of ['hello', 'frames', 'state', 'spectrum', 'campaign', 'alarms'])
    on(event, () => (account.events[event] = (account.events[event] ?? 0) + 1));
  on('hello', showHead);
  on('link', showLink);
  for (const start
           of [startControls, startAlarms, startMeans, startTraces, startHealth, startSpectrum, startMaps,
               startCrossSection, startRuns, startMetadata])
    start();
  watchLook();
  startConnection();
  setInterval(() => {
    tell();
    showTitle();
  }, 250);
}

startPage();
