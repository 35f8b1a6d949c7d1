// What the parts of the page are made of, and its account of itself.

const errors = [];
const account = {
  errors,
  events: {},
  drawn: 0,
  beeps: 0,
  connected: false
};

/** For tests, and for whoever wonders: how the page is. */
function tell() {
  document.documentElement.dataset.live = JSON.stringify(account);
}

function fail(error) {
  errors.push(String(error?.stack ?? error));
  errors.splice(0, errors.length - 20);
  tell();
}
addEventListener('error', (event) => fail(event.error ?? event.message));
addEventListener('unhandledrejection', (event) => fail(event.reason));

const byId = (id) => document.getElementById(id);

/** Sets a text, and touches the page only where it is another one: much comes four times a second. */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

function setClass(element, name, wanted) {
  if (element.classList.contains(name) !== wanted) element.classList.toggle(name, wanted);
}

let forget;

/** What came of a command or a key, at the window's foot for a while. */
function say(text, well = true) {
  const line = byId('said');
  line.className = well ? 'well' : 'not-well';
  line.textContent = text;
  clearTimeout(forget);
  forget = setTimeout(() => (line.textContent = ''), well ? 6000 : 15_000);
}

/** A button that stays reachable by keyboard when it cannot be used: it then says why. */
function actionButton(text, act, attributes = {}) {
  const button = h('button', {type: 'button', ...attributes}, text);
  button.refuse = '';
  button.addEventListener('click', () => (button.refuse ? say(button.refuse, false) : act()));
  return button;
}

/** `why` is empty where the button can be used. */
function refuse(button, why) {
  if (button.refuse === why) return;
  button.refuse = why;
  if (why)
    button.setAttribute('aria-disabled', 'true');
  else
    button.removeAttribute('aria-disabled');
}

let numberOfFields = 0;

/** {place, input}: a field under its label, with a hint that is read out along with it. */
function field(label, hint, attributes = {}, options = null) {
  const id = `field-${++numberOfFields}`, hintId = `${id}-hint`;
  const input = options ? h('select', {id, ...attributes}, options.map((o) => h('option', {value: o}, o))) :
                          h('input', {id, 'aria-describedby': hintId, autocomplete: 'off', ...attributes});
  const place = h('div', {class: 'field'}, h('label', {for: id
                  }, prose(label)), input);
  const hintPlace = h('span', {class: 'hint', id: hintId}, prose(hint));
  if (!options) place.append(hintPlace);
  return {place, input, hint: hintPlace};
}

/** A question in a dialog: a text where `label` is given, else yes or no. Null: it was called off. */
function ask(title, {label, accept, explain = '', value = ''}) {
  return new Promise((answered) => {
    const text = label ? field(label, explain, {required: '', maxlength: '500', value}) : null;
    const titleId = `dialog-${++numberOfFields}`;
    const form =
        h('form', {}, h('h2', {id: titleId}, prose(title)), text ? text.place : h('p', {}, prose(explain)),
          h('div', {class: 'dialog-buttons'}, h('button', {type: 'submit', class: 'main'}, accept),
            h('button', {type: 'button', click: () => dialog.close()}, 'Cancel')));
    const dialog = h('dialog', {'aria-labelledby': titleId}, form);
    let answer = null;
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      answer = text ? text.input.value.trim() : true;
      if (answer !== '') dialog.close();
    });
    dialog.addEventListener('close', () => {
      dialog.remove();
      answered(answer);
    });
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** "1 h 04 min", "3.2 s" */
function duration(seconds) {
  if (!known(seconds)) return '–';
  if (seconds < 60) return `${fixed(seconds, seconds < 10 ? 1 : 0)} s`;
  const minutes = Math.floor(seconds / 60);
  if (minutes < 60) return `${minutes} min ${String(Math.floor(seconds % 60)).padStart(2, '0')} s`;
  return `${Math.floor(minutes / 60)} h ${String(minutes % 60).padStart(2, '0')} min`;
}

/** "12.3 GB" */
function bytes(value) {
  if (!known(value)) return '–';
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  const power = Math.min(4, Math.max(0, Math.floor(Math.log10(Math.max(1, value)) / 3)));
  return `${fixed(value / 1000 ** power, power ? 1 : 0)} ${units[power]}`;
}

const clock = (date) => date.toTimeString().slice(0, 8);

const redraws = [];

/** Calls redraw() whenever the width or the colours have changed. */
const onNewLook = (redraw) => redraws.push(redraw);

function watchLook() {
  let width = innerWidth, timer;
  const redrawAll = () => redraws.forEach((redraw) => redraw());
  addEventListener('resize', () => {
    if (innerWidth === width) return;
    width = innerWidth;
    clearTimeout(timer);
    timer = setTimeout(redrawAll, 150);
  });
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', redrawAll);
}
