// The tunnel's columns against open space, a ground plane and a ceiling plane: the thesis's figures 5.24
// and 5.57.

const planeKinds = {
  ground: {name: 'GND, above a ground plane', symbol: 'triangle-down'},
  ceiling: {name: 'CEIL, beneath a ceiling plane', symbol: 'triangle-up'},
};

const hasPlane = (section, side) => section.planes.some((p) => p.side === side);

function planeTrace(section, byLabel, side, colour, inTunnel) {
  const planes = section.planes.filter((p) => p.side === side).sort((a, b) => a.distance_R - b.distance_R);
  const {name, symbol} = planeKinds[side];
  const trace = means(
      planes.map((p) => byLabel.get(p.location)), planes.map((p) => (inTunnel ? p.z_norm : p.distance_R)),
      'c_t', colour, {name, marker: {symbol, size: 9}});
  trace.text = trace.text.map((text, i) => `${text}<br>${fixed(planes[i].distance_R, 2)} R from the plane`);
  trace.line.dash = 'dot';
  return trace;
}

/** Open space as a band of its U95, with a point of no size for the legend. */
function openSpace(location) {
  const {mean, u95} = location.c_t;
  const grey = style('--soft');
  return {
    shapes: [band(mean - u95, mean + u95, grey, {opacity: 0.25}), rule(mean, grey)],
    trace: {
      type: 'scatter',
      mode: 'lines',
      x: [null],
      y: [null],
      name: `OS, open space (${withU95(mean, u95)})`,
      line: {color: grey, width: 8},
      opacity: 0.45
    }
  };
}

function drawAgainst(section, column, y) {
  const byLabel = new Map(report.sections.locations.locations.map((l) => [l.location, l]));
  const [groundColour, , ceilingColour] = rotorColours();
  const data = [], shapes = [];
  if (column) {
    const look = {name: `${plain(column.label)}, in the tunnel`};
    data.push(means(column.locations, column.locations.map((l) => l.z_norm), 'c_t', style('--ink'), look));
  }
  if (hasPlane(section, 'ground')) data.push(planeTrace(section, byLabel, 'ground', groundColour, column));
  if (hasPlane(section, 'ceiling')) data.push(planeTrace(section, byLabel, 'ceiling', ceilingColour, column));
  if (section.open_space) {
    const open = openSpace(byLabel.get(section.open_space));
    data.push(open.trace);
    shapes.push(...open.shapes);
  }
  const xaxis =
      column ? heightAxis({range: [-1.15, 1.15]}) : axis('distance of the rotors from the plane [R]');
  const yaxis = axis('C<sub>T</sub> [–]', {...bySteps, range: y});
  return {
    data,
    layout: {xaxis, yaxis, shapes, showlegend: true, legend: {orientation: 'h', y: -0.2, yanchor: 'top'}}
  };
}

/** One range of C_T for both pictures, so that they can be compared. */
function commonRange(section, columns) {
  const labels = new Set([
    section.open_space, ...section.planes.map((p) => p.location),
    ...columns.flatMap((c) => c.locations.map((l) => l.location))
  ]);
  const values = report.sections.locations.locations.filter((l) => labels.has(l.location))
                     .flatMap(({c_t}) => [c_t.mean - c_t.u95, c_t.mean + c_t.u95]);
  const [low, high] = [Math.min(...values), Math.max(...values)];
  return [low - 0.04 * (high - low), high + 0.04 * (high - low)];
}

/** How the points of GND and CEIL came to their places. */
function placement(section, column) {
  if (!section.planes.length) return '';
  if (!column)
    return 'By the distance of the rotors from the plane: without a tunnel there is no height to place them at.';
  return sentences(
      'A point above a ground plane (GND) or beneath a ceiling plane (CEIL) stands at the height in the tunnel',
      'that is as far from its floor or ceiling, z̄ = ∓(h_t − 2d)/(h_t − h_q) with d the distance; the rotors are',
      'taken to be at the vehicle’s mid-height.');
}

function againstFigure(section, column, y) {
  const title = column ? `${column.name ?? column.label} against open space` : 'Planes in open space';
  const place = plot(
      `${title}; its numbers are in the table of locations`, (width) => (isNarrow(width) ? 520 : 480),
      () => drawAgainst(section, column, y));
  const missing = [
    !section.open_space && 'in open space (OS)',
    !hasPlane(section, 'ground') && 'above a ground plane (GND)',
    !hasPlane(section, 'ceiling') && 'beneath a ceiling plane (CEIL)',
  ].filter(Boolean);
  const caption = sentences(
      section.open_space && 'Grey band: C_T in open space with its U95.', placement(section, column),
      'Error bars: U95.', missing.length && `The campaign has no runs ${missing.join(' or ')}.`);
  return figure(title, [], place, caption, command('reduce', '--csv coefficients.csv'));
}

function openSpaceSection(section) {
  const columns = section.tunnel ? columnsOf(report.sections.locations.locations) : [];
  if (!columns.length) return againstFigure(section, undefined);
  // The thesis shows H0 and H4; other grids their middle and their outermost column.
  const outer = columns.find((c) => c.name === 'H4') ?? columns.at(-1);
  const chosen = outer === columns[0] ? [columns[0]] : [columns[0], outer];
  const y = commonRange(section, chosen);
  return h('div', {class: 'pair'}, chosen.map((column) => againstFigure(section, column, y)));
}
