// The two fields over the tunnel's cross-section, in the manner of the thesis's figures 5.58 and 5.59.

const fields = {
  delta_ct: {
    title: 'Change of C_T against OT',
    plain: 'ΔC<sub>T</sub>',
    of: 'ΔC_T',
    tells: 'Red: more thrust than in the middle of the tunnel; blue: less. The map is 0 at OT by definition.',
  },
  uneven_thrust: {
    title: 'Uneven thrust U',
    plain: 'U',
    of: 'U',
    tells:
        'The right pair minus the left pair, over all four. Blue (negative): the right pair lifts less and the ' +
        'vehicle rolls to the right; red: to the left. On the middle plane the map is 0 by symmetry.',
  },
};

/** 1, 2, 2.5 or 5 times a power of ten, not below a positive number. */
function niceStep(atLeast) {
  const power = 10 ** Math.floor(Math.log10(atLeast));
  return [1, 2, 2.5, 5, 10].map((m) => m * power).find((step) => step >= atLeast * (1 - 1e-9));
}

const decimalsOf = (step) => (String(Number(step.toPrecision(3))).split('.')[1] ?? '').length;

const rowsOf = (values, columns) => Array.from(
    {length: values.length / columns}, (_, row) => values.slice(row * columns, (row + 1) * columns));

/** Whether a location on that side of the middle plane was measured. */
const onSide = (maps, sign) => maps.locations.some((l) => sign * l.y_norm > 0);

/** What is drawn of a field: itself, from −greatest to greatest, or its U95, from 0. */
function layerOf(maps, field, layer) {
  const isValue = layer === 'value';
  const values = isValue ? maps[field].value_percent : maps[field].u95_percent;
  const largest = Math.max(1e-6, ...values.map(Math.abs));
  const step = niceStep(largest / 5), greatest = step * Math.ceil(largest / step);
  const {plain: symbol} = fields[field];
  const decimals = Math.max(2, decimalsOf(step) + 1);
  return {
    isValue,
    decimals,
    rows: rowsOf(values, maps.y_norm.length),
    others: rowsOf(isValue ? maps[field].u95_percent : maps[field].value_percent, maps.y_norm.length),
    step,
    greatest,
    lowest: isValue ? -greatest : 0,
    spacing: niceStep((Math.max(...values) - Math.min(...values) || 1) / (isValue ? 14 : 5)),
    title: isValue ? `${symbol} [%]` : `U<sub>95</sub>(${symbol}) [%]`,
    hover: isValue ? `${symbol} %{z:+.${decimals}f} ± %{customdata[0]} %` :
                     `U<sub>95</sub> %{z:.${decimals}f} %, of ${symbol} %{customdata[0]} %`,
  };
}

/**
 * Contour lines from column `from` to `to`; dashed where the map is the mirror image of what was measured.
 */
function lines(maps, layer, from, to, dash) {
  const reach = layer.spacing * Math.ceil(layer.greatest / layer.spacing);
  return {
    type: 'contour',
    x: maps.y_norm.slice(from, to),
    y: maps.z_norm,
    z: layer.rows.map((row) => row.slice(from, to)),
    autocontour: false,
    contours: {
      start: -reach,
      end: reach,
      size: layer.spacing,
      coloring: 'none',
      showlabels: true,
      labelformat: '~g',
      labelfont: {size: 11, color: '#1b1f24'},
    },
    line: {color: '#303030', width: 1.1, dash, smoothing: 1},
    showscale: false,
    showlegend: false,
    hoverinfo: 'skip',
  };
}

// Fixed: square axes, their titles and the bar's would push each other about without end.
const mapMargin = (narrow) => (narrow ? {l: 58, r: 28, t: 20, b: 118} : {l: 76, r: 118, t: 30, b: 60});

const mapHeight = (width) => (isNarrow(width) ? width + 76 : Math.min(600, 0.86 * width));

const kLetter_px = 7;  // of a number, as wide as it gets

const kBarBelow_px = 54;  // under the axes: their numbers and title stand in between

function colourBar({lowest, greatest, step, isValue, title}, width) {
  const narrow = isNarrow(width), {l, r, t, b} = mapMargin(narrow);
  const text = (tick) => fixed(tick, decimalsOf(step), isValue);
  const all = Array.from({length: Math.round((greatest - lowest) / step) + 1}, (_, i) => greatest - i * step);
  // Side by side long numbers would be turned round, out of the plot: then every second or third stands there.
  const room = (width - l - r) / (kLetter_px * (1 + Math.max(...all.map((tick) => text(tick).length))));
  const every = narrow ? Math.ceil(all.length / room) : 1;
  const ticks = all.filter((tick) => Math.round(tick / step) % every === 0);
  const below = {orientation: 'h', y: -kBarBelow_px / (mapHeight(width) - t - b), yanchor: 'top', x: 0.5};
  return {
    title: {text: title, side: narrow ? 'bottom' : 'top'},
    tickvals: ticks,
    ticktext: ticks.map(text),
    outlinewidth: 0,
    thickness: 14,
    ...(narrow ? below : {}),
  };
}

function heat(maps, layer, width) {
  const metres = (norm, perNorm) => fixed(norm * perNorm, 3);
  const customdata = layer.others.map(
      (row, r) => row.map(
          (other, c) =>
              [fixed(other, layer.decimals, !layer.isValue),
               metres(maps.y_norm[c], maps.y_m_per_norm),
               metres(maps.z_norm[r], maps.z_m_per_norm),
  ]));
  const place = 'ȳ %{x:.2f}, z̄ %{y:.2f}<br>y %{customdata[1]} m, z %{customdata[2]} m';
  return {
    type: 'heatmap',
    x: maps.y_norm,
    y: maps.z_norm,
    z: layer.rows,
    customdata,
    zsmooth: 'best',
    zmin: layer.lowest,
    zmax: layer.greatest,
    colorscale: layer.isValue ? diverging : sequential,
    colorbar: colourBar(layer, width),
    hovertemplate: `${layer.hover}<br>${place}<extra></extra>`,
  };
}

/** Hatching over what lies beyond the measured locations. */
const hatching = ({beyond: {y_norm: x, z_norm: y}}) => ({
  type: 'scatter',
  mode: 'lines',
  x,
  y,
  line: {color: '#707070', width: 0.8},
  showlegend: false,
  hoverinfo: 'skip',
});

/** The measured locations as crosses with a white edge, which say on hover what was measured. */
function crosses(maps, field) {
  const common = {
    type: 'scatter',
    mode: 'markers',
    x: maps.locations.map((l) => l.y_norm),
    y: maps.locations.map((l) => l.z_norm),
    showlegend: false,
    cliponaxis: false,
  };
  const cross = (width, color) => ({symbol: 'x-thin', size: 9, line: {width, color}});
  const {plain: symbol} = fields[field];
  const measured = (l) => `${plain(l.location)} as measured<br>${symbol} ${withU95(...l[field], true)} %`;
  return [
    {...common, marker: cross(4.5, '#ffffff'), hoverinfo: 'skip'},
    {
      ...common,
      marker: cross(1.8, '#101010'),
      text: maps.locations.map(measured),
      hovertemplate: '%{text}<extra></extra>',
    },
  ];
}

/** Moves numbers of contour lines from under the crosses: up or down, until they clear them. */
function clearCrosses(place) {
  const boxOf = (element) => element.getBoundingClientRect();
  const marks = [...place.querySelectorAll('.scatterlayer .point')].map(boxOf);
  for (const text of place.querySelectorAll('.contourlabels text:not([data-moved])')) {
    const box = boxOf(text);
    const mark = marks.find(
        (m) => m.left < box.right && m.right > box.left && m.top < box.bottom && m.bottom > box.top);
    if (!mark) continue;
    const upwards = box.top + box.bottom <= mark.top + mark.bottom;
    const shift = upwards ? mark.top - box.bottom : mark.bottom - box.top;
    text.setAttribute('transform', `translate(0 ${shift}) ${text.getAttribute('transform') ?? ''}`);
    text.dataset.moved = '';
  }
}

function afterMap(place) {
  clearCrosses(place);
  if (place.dataset.clears !== undefined) return;
  place.dataset.clears = '';
  place.on('plotly_afterplot', () => clearCrosses(place));  // a zoom places the numbers anew
}

function drawMap(maps, field, layerName, width) {
  const layer = layerOf(maps, field, layerName);
  const last = maps.y_norm.length, middle = (last - 1) / 2;
  const dash = (sign) => (onSide(maps, sign) ? 'solid' : 'dash');
  const side = {range: [-1, 1], constrain: 'domain', dtick: 0.5, zeroline: false, showgrid: false};
  return {
    data: [
      heat(maps, layer, width),
      hatching(maps),
      lines(maps, layer, 0, middle + 1, dash(-1)),
      lines(maps, layer, middle, last, dash(1)),
      ...crosses(maps, field),
    ],
    layout: {
      xaxis: axis('← wall  ȳ = 2y/(w<sub>t</sub> − w<sub>q</sub>) [–]  wall →', side),
      yaxis: axis(heightTitle, {...side, scaleanchor: 'x'}),
      margin: {...mapMargin(isNarrow(width)), autoexpand: false},
    },
    afterwards: afterMap,
  };
}

/** How well the field predicts a location that it was not shown. */
function fitOf({leave_one_out_rms_percent: rms, leave_one_out_standardised: standardised}) {
  const times = known(standardised) ? `, ${fixed(standardised, 2)} times what its uncertainty says` : '';
  return 'Each location predicted from all others is off by ' +
      `${fixed(rms, 2)} percentage points (root mean square)${times}.`;
}

/** What the rig adds to a field at every location, which the middle plane shows. */
function offsetOf({offset}) {
  if (!offset) return '';
  const [value, u95] = offset;
  const isSeen = known(u95) && Math.abs(value) > u95;
  return sentences(
      `The offset of the rig, ${withU95(value, u95, true)} %, is in the values measured at the crosses and`,
      'has been taken out of the map.',
      isSeen && 'Symmetry demands 0 of it: check the factors of propellers.csv, the arms and the cells.');
}

function mapFigure(maps, field) {
  const {title, of, tells} = fields[field];
  let layer = 'value';
  const label =
      `Map of ${title.toLowerCase()} over the cross-section; its numbers are in the table of locations`;
  const place = plot(label, mapHeight, (width) => drawMap(maps, field, layer, width));
  const layers = choice('Layer', {value: of, u95: `U95 of ${of}`}, (chosen) => {
    layer = chosen;
    redraw(place);
  });
  const mirrored = !(onSide(maps, -1) && onSide(maps, 1));
  const caption = sentences(
      tells, offsetOf(maps[field]), `Crosses: the ${maps.locations.length} measured locations.`,
      mirrored && 'Dashed lines: the mirror image of the measured half.',
      `Hatched: the ${fixed(maps.beyond.percent, 0)} % of the square beyond the locations and their mirror images,`,
      'where the map goes on as it is, which walls, ground and ceiling need not: U95 there is too small more often.',
      'U95, the half width of the 95 % interval, comes from the covariance of the locations (repeats, sessions,',
      `and what they share) and from the field in between (${maps.method.replaceAll('-', ' ')}).`,
      fitOf(maps[field]));
  return figure(title, layers, place, caption, command('map', '--out maps'));
}

const mapsSection = (maps) =>
    h('div', {class: 'pair'}, Object.keys(fields).map((field) => mapFigure(maps, field)));
