// Four thrusts over time, each a band from the least to the greatest of every display bin, so that no peak
// hides.

const history_s = 60;
const mostBins = 12_000;
const shades = (colour, alpha) => colour + Math.round(alpha * 255).toString(16).padStart(2, '0');

/**
 * The bins of the last minute. Bin k of a run lies at k modulo the capacity; a bin that never came is null.
 */
const trace = {
  run: null,
  dt_s: 0,
  capacity: 0,
  end: 0,
  low: [],
  high: [],
  unit: 'N',
  fresh: false,
  shown_s: 10
};

function beginTrace({run, dt_s, low, unit}) {
  Object.assign(trace, {run, dt_s, unit, end: 0, capacity: Math.min(mostBins, Math.ceil(history_s / dt_s))});
  const empty = () => low.map(() => new Array(trace.capacity).fill(null));
  trace.low = empty();
  trace.high = empty();
  for (const panel of traces.panels) panel.limits = null;
}

function receiveFrames(frames) {
  const {run, t_s, dt_s, low, high, unit} = frames;
  const start = Math.round(t_s / dt_s);
  if (run !== trace.run || dt_s !== trace.dt_s || low.length !== trace.low.length || unit !== trace.unit ||
      start < trace.end - trace.capacity)
    beginTrace(frames);
  const end = start + low[0].length;
  for (let rotor = 0; rotor < low.length; ++rotor) {
    const from = Math.max(trace.end, end - trace.capacity);
    for (let bin = from; bin < start; ++bin)
      trace.low[rotor][bin % trace.capacity] = trace.high[rotor][bin % trace.capacity] = null;
    for (let i = 0; i < low[rotor].length; ++i) {
      trace.low[rotor][(start + i) % trace.capacity] = low[rotor][i];
      trace.high[rotor][(start + i) % trace.capacity] = high[rotor][i];
    }
  }
  trace.end = Math.max(trace.end, end);
  trace.fresh = true;
}

/** [time_s, low, high] of the shown span, ready for uPlot. */
function shownBins(rotor, into) {
  const count = Math.min(trace.capacity, Math.round(trace.shown_s / trace.dt_s));
  for (const column of into) column.length = count;
  for (let i = 0; i < count; ++i) {
    const bin = trace.end - count + i;
    into[0][i] = bin * trace.dt_s;
    into[1][i] = bin < 0 ? null : trace.low[rotor][bin % trace.capacity];
    into[2][i] = bin < 0 ? null : trace.high[rotor][bin % trace.capacity];
  }
  return into;
}

/**
 * Limits that follow a signal without twitching: they widen at once, and narrow when the signal fills less
 * than half.
 */
function steadyLimits(limits, least, greatest) {
  const span = Math.max(greatest - least, 1e-6 * Math.abs(greatest), 1e-9);
  if (limits && least >= limits[0] && greatest <= limits[1] && span > 0.4 * (limits[1] - limits[0]))
    return limits;
  return [least - 0.15 * span, greatest + 0.15 * span];
}

const plotFont = () => `12px ${style('--font')}`;

/** An axis of uPlot in the page's colours. */
const liveAxis = (more = {}) => ({
  stroke: () => style('--soft'),
  font: plotFont(),
  grid: {stroke: () => style('--line'), width: 1},
  ticks: {stroke: () => style('--line'), width: 1, size: 4},
  ...more,
});

/** The mean so far and its U95, over the trace; and the cell's limit, where it is in sight. */
function drawMean(plot, panel) {
  const {ctx, bbox} = plot;
  const at = (value) => plot.valToPos(value, 'y', true);
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  const across = (value, dash, colour) => {
    ctx.beginPath();
    ctx.setLineDash(dash.map((d) => d * devicePixelRatio));
    ctx.strokeStyle = colour;
    ctx.lineWidth = 1.5 * devicePixelRatio;
    ctx.moveTo(bbox.left, at(value));
    ctx.lineTo(bbox.left + bbox.width, at(value));
    ctx.stroke();
  };
  if (known(panel.mean?.mean)) {
    const {mean, u95} = panel.mean;
    if (known(u95)) {
      ctx.fillStyle = shades(style('--ink'), 0.18);
      ctx.fillRect(bbox.left, at(mean + u95), bbox.width, at(mean - u95) - at(mean + u95));
    }
    across(mean, [], style('--ink'));
  }
  if (trace.unit === 'N' && panel.limit_N) across(panel.limit_N, [6, 4], style('--bad'));
  ctx.restore();
}

function makePanel(rotor) {
  const value = h('span', {class: 'value'}, '–');
  const place =
      h('div', {class: 'plot', role: 'img', 'aria-label': `Thrust of rotor ${rotor + 1} over time`});
  const marker = h('span', {class: `marker rotor-${rotor + 1}`, 'aria-hidden': 'true'});
  const element = h('div', {class: 'trace'}, h('h3', {}, marker, `Rotor ${rotor + 1} `, value), place);
  return {rotor, element, place, value, data: [[], [], []], limits: null, mean: null, plot: null};
}

function makeTracePlot(panel) {
  panel.plot?.destroy();
  const colour = rotorColours()[panel.rotor % 4];
  const edge = {stroke: colour, width: 1, points: {show: false}, spanGaps: false};
  const options = {
    width: panel.place.clientWidth,
    height: panel.place.clientWidth > 300 ? 200 : 130,
    legend: {show: false},
    cursor: {show: false},
    scales: {
      x: {time: false},
      y: {
        range: (_, least, greatest) =>
            (least === null ? panel.limits ?? [0, 1] :
                              panel.limits = steadyLimits(panel.limits, least, greatest))
      },
    },
    axes: [
      liveAxis({size: 24, values: (_, times) => times.map((t) => (t < 0 ? '' : `${+ t.toFixed(1)} s`))}),
      liveAxis({size: 58, values: (_, values) => values.map((v) => `${+ v.toPrecision(5)}`)}),
    ],
    series: [{}, edge, edge],
    bands: [{series: [2, 1], fill: shades(colour, 0.45)}],
    hooks: {draw: [(plot) => drawMean(plot, panel)]},
  };
  panel.plot = new uPlot(options, shownBins(panel.rotor, panel.data), panel.place);
}

const traces = {
  panels: []
};

/** Draws what is new, once per picture that the screen shows. */
function drawTraces() {
  if (trace.fresh && !document.hidden) {
    trace.fresh = false;
    for (const panel of traces.panels) panel.plot.setData(shownBins(panel.rotor, panel.data));
    ++account.drawn;
  }
  requestAnimationFrame(drawTraces);
}

function startTraces() {
  const place = h('div', {class: 'traces'});
  const spans = choice('Shown', {10: '10 s', 30: '30 s', 60: '60 s'}, (chosen) => {
    trace.shown_s = Number(chosen);
    trace.fresh = trace.run !== null;
  });
  const unit =
      h('p', {class: 'soft'},
        'Band: least to greatest of each display bin. Line: mean of the run so far and its U',
        h('sub', {}, '95'), '.');
  byId('traces').append(spans, place, unit);
  on('frames', receiveFrames);
  on('hello', ({rotors, cell_limit_N}) => {
    while (traces.panels.length < rotors) {
      const panel = makePanel(traces.panels.length);
      traces.panels.push(panel);
      place.append(panel.element);
      trace.low.push([]);
      trace.high.push([]);
    }
    for (const panel of traces.panels.filter(({plot}) => !plot))
      makeTracePlot(panel);  // beside each other, so that widths hold
    for (const panel of traces.panels) panel.limit_N = cell_limit_N;
  });
  on('state', ({means}) => {
    for (const mean of means ?? []) {
      const panel = traces.panels[mean.rotor - 1];
      if (!panel) continue;
      panel.mean = mean;
      setText(panel.value, `${withU95(mean.mean, mean.u95)} ${mean.unit}`);
    }
  });
  onNewLook(() => traces.panels.forEach(makeTracePlot));
  requestAnimationFrame(drawTraces);
}
