// The way to the server: events that come in, commands that go out, and what is done while there is no
// server.

const patience_ms =
    5000;  // `state` comes every quarter of a second, so this long without a word means that it is lost
const longest_wait_ms = 4000;

const listeners = new Map();

/** Calls listen(data) on each event of that name. */
function on(event, listen) {
  if (!listeners.has(event)) listeners.set(event, []);
  listeners.get(event).push(listen);
}

/** One listener's failure is told and does not keep the event from the others. */
function emit(event, data) {
  for (const listen of listeners.get(event) ?? []) {
    try {
      listen(data);
    } catch (error) {
      fail(error);
    }
  }
}

/** In the page's text, not in its tree: to parse that would offend against this page's policy on styles. */
const tokenIn = (html) => html.match(/<meta name="token" content="([^"]*)"/)?.[1] ?? '';

const link = {
  token: tokenIn(document.head.innerHTML),
  connected: false,
  since: new Date(),  // of being connected, or of not being so
  refused: false,     // the server is there and does not know this page's address
  heard_ms: 0,
  attempts: 0,
  source: null,
};

/** With --listen the address holds the token, and all that is asked for needs it. */
const address = (path) => path + location.search;

function changeLink(connected, refused = false) {
  if (link.connected !== connected) link.since = new Date();
  Object.assign(link, {connected, refused});
  emit('link', link);
}

function connect() {
  const source = new EventSource(address('/events'));
  link.source = source;
  link.heard_ms = performance.now();
  for (const event of ['hello', 'frames', 'state', 'spectrum', 'campaign', 'alarms']) {
    source.addEventListener(event, ({data}) => {
      link.heard_ms = performance.now();
      link.attempts = 0;
      if (!link.connected) changeLink(true);
      emit(event, JSON.parse(data));
    });
  }
  source.onerror = () => lose(source);
}

/** The browser would try again by itself, but neither after a refusal nor with a new token. */
function lose(source) {
  source.close();
  if (source !== link.source) return;
  link.source = null;
  changeLink(false, link.refused);
  setTimeout(connectAgain, Math.min(longest_wait_ms, 250 * 2 ** link.attempts++));
}

/** A server that was started anew has another token, which its page tells. */
async function connectAgain() {
  try {
    const answer = await fetch(address('/'), {cache: 'no-store'});
    if (!answer.ok) {
      changeLink(false, true);
    } else {
      link.token = tokenIn(await answer.text());
      link.refused = false;
      connect();
      return;
    }
  } catch {
    changeLink(false);  // nobody is there
  }
  setTimeout(connectAgain, Math.min(longest_wait_ms, 250 * 2 ** link.attempts++));
}

/** What the server says of a command: {ok, text}. */
async function answerTo(command, values) {
  try {
    const answer = await fetch(address('/command'), {
      method: 'POST',
      headers: {'Content-Type': 'application/json'},
      body: JSON.stringify({...values, token: link.token, command}),
    });
    const {ok, error, text} = await answer.json().catch(() => ({}));
    if (answer.ok && ok) return {ok: true, text};
    return {ok: false, text: error ?? `The server refused it (HTTP ${answer.status}).`};
  } catch {
    return {ok: false, text: 'The server cannot be reached.'};
  }
}

/**
 * Sends a command and says what came of it; true: it was done. `done` is said where the server says nothing.
 */
async function send(command, values, done) {
  const {ok, text} = await answerTo(command, values);
  say(ok ? text ?? done : `Not done: ${text}`, ok);
  return ok;
}

function startConnection() {
  connect();
  setInterval(() => {
    if (link.source && performance.now() - link.heard_ms > patience_ms) lose(link.source);
    emit('link', link);  // the time since then goes on
  }, 1000);
}
