// Elements, texts and numbers.

/** An element: h("p", {class: "soft"}, "text", child, [children]). Texts stay texts, whatever they hold. */
function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === 'function')
      element.addEventListener(name, value);
    else
      element.setAttribute(name, value);
  }
  element.append(...children.flat(Infinity));
  return element;
}

/** Text with `code` in backticks and the subscripts of C_T, U95 and the tunnel's lengths, as nodes. */
function prose(text) {
  return text.split(/(`[^`]*`|\b[A-Za-z]_[A-Za-z]\b|\bU95\b)/).map((part) => {
    if (part.startsWith('`')) return code(part.slice(1, -1));
    if (/^[A-Za-z]_[A-Za-z]$/.test(part)) return h('span', {class: 'symbol'}, part[0], h('sub', {}, part[2]));
    if (part === 'U95') return h('span', {class: 'symbol'}, 'U', h('sub', {}, '95'));
    return part;
  });
}

const known = (value) => value !== null && value !== undefined && Number.isFinite(value);

/** "−0.12"; what is not known is a dash. */
function fixed(value, decimals, signed = false) {
  if (!known(value)) return '–';
  const text = Math.abs(value).toFixed(decimals);
  const zero = Number(text) === 0;
  return (value < 0 && !zero ? '−' : signed && !zero ? '+' : '') + text;
}

/** Decimals that show an uncertainty to two digits. */
const decimalsFor = (u95) =>
    (known(u95) && u95 > 0 ? Math.min(8, Math.max(0, 1 - Math.floor(Math.log10(u95)))) : 4);

/** "0.10560 ± 0.00021"; an uncertainty of 0 is one that nothing is known of. */
function withU95(value, u95, signed = false) {
  if (value === 0 && u95 === 0) return '0';  // by definition
  const decimals = decimalsFor(u95);
  return known(u95) && u95 > 0 ? `${fixed(value, decimals, signed)} ± ${fixed(u95, decimals)}` :
                                 fixed(value, decimals, signed);
}

/** Text for Plotly, which reads tags in texts. */
const plain = (text) => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');

/** One text of the sentences that there are. */
const sentences = (...parts) => parts.filter(Boolean).join(' ');

const counted = (n, noun) => `${n.toLocaleString('en')} ${noun}${n === 1 ? '' : 's'}`;

/** "2026-03-02 08:00" */
const utc = (seconds) => new Date(seconds * 1000).toISOString().slice(0, 16).replace('T', ' ');

/**
 * A table that scrolls within the page, under its title. Columns: {name, cell(row), text: set flush left}.
 * `kind` 'whole': as high as its rows are.
 */
function table(title, columns, rows, kind = '') {
  const side = (column) => (column.text ? {class: 'text'} : {});
  return h(
      'div', {class: 'table'}, h('p', {class: 'table-title'}, prose(title)),
      h('div', {class: `scroll ${kind}`, tabindex: '0', role: 'region', 'aria-label': title},
        h('table', {'aria-label': title},
          h('thead', {}, h('tr', {}, columns.map((c) => h('th', {scope: 'col', ...side(c)}, prose(c.name))))),
          h('tbody', {},
            rows.map((row) => h('tr', {}, columns.map((c) => h('td', side(c), c.cell(row)))))))));
}

/** A command line, which breaks between its words only. */
const code = (line) =>
    h('code', {}, line.split(' ').flatMap((word, i) => [i ? ' ' : '', h('span', {class: 'word'}, word)]));

/** A word that stands for a verdict; kinds: ok, note, problem, neutral. */
const badge = (kind, text) => h('span', {class: `badge ${kind}`}, text);

/** "Numbers: tunnelrig reduce …": what makes the numbers again. */
const remade = (line) => h('span', {class: 'remade'}, 'Numbers: ', code(line));

/** What is long and rarely read: filled when it is opened. */
function folded(summary, fill) {
  const details = h('details', {}, h('summary', {}, prose(summary)));
  details.addEventListener('toggle', () => details.append(fill()), {once: true});
  return details;
}

/**
 * A figure: its title, controls, plots, and a caption that ends with the command that remakes the numbers.
 */
function figure(title, controls, plots, caption, command) {
  return h(
      'figure', {}, h('div', {class: 'figure-head'}, h('h3', {}, prose(title)), controls), plots,
      h('figcaption', {}, prose(caption), ' ', remade(command)));
}

/** Radio buttons; `change` is called with the value chosen. */
function choice(legend, options, change) {
  const name = `choice-${legend}-${Math.random().toString(36).slice(2)}`;
  return h(
      'fieldset', {class: 'choice'}, h('legend', {}, legend),
      Object.entries(options).map(([value, label], i) => {
        const input = h('input', {type: 'radio', name, value, change: () => change(value)});
        input.checked = i === 0;
        return h('label', {}, input, h('span', {}, prose(label)));
      }));
}

/** A check box; `change` is called with its state. */
function tick(label, checked, change) {
  const input = h('input', {type: 'checkbox', change: () => change(input.checked)});
  input.checked = checked;
  return h('label', {class: 'tick'}, input, ' ', label);
}
