// C_T and U by location: the thesis's figure 4.17, a curve for each column of the tunnel.

const quantities = {
  c_t: {plain: 'C<sub>T</sub>', unit: '', axis: 'C<sub>T</sub> [–]'},
  u_percent: {plain: 'U', unit: ' %', axis: 'U [%]'},
};

/** "H3" where all locations of a column are the thesis's of that name. */
function columnName(locations) {
  const names =
      new Set(locations.map((l) => (l.location === 'OT' ? 'H0' : /^(H\d+)V-?\d+$/.exec(l.location)?.[1])));
  return names.size === 1 ? [...names][0] : undefined;
}

/** The tunnel's columns from the middle outwards: {y_norm, locations, name, label}. */
function columnsOf(locations) {
  const columns = new Map();
  for (const location of locations.filter((l) => known(l.y_norm))) {
    const key = location.y_norm.toFixed(3);
    if (!columns.has(key)) columns.set(key, {y_norm: location.y_norm, locations: []});
    columns.get(key).locations.push(location);
  }
  for (const column of columns.values()) {
    column.locations.sort((a, b) => a.z_norm - b.z_norm);
    column.name = columnName(column.locations);
    const y = `ȳ = ${fixed(column.y_norm, 2)}`;
    column.label = column.name ? `${column.name} (${y})` : y;
  }
  return [...columns.values()].sort((a, b) => Math.abs(a.y_norm) - Math.abs(b.y_norm) || a.y_norm - b.y_norm);
}

function describe(location, quantity) {
  const {plain: symbol, unit} = quantities[quantity];
  const {mean, u95} = location[quantity];
  const made = `${counted(location.runs, 'run')}, ${counted(location.sessions, 'session')}`;
  return `${plain(location.location)}<br>${symbol} ${withU95(mean, u95)}${unit}<br>${made}`;
}

/** Means with U95 as error bars. */
function means(locations, x, quantity, colour, more) {
  return {
    type: 'scatter',
    mode: 'lines+markers',
    x,
    y: locations.map((l) => l[quantity].mean),
    error_y: {array: locations.map((l) => l[quantity].u95), color: colour, thickness: 1.4, width: 4},
    line: {color: colour, width: 1.6},
    text: locations.map((l) => describe(l, quantity)),
    hovertemplate: '%{text}<extra></extra>',
    ...more,
    marker: {color: colour, size: 8, ...more.marker},
  };
}

/** The single runs of some locations as faint points. */
function singles(locations, x, quantity, colour, more) {
  const {runs} = report;
  const position = new Map(locations.map((l, i) => [l.location, x[i]]));
  const chosen =
      runs.run.map((_, i) => i).filter((i) => position.has(runs.location[i]) && known(runs[quantity][i]));
  return {
    type: 'scatter',
    mode: 'markers',
    x: chosen.map((i) => position.get(runs.location[i])),
    y: chosen.map((i) => runs[quantity][i]),
    text: chosen.map((i) => `run ${plain(runs.run[i])}, session ${plain(runs.session[i])}`),
    marker: {color: colour, size: 5, opacity: isDark() ? 0.45 : 0.3},
    showlegend: false,
    hovertemplate: '%{text}<br>%{y:.5~g}<extra></extra>',
    ...more,
  };
}

const heightAxis = (more = {}) => axis(heightTitle, {range: [-1.08, 1.08], zeroline: false, ...more});

const kApart = 0.012;  // of z_norm between curves, so that error bars of one height do not cover each other

function drawColumns(columns, quantity, withSingles) {
  const data = columns.flatMap((column, i) => {
    const colour = orderedColour(i, columns.length);
    const x = column.locations.map((l) => l.z_norm + kApart * (i - (columns.length - 1) / 2));
    const group = {legendgroup: column.label};
    const look = {name: plain(column.label), marker: {symbol: symbols[i % symbols.length]}, ...group};
    const curve = means(column.locations, x, quantity, colour, look);
    return withSingles ? [singles(column.locations, x, quantity, colour, group), curve] : [curve];
  });
  const yaxis = axis(quantities[quantity].axis, {...bySteps, zeroline: quantity === 'u_percent'});
  return {data, layout: {xaxis: heightAxis(), yaxis}};
}

/** Campaigns without places in a tunnel: one point a location, side by side. */
function drawLabels(locations, quantity, withSingles) {
  const colour = rotorColours()[0];
  const x = locations.map((l) => plain(l.location));
  const points = means(locations, x, quantity, colour, {mode: 'markers', showlegend: false});
  return {
    data: withSingles ? [singles(locations, x, quantity, colour, {}), points] : [points],
    layout: {xaxis: axis('location', {type: 'category'}), yaxis: axis(quantities[quantity].axis, bySteps)},
  };
}

function locationFigure(title, quantity, tells) {
  const {locations} = report.sections.locations;
  const columns = columnsOf(locations);
  let withSingles = !isNarrow(innerWidth);
  const place = plot(
      `${title}; its numbers are in the table of locations`, (width) => (isNarrow(width) ? 460 : 520),
      () =>
          (columns.length ? drawColumns(columns, quantity, withSingles) :
                            drawLabels(locations, quantity, withSingles)));
  const box = tick('single runs', withSingles, (on) => {
    withSingles = on;
    redraw(place);
  });
  const shown = columns.length ?
      sentences(
          'One curve for each distance from the tunnel’s middle plane, by height; points of one height are set',
          'apart a little, so that their bars can be read.') :
      'No location has a place in a tunnel (y_norm and z_norm are empty), so they stand side by side.';
  const caption = sentences(
      shown, tells,
      'Faint points, if wanted: single runs. Error bars: U95 of the mean, from the repeats, the sessions and what',
      'locations share; all points share their calibration, so they move together.');
  return figure(title, box, place, caption, command('reduce', '--csv coefficients.csv'));
}

const locationsSection = () => locationFigure(
    'C_T against height', 'c_t',
    `C_T is of all rotors together, over ½ρΩ²R² and ${report.sections.locations.area}.`);
/** What of U is the rig's and not the tunnel's, where a map tells. */
function offsetInU() {
  const offset = report.sections.maps.uneven_thrust?.offset;
  return offset && `The rig’s own offset of ${withU95(...offset, true)} % is in it, and taken out of the map.`;
}

const unevenSection = () => locationFigure(
    'U against height', 'u_percent',
    sentences(
        'U is the thrust of the right pair minus that of the left, over all four; negative rolls to the right.',
        offsetInU()));
