// ΔC_T and U over the tunnel's cross-section, as far as the locations that are done tell.

const liveFields = {
  delta_ct: {
    title: 'Change of C_T against OT',
    symbol: 'ΔC_T',
    positive: 'red: more thrust than in the middle of the tunnel; blue: less',
  },
  uneven_thrust: {
    title: 'Uneven thrust U',
    symbol: 'U',
    positive: 'blue: the right pair lifts less; red: the left pair',
  },
};

/** A colour of a scale of the report, [[position, "#rrggbb"], …], at 0 to 1. */
function colourAt(colours, position) {
  const at = Math.min(Math.max(position, 0), 1) * (colours.length - 1);
  const k = Math.min(Math.floor(at), colours.length - 2);
  const channel = (colour, c) => parseInt(colour[1].slice(1 + 2 * c, 3 + 2 * c), 16);
  return [0, 1, 2].map(
      (c) => Math.round(channel(colours[k], c) * (1 - at + k) + channel(colours[k + 1], c) * (at - k)));
}

/** A grid's value at a point, bilinear; null outside. */
function valueAt(grid, values, y, z) {
  const cell = (nodes, at) => {
    const k = Math.min(Math.max(nodes.findIndex((node) => node > at) - 1, 0), nodes.length - 2);
    const inside = at >= nodes[0] && at <= nodes.at(-1);
    const from = at >= nodes.at(-1) ? nodes.length - 2 : k;
    return inside ? [from, (at - nodes[from]) / (nodes[from + 1] - nodes[from])] : null;
  };
  const column = cell(grid.y_norm, y), row = cell(grid.z_norm, z);
  if (!column || !row) return null;
  const [c, s] = column, [r, t] = row;
  const mixed = (line) => line[c] * (1 - s) + line[c + 1] * s;
  return mixed(values[r]) * (1 - t) + mixed(values[r + 1]) * t;
}

/** 1, 2 or 5 times a power of ten, not below a positive number. */
function roundedUp(value) {
  const power = 10 ** Math.floor(Math.log10(value));
  return [1, 2, 5, 10].map((m) => m * power).find((step) => step >= value * (1 - 1e-9));
}

/** What of a field is drawn: itself around zero, or its U95 from zero. */
function layerOfMap(map, layer) {
  const isValue = layer === 'value';
  const values = isValue ? map.value_percent : map.u95_percent;
  const greatest = roundedUp(Math.max(1e-3, ...values.flat().map(Math.abs)));
  return {
    values,
    greatest,
    least: isValue ? -greatest : 0,
    colours: isValue ? diverging : sequential,
    signed: isValue,
  };
}

const mapSize = 240;  // pixels of the drawing, which the page stretches

function drawField(canvas, map, {values, least, greatest, colours}) {
  canvas.width = canvas.height = mapSize;
  const context = canvas.getContext('2d');
  const image = context.createImageData(mapSize, mapSize);
  const norm = (pixel) => (2 * (pixel + 0.5)) / mapSize - 1;
  for (let row = 0; row < mapSize; ++row) {
    for (let column = 0; column < mapSize; ++column) {
      const value = valueAt(map, values, norm(column), -norm(row));
      const colour =
          known(value) ? [...colourAt(colours, (value - least) / (greatest - least)), 255] : [0, 0, 0, 0];
      image.data.set(colour, 4 * (row * mapSize + column));
    }
  }
  context.putImageData(image, 0, 0);
}

function drawBar(canvas, {colours}) {
  canvas.width = 1;
  canvas.height = 128;
  const context = canvas.getContext('2d');
  for (let i = 0; i < 128; ++i) {
    context.fillStyle = `rgb(${colourAt(colours, 1 - i / 127).join(',')})`;
    context.fillRect(0, i, 1, 1);
  }
}

/** A place in percent of a frame whose corners are ȳ, z̄ = ±1, with room for what stands on the edge. */
const across = (y_norm) => `${50 + 50 * y_norm}%`;
const down = (z_norm) => `${50 - 50 * z_norm}%`;

/** Crosses where something was measured. */
function crossAt({label, y_norm, z_norm}) {
  const cross = h('span', {class: 'cross', title: label, 'aria-hidden': 'true'}, '✕');
  cross.style.left = across(y_norm);
  cross.style.top = down(z_norm);
  return cross;
}

/** Where the field is greatest and least, for those who cannot see colours. */
function extremes(map, {symbol}) {
  let least = null, greatest = null;
  map.value_percent.forEach((line, r) => line.forEach((value, c) => {
    if (!known(value)) return;
    const node = {value, u95: map.u95_percent[r][c], y: map.y_norm[c], z: map.z_norm[r]};
    if (!least || value < least.value) least = node;
    if (!greatest || value > greatest.value) greatest = node;
  }));
  const at = ({value, u95, y, z}) => `${withU95(value, u95, true)} % at ȳ ${fixed(y, 2)}, z̄ ${fixed(z, 2)}`;
  return least ? `${symbol} from ${at(least)} to ${at(greatest)}` : '';
}

function makeMap(name) {
  const {title, positive} = liveFields[name];
  const canvas = h('canvas', {class: 'field', role: 'img'});
  const frame = h('div', {class: 'tunnel'}, canvas);
  const bar = h('canvas', {class: 'bar', 'aria-hidden': 'true'});
  const ticks = h('div', {class: 'ticks'});
  const under = h('p', {class: 'under', 'aria-hidden': 'true'}, ' ');
  const summary = h('p', {class: 'soft'});
  const head = h('h3', {}, prose(`${title} [%]`));
  const element =
      h('div', {class: 'live-map', hidden: ''}, head,
        h('div', {class: 'with-bar'}, tunnelFrame(frame), h('div', {class: 'bar-side'}, bar, ticks)), under,
        summary);
  const parts =
      {name, canvas, frame, bar, ticks, under, summary, head, element, positive, map: null, layer: 'value'};
  frame.addEventListener('pointermove', (event) => pointAt(parts, event));
  frame.addEventListener('pointerleave', () => setText(under, ' '));
  return parts;
}

/** Ceiling, ground and walls around a square. */
const tunnelFrame = (inner) =>
    h('div', {class: 'tunnel-frame'}, h('span', {class: 'side-name top', 'aria-hidden': 'true'}, 'ceiling'),
      h('span', {class: 'side-name bottom', 'aria-hidden': 'true'}, 'wall ←  ground  → wall'), inner);

function pointAt({map, frame, under, name}, event) {
  if (!map) return;
  const box = frame.getBoundingClientRect();
  const y = (2 * (event.clientX - box.left)) / box.width - 1,
        z = 1 - (2 * (event.clientY - box.top)) / box.height;
  const value = valueAt(map, map.value_percent, y, z), u95 = valueAt(map, map.u95_percent, y, z);
  if (known(value))
    setText(
        under,
        `ȳ ${fixed(y, 2)}, z̄ ${fixed(z, 2)}: ${liveFields[name].symbol} ${withU95(value, u95, true)} %`);
}

function drawMapParts(parts, locations) {
  const {map, canvas, frame, bar, ticks, summary, element, name} = parts;
  element.hidden = !map;
  if (!map) return;
  const layer = layerOfMap(map, parts.layer);
  drawField(canvas, map, layer);
  drawBar(bar, layer);
  const {least, greatest, signed} = layer;
  ticks.replaceChildren(...[greatest, (greatest + least) / 2, least].map(
      (v) => h('span', {}, fixed(v, Math.max(0, 1 - Math.floor(Math.log10(greatest))), signed))));
  setText(parts.head.lastChild, '');
  parts.head.replaceChildren(
      ...prose(`${parts.layer === 'value' ? '' : 'U95 of: '}${liveFields[name].title} [%]`));
  frame.replaceChildren(canvas, ...locations.filter((l) => l.done > 0 && known(l.y_norm)).map(crossAt));
  const text = extremes(map, liveFields[name]);
  canvas.setAttribute('aria-label', `Map of ${liveFields[name].symbol} over the cross-section: ${text}`);
  summary.replaceChildren(...prose(`${text}; ${
      parts.layer === 'value' ? parts.positive : 'darker: known less well'}. Crosses: measured.`));
}

/** "ΔC_T +1.2 ± 0.3 %, U …" at a location; empty where there is no map. */
function mapsAt(campaign, {y_norm, z_norm}) {
  if (!campaign?.maps || !known(y_norm)) return '';
  return Object.entries(liveFields)
      .filter(([name]) => campaign.maps[name])
      .map(([name, {symbol}]) => {
        const map = campaign.maps[name];
        return `${symbol} ${
            withU95(
                valueAt(map, map.value_percent, y_norm, z_norm),
                valueAt(map, map.u95_percent, y_norm, z_norm), true)} %`;
      })
      .join(', ');
}

function startMaps() {
  const maps = Object.keys(liveFields).map(makeMap);
  const why = h('p', {class: 'absent'}, 'No maps yet.');
  let latest = null;
  const redraw = () => latest && maps.forEach((parts) => drawMapParts(parts, latest.locations));
  const layers = choice('Shown', {value: 'value', u95: 'its U95'}, (layer) => {
    for (const parts of maps) parts.layer = layer;
    redraw();
  });
  layers.hidden = true;
  byId('maps').append(why, layers, h('div', {class: 'maps'}, maps.map(({element}) => element)));
  on('campaign', (campaign) => {
    latest = campaign;
    why.hidden = layers.hidden = true;
    if (campaign.maps) {
      layers.hidden = false;
    } else {
      why.hidden = false;
      setText(why, `No maps yet: ${campaign.maps_reason ?? 'too few locations are done'}.`);
    }
    for (const parts of maps) parts.map = campaign.maps?.[parts.name] ?? null;
    account.maps = maps.filter(({map}) => map).length;
    redraw();
  });
}
