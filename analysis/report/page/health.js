// Whether each run is what it should be, over the days of the campaign.

const kDriftLimit = 4.5;  // beyond which a run is not stationary (datasets/run_statistics.h)

const instant = (seconds) => new Date(1000 * seconds).toISOString();
const perCent = (part, whole) => (whole > 0 ? (100 * part) / whole : null);
const difference = (a, b) => (known(a) && known(b) ? a - b : null);

/** Makes room downwards only: dates at the ends, which come and go with the width, would do so without end. */
const timeAxis = (title, more = {}) => axis(title, {type: 'date', automargin: 'height', ...more});
const kTimeMargin = {l: 10, r: 28, t: 30, b: 10};

/** What is looked at of every run, one above the other on one axis of time. */
const checks = [
  {title: 'drift / its<br>error [–]', unit: ' standard errors', value: (r, i) => r.drift_z[i]},
  {title: 'clipped [%]', unit: ' % of samples clipped', value: (r, i) => perCent(r.clipped[i], r.samples[i])},
  {title: 'lost [%]', unit: ' % of frames lost', value: (r, i) => perCent(r.lost[i], r.frames[i])},
  {
    title: 'shaft line −<br>tachometer<br>[rev/min]',
    unit: ' rev/min between shaft line and tachometer',
    value: (r, i) => difference(r.shaft_rpm[i], r.speed_rpm[i]),
  },
];

function runLabel(i) {
  const {run, tare, location, session} = report.runs;
  return `run ${plain(run[i])}, ${tare[i] ? 'tare' : plain(location[i])}, session ${plain(session[i])}`;
}

/** The runs of one kind in one check. */
function checkTrace({unit, value}, chosen, kind) {
  const shown = chosen.filter((i) => known(value(report.runs, i)));
  return {
    ...kind,
    type: 'scatter',
    mode: 'markers',
    x: shown.map((i) => instant(report.runs.start_s[i])),
    y: shown.map((i) => value(report.runs, i)),
    text: shown.map(runLabel),
    legendgroup: kind.name,
    cliponaxis: false,
    hovertemplate: `%{text}<br>%{x}<br>%{y:.3~g}${unit}<extra></extra>`,
  };
}

function drawHealth() {
  const [runColour, tareColour] = rotorColours();
  const indices = report.runs.run.map((_, i) => i);
  const runs = indices.filter((i) => !report.runs.tare[i]),
        tares = indices.filter((i) => report.runs.tare[i]);
  const runLook = {name: 'thrust runs', marker: {color: runColour, size: 5}};
  const tareLook = {name: 'tares', marker: {color: tareColour, size: 6, symbol: 'triangle-up-open'}};
  const data = [];
  // Plotly makes no axis for a check without a value (no tachometer), and the last one carries the time's.
  const shown = checks.filter(({value}) => indices.some((i) => known(value(report.runs, i))));
  const layout = {xaxis: timeAxis('start of the run (UTC)', {anchor: shown.length > 1 ? `y${shown.length}` : 'y'})};
  shown.forEach((check, k) => {
    const id = k === 0 ? '' : k + 1;  // Plotly's axes are yaxis, yaxis2, …
    const at = {yaxis: `y${id}`, showlegend: k === 0};
    data.push(checkTrace(check, runs, {...runLook, ...at}), checkTrace(check, tares, {...tareLook, ...at}));
    const top = 1 - k / shown.length;
    const domain = [top - 1 / shown.length + 0.03, top - 0.01];
    layout[`yaxis${id}`] = axis(check.title, {domain, rangemode: 'tozero'});
  });
  layout.shapes = shown[0] === checks[0] ?
      [-kDriftLimit, kDriftLimit].map((limit) => rule(limit, style('--bad'), {yref: 'y'})) :
      [];
  layout.legend = {orientation: 'h', y: 1.01, yanchor: 'bottom'};
  layout.margin = kTimeMargin;
  return {data, layout};
}

function healthSection() {
  const moving = counted(report.runs.drift_z.filter((z) => Math.abs(z) >= kDriftLimit).length, 'run');
  const place = plot('Drift, clipping, losses and speed of every run over time', () => 820, drawHealth);
  const caption = sentences(
      'From the top: how far the mean of a run moves, over the standard error of that drift, in the',
      `channel where it is most (beyond the dotted lines at ±${kDriftLimit} it is no longer noise:`,
      `${moving}); samples at the end of the converter’s range; frames lost on the way; and the`,
      'shaft’s line in the spectrum, a second tachometer, against the one that was read. A mean is',
      'worth its error bar only where the first three are quiet. What is known of no run is not drawn.');
  return figure('Every run over the days', [], place, caption, command('doctor'));
}

/** Zeros of one cell against their mean, with twice their standard error; null parts the sessions. */
function zerosOf(cell, readings, scale) {
  const mean = readings.reduce((sum, r) => sum + r.mean_V[cell], 0) / readings.length;
  return readings.flatMap((reading, i) => {
    const point = {
      x: instant(reading.start_s),
      y: scale * (reading.mean_V[cell] - mean),
      error: 2 * Math.abs(scale) * reading.standard_error_V[cell],
      text: `cell ${cell + 1}, session ${plain(reading.session)}, run ${plain(reading.run)}`,
    };
    const first = i === 0 || readings[i - 1].session !== reading.session;
    return first && i > 0 ? [{x: null, y: null, error: null, text: null}, point] : [point];
  });
}

function drawTares({readings, gain_V_per_N: gain}) {
  const data = readings[0].mean_V.map((_, cell) => {
    const zeros = zerosOf(cell, readings, 1000 / (gain ? gain[cell] : 1));
    const colour = rotorColours()[cell];
    return {
      type: 'scatter',
      mode: 'lines+markers',
      name: `cell ${cell + 1}`,
      x: zeros.map((zero) => zero.x),
      y: zeros.map((zero) => zero.y),
      text: zeros.map((zero) => zero.text),
      error_y: {array: zeros.map((zero) => zero.error), color: colour, thickness: 1, width: 2},
      line: {color: colour, width: 1.3},
      marker: {color: colour, size: 6, symbol: symbols[cell]},
      hovertemplate: `%{text}<br>%{x}<br>%{y:+.1f} ${gain ? 'mN' : 'mV'}<extra></extra>`,
    };
  });
  return {
    data,
    layout: {
      xaxis: timeAxis('start of the tare (UTC)'),
      yaxis: axis(`zero − its mean [${gain ? 'mN' : 'mV'}]`),
      legend: {orientation: 'h', y: 1.01, yanchor: 'bottom'},
      margin: kTimeMargin,
    },
  };
}

function taresSection(section) {
  const place = plot('Zeros of the cells over the sessions', () => 420, () => drawTares(section));
  const caption = sentences(
      'The reading of each cell with the motors stopped, against its mean over all',
      `${counted(section.readings.length, 'tare')}; lines join the tares of a session. The zero of a`,
      'run is interpolated between the tares of its session; what the zero does from one session to',
      'the next does not matter then. Error bars: twice the standard error of the mean of the tare.');
  return figure('Zeros of the cells, session by session', [], place, caption, command('reduce'));
}
