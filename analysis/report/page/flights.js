// What `tunnelrig fly` flew: paths in the cross-section and errors over time, as in the thesis's figures 6.16 to 6.18.

const flightDashes = ['solid', 'dash', 'dot', 'dashdot'];

/** Lines of controllers stay apart by colour first, then by dashes. */
const controllerLine = (i) => {
  const colours = rotorColours();
  return {color: colours[i % colours.length], dash: flightDashes[Math.floor(i / colours.length) % 4], width: 1.8};
};

/** So many at first; the others are a click on the legend away. */
const kControllersShown = 4;
const shownAtFirst = (i) => (i < kControllersShown ? true : 'legendonly');

function drawPaths({walls, reference, controllers}, width) {
  const closed = [...walls, walls[0]];
  const still = {type: 'scatter', mode: 'lines', hoverinfo: 'skip'};
  const data = [
    {...still, name: 'tunnel', x: closed.map((p) => p[0]), y: closed.map((p) => p[1]),
      line: {color: style('--ink'), width: 2}},
    {...still, name: 'reference', x: reference.y_m, y: reference.z_m,
      line: {color: style('--ink'), width: 1, dash: 'dot'}},
    ...controllers.map(({name, path}, i) => ({
      type: 'scatter', mode: 'lines', name: plain(name), x: path.y_m, y: path.z_m, visible: shownAtFirst(i),
      line: controllerLine(i), text: path.y_m.map((_, k) => `${fixed(reference.time_s[k], 1)} s`),
      hovertemplate: `${plain(name)}, %{text}<br>y %{x:.3f} m, z %{y:.3f} m<extra></extra>`,
    })),
  ];
  const legend = width < 560 ? {orientation: 'h', y: -0.2, yanchor: 'top'} : {};
  return {
    data,
    layout: {
      xaxis: axis('y [m]'), yaxis: axis('z above the floor [m]', {scaleanchor: 'x', scaleratio: 1}), legend,
    },
  };
}

function drawFlightErrors({reference, controllers}, key, symbol) {
  return {
    data: controllers.map(({name, path}, i) => ({
      type: 'scatter', mode: 'lines', name: plain(name), x: reference.time_s.slice(0, path[key].length),
      y: path[key].map((value, k) => 1e3 * (reference[key][k] - value)), visible: shownAtFirst(i),
      line: controllerLine(i), hovertemplate: `${plain(name)}<br>%{x:.1f} s: %{y:+.1f} mm<extra></extra>`,
    })),
    layout: {
      xaxis: axis('time [s]'), yaxis: axis(`error in ${symbol} [mm]`),
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom'},
    },
  };
}

function flightTable({controllers, best}) {
  const mm = (key, decimals = 1) => (row) => fixed(row[key], decimals);
  return table('Errors over all runs, contacts, estimator', [
    {name: 'controller', cell: (row) => row.name, text: true},
    {name: 'runs', cell: (row) => String(row.runs)},
    {name: 'lost', cell: (row) => String(row.lost ?? 0)},
    {name: 'rms y [mm]', cell: mm('rms_y_mm')},
    {name: 'rms z [mm]', cell: mm('rms_z_mm')},
    {name: 'mean rms, 95 % [mm]', cell: ({ci95_rms_mm: ci}) => (ci ? `${fixed(ci[0], 1)} to ${fixed(ci[1], 1)}` : '–')},
    ...(controllers.some((row) => row.more_than_best_mm) ?
        [{name: `more than ${best}, 95 % [mm]`, cell: ({more_than_best_mm: ci}) => (ci ? `${fixed(ci[0], 2)} to ${fixed(ci[1], 2)}` : '–')}] :
        []),
    {name: 'max y [mm]', cell: mm('max_y_mm')},
    {name: 'max z [mm]', cell: mm('max_z_mm')},
    {name: 'contacts', cell: (row) => String(row.contacts)},
    {name: 'first contact [s]', cell: mm('first_contact_s', 2)},
    {name: 'estimator rms [mm]', cell: mm('estimator_rms_mm')},
    {name: 'saturated [s]', cell: mm('thrust_saturated_s', 2)},
  ], controllers);
}

const positions = {
  lidar: 'from LIDAR scans, matcher and filter',
  'lidar-thesis': 'from LIDAR scans, matcher and the thesis’s filter',
};

function flightsSection({flights, command}) {
  return [
    h('p', {}, prose('All of it is simulated: vehicle, air, LIDAR. Errors are reference less position; those of the ' +
      'table count from the scenario’s scored time on, contacts always.')),
    flights.map((flight) => {
      const {tunnel, scenario, map, position, extrapolated} = flight;
      const title = `${scenario} in the ${tunnel} tunnel`;
      const caption = `The first run of each controller; map: ${map}; position: ${
          positions[position] ?? position}. Single runs have no error bars; the intervals of the table are Student’s, over the runs. All controllers fly the same runs, so they are compared run by run: two that differ have an interval of “more than” without 0, however much those of the means overlap. A click on the legend hides or shows.`;
      return figure(title, [], [
        plot(`Paths, ${title}`, (width) => Math.min(560, Math.max(380, 0.7 * width)), (width) => drawPaths(flight, width)),
        plot(`Error in y, ${title}`, () => 260, () => drawFlightErrors(flight, 'y_m', 'y')),
        plot(`Error in z, ${title}`, () => 260, () => drawFlightErrors(flight, 'z_m', 'z')),
        flightTable(flight),
      ], extrapolated ? `Extrapolated, in normalised coordinates: ${extrapolated}. ${caption}` : caption, command);
    }),
  ];
}
