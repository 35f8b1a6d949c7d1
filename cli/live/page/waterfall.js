// The spectra of the last two minutes, one row each, the newest on top.

const waterfallRows = 120;
const mostColumns = 1024;

const waterfall = {
  rotor: 0,
  spectra: [],
  df_hz: 0,
  canvas: null,
  place: null,
  greatest: null,
  least: null
};

/**
 * The greatest of each group of bins, so that a line stays one; float32, which bounds what two minutes take.
 */
function condensed(amplitude) {
  const group = Math.ceil(amplitude.length / mostColumns);
  const columns = new Float32Array(Math.ceil(amplitude.length / group));
  amplitude.forEach((value, k) => {
    const column = Math.floor(k / group);
    if (k > 0 && value > columns[column]) columns[column] = value;
  });
  return columns;
}

/** plasma at 0 to 1 */
function plasmaAt(position) {
  const at = Math.min(Math.max(position, 0), 1) * (plasma.length - 1);
  const k = Math.min(Math.floor(at), plasma.length - 2);
  const channel = (colour, c) => parseInt(colour.slice(1 + 2 * c, 3 + 2 * c), 16);
  return [0, 1, 2].map((c) => channel(plasma[k], c) * (1 - at + k) + channel(plasma[k + 1], c) * (at - k));
}

const plasmaTable = Array.from({length: 256}, (_, i) => plasmaAt(i / 255));

const median = (values) => Float32Array.from(values).sort()[values.length >> 1];

/**
 * From just below the quietest spectrum's floor, so that noise is dark but not lost, to the greatest line.
 */
function levelsOf(rows) {
  let greatest = 0, floor = Infinity;
  for (const row of rows) {
    for (const value of row) greatest = Math.max(greatest, value);
    floor = Math.min(floor, median(row));
  }
  if (!(greatest > 0)) return {least: -1, greatest: 0};
  return {least: Math.log10(Math.max(floor, greatest * 1e-6)) - 0.3, greatest: Math.log10(greatest)};
}

/** One pixel a spectrum and a column; the screen stretches it. */
function drawWaterfall() {
  const {spectra, rotor, canvas, scaleText} = waterfall;
  if (spectra.length === 0) return;
  const rows = spectra.map(({columns}) => columns[rotor]);
  const width = rows.at(-1).length;
  canvas.width = width;
  canvas.height = waterfallRows;
  const context = canvas.getContext('2d');
  const image = context.createImageData(width, rows.length);
  const {least, greatest} = levelsOf(rows);
  rows.forEach((row, age) => {
    const line = rows.length - 1 - age;
    for (let column = 0; column < width; ++column) {
      const level = row[column] > 0 ? (Math.log10(row[column]) - least) / (greatest - least) : 0;
      const colour = plasmaTable[Math.round(255 * Math.min(Math.max(level, 0), 1))];
      image.data.set([...colour, 255], 4 * (line * width + column));
    }
  });
  context.putImageData(image, 0, 0);
  const unit = spectrum.latest?.unit ?? '';
  setText(
      scaleText,
      `dark: ${(10 ** least).toPrecision(1)} ${unit} or less; bright: ${(10 ** greatest).toPrecision(1)} ${
          unit}`);
}

function startWaterfall() {
  waterfall.canvas = h('canvas', {
    class: 'waterfall',
    role: 'img',
    'aria-label': 'Waterfall: spectra of the last two minutes, newest on top, same frequencies as above'
  });
  waterfall.scaleText = h('span', {class: 'soft'});
  const controls = h('div', {class: 'figure-head'});
  byId('spectrum')
      .append(
          controls,
          h('div', {class: 'beneath'}, waterfall.canvas,
            h('p', {class: 'soft'}, 'newest on top, one row a spectrum; ', waterfall.scaleText)));
  on('hello', ({rotors}) => {
    const names = Object.fromEntries(Array.from({length: rotors}, (_, i) => [String(i), String(i + 1)]));
    const chooser = choice('Waterfall of rotor', names, (chosen) => {
      waterfall.rotor = Number(chosen);
      drawWaterfall();
    });
    if (controls.childElementCount === 0) controls.append(chooser);
  });
  on('spectrum', ({amplitude, df_hz, unit}) => {
    if (df_hz !== waterfall.df_hz || unit !== waterfall.unit) waterfall.spectra = [];
    Object.assign(waterfall, {df_hz, unit});
    waterfall.spectra.push({columns: amplitude.map(condensed)});
    if (waterfall.spectra.length > waterfallRows) waterfall.spectra.shift();
    if (!document.hidden) drawWaterfall();
  });
}
