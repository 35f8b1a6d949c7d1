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
        'The right pair minus the left pair, over all four. Blue (negative): the right pair lifts less and the vehicle ' +
        'rolls to the right; red: to the left. On the middle plane it is 0 by symmetry.',
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

/**
 * Contour lines of the columns from `from` to `to`; dashed where the map is the mirror image of what was
 * measured.
 */
function lines(maps, z, from, to, dash, levels) {
  return {
    type: 'contour',
    x: maps.y_norm.slice(from, to),
    y: maps.z_norm,
    z: z.map((row) => row.slice(from, to)),
    autocontour: false,
    contours: {
      ...levels,
      coloring: 'none',
      showlabels: true,
      labelformat: '~g',
      labelfont: {size: 11, color: '#1b1f24'}
    },
    line: {color: '#303030', width: 1.1, dash, smoothing: 1},
    showscale: false,
    showlegend: false,
    hoverinfo: 'skip',
  };
}

function heat(maps, field, layer, z, greatest) {
  const u95 = layer === 'value' ? maps[field].u95_percent : maps[field].value_percent;
  const n = maps.y_norm.length;
  const customdata = maps.z_norm.map(
      (zn, row) => maps.y_norm.map(
          (yn, column) =>
              [fixed(u95[row * n + column], 2, layer !== 'value'), fixed(yn * maps.y_m_per_norm, 3),
               fixed(zn * maps.z_m_per_norm, 3)]));
  const {plain: symbol} = fields[field];
  const value = layer === 'value' ? `${symbol} %{z:+.2f} ± %{customdata[0]} %` :
                                    `U<sub>95</sub> %{z:.2f} % of ${symbol} %{customdata[0]} %`;
  return {
    type: 'heatmap',
    x: maps.y_norm,
    y: maps.z_norm,
    z,
    customdata,
    zsmooth: 'best',
    zmin: layer === 'value' ? -greatest : 0,
    zmax: greatest,
    colorscale: layer === 'value' ? diverging : sequential,
    hovertemplate:
        `${value}<br>ȳ %{x:.2f}, z̄ %{y:.2f}<br>y %{customdata[1]} m, z %{customdata[2]} m<extra></extra>`,
  };
}

/** The measured locations as crosses with a white edge, which say on hover what was measured. */
function crosses(maps, field) {
  const common = {
    type: 'scatter',
    mode: 'markers',
    x: maps.locations.map((l) => l.y_norm),
    y: maps.locations.map((l) => l.z_norm),
    showlegend: false,
    cliponaxis: false
  };
  const text = maps.locations.map(
      (l) => `${plain(l.location)} as measured<br>${fields[field].plain} ${withU95(...l[field], true)} %`);
  return [
    {...common, hoverinfo: 'skip', marker: {symbol: 'x-thin', size: 9, line: {width: 4.5, color: '#ffffff'}}},
    {
      ...common,
      text,
      hovertemplate: '%{text}<extra></extra>',
      marker: {symbol: 'x-thin', size: 9, line: {width: 1.8, color: '#101010'}}
    }
  ];
}

function drawMap(maps, field, layer, width) {
  const n = maps.y_norm.length, middle = (n - 1) / 2;
  const values = layer === 'value' ? maps[field].value_percent : maps[field].u95_percent;
  const z = rowsOf(values, n);
  const largest = Math.max(1e-6, ...values.map(Math.abs));
  const step = niceStep(largest / 5), greatest = step * Math.ceil(largest / step);
  const ticks = Array.from(
      {length: Math.round(greatest / step) * (layer === 'value' ? 2 : 1) + 1}, (_, i) => greatest - i * step);
  const spacing = niceStep((Math.max(...values) - Math.min(...values) || 1) / (layer === 'value' ? 14 : 5));
  const levels = {
    start: -spacing * Math.ceil(largest / spacing),
    end: spacing * Math.ceil(largest / spacing),
    size: spacing
  };
  const dash = (sign) => (maps.locations.some((l) => sign * l.y_norm > 0) ? 'solid' : 'dash');
  const narrow = isNarrow(width);
  const bar = {
    title: {
      text: layer === 'value' ? `${fields[field].plain} [%]` : `U<sub>95</sub>(${fields[field].plain}) [%]`,
      side: narrow ? 'bottom' : 'right'
    },
    tickvals: ticks,
    ticktext: ticks.map((t) => fixed(t, decimalsOf(step), layer === 'value')),
    outlinewidth: 0,
    thickness: 14,
    ...(narrow ? {orientation: 'h', y: -0.16, yanchor: 'top', x: 0.5} : {len: 1, lenmode: 'fraction'})
  };
  return {
    data: [
      {...heat(maps, field, layer, z, greatest), colorbar: bar},
      lines(maps, z, 0, middle + 1, dash(-1), levels), lines(maps, z, middle, n, dash(1), levels),
      ...crosses(maps, field)
    ],
    layout: {
      xaxis: axis(
          '← wall  ȳ = 2y/(w<sub>t</sub> − w<sub>q</sub>)  wall →',
          {range: [-1, 1], constrain: 'domain', dtick: 0.5, zeroline: false, showgrid: false}),
      yaxis: axis('← ground  z̄ = 2z/(h<sub>t</sub> − h<sub>q</sub>)  ceiling →', {
        range: [-1, 1],
        constrain: 'domain',
        scaleanchor: 'x',
        dtick: 0.5,
        zeroline: false,
        showgrid: false
      }),
      margin: {l: 10, r: narrow ? 10 : 90, t: 30, b: narrow ? 90 : 10},
    },
  };
}

function mapFigure(maps, field) {
  const {title, of, tells} = fields[field];
  const fit = maps[field];
  let layer = 'value';
  const place = plot(
      `Map of ${title.toLowerCase()} over the cross-section; its numbers are in the table of locations`,
      (width) => (isNarrow(width) ? width + 70 : Math.min(600, 0.86 * width)),
      (width) => drawMap(maps, field, layer, width));
  const mirrored = maps.locations.some((l) => l.y_norm < 0) && maps.locations.some((l) => l.y_norm > 0) ?
      '' :
      ' Dashed lines: the mirror image of the measured half.';
  const standard = known(fit.leave_one_out_standardised) ?
      `, ${fixed(fit.leave_one_out_standardised, 2)} times what its uncertainty says` :
      '';
  return figure(
      title,
      choice(
          'Layer', {value: of, u95: `U95 of ${of}`},
          (chosen) => {
            layer = chosen;
            redraw(place);
          }),
      place,
      `${tells} Crosses: the ${maps.locations.length} measured locations.${
          mirrored} U95, 1.96 standard uncertainties, comes from the covariance of the locations ` +
          `(repeats, sessions, and what they share) and from the field in between (${
              maps.method.replaceAll('-', ' ')}). Each location predicted from ` +
          `all others is off by ${
              fixed(fit.leave_one_out_rms_percent, 2)} percentage points (root mean square)${standard}.`,
      command('map', '--out maps'));
}

const mapsSection = (maps) =>
    h('div', {class: 'pair'}, Object.keys(fields).map((field) => mapFigure(maps, field)));
