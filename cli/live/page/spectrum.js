// The spectrum of each rotor, and where shaft, blades and mains stand in it, themselves or their aliases.

/** Rows for labels: each goes to the first row where it touches none. */
function labelRows(labels, rows) {
  const ends = new Array(rows).fill(-Infinity);
  return labels.map(({from, to}) => {
    const row = ends.findIndex((end) => from > end + 6);
    if (row >= 0) ends[row] = to;
    return row;
  });
}

const labelRowsShown = 4, labelHeight = 14;

/** Lines of the rotor and the mains; aliases are dashed. Labels that find no room stand in the list only. */
function drawLines(plot, lines) {
  const {ctx, bbox} = plot, ratio = devicePixelRatio || 1;
  const shown = lines.map((line) => ({...line, at: plot.valToPos(line.appears_hz, 'x', true)}))
                    .filter(({at}) => at >= bbox.left && at <= bbox.left + bbox.width)
                    .sort((a, b) => a.at - b.at);
  ctx.save();
  ctx.font = `${11 * ratio}px ${style('--font')}`;
  ctx.textBaseline = 'top';
  ctx.textAlign = 'left';
  const labels = shown.map(({name, at, alias}) => {
    const text = alias ? `(${name})` : name, width = ctx.measureText(text).width;
    const from = Math.min(at + 3 * ratio, bbox.left + bbox.width - width);
    return {text, from, to: from + width};
  });
  const rows = labelRows(labels, labelRowsShown);
  const top = bbox.top - labelRowsShown * labelHeight * ratio;
  shown.forEach(({at, alias}, i) => {
    ctx.strokeStyle = style('--soft');
    ctx.lineWidth = ratio;
    ctx.setLineDash(alias ? [4 * ratio, 3 * ratio] : []);
    ctx.beginPath();
    ctx.moveTo(at, rows[i] < 0 ? bbox.top : top + rows[i] * labelHeight * ratio);
    ctx.lineTo(at, bbox.top + bbox.height);
    ctx.stroke();
    if (rows[i] < 0) return;
    ctx.fillStyle = style('--ink');
    ctx.fillText(labels[i].text, labels[i].from, top + rows[i] * labelHeight * ratio);
  });
  ctx.restore();
}

const lineText = ({name, frequency_hz, appears_hz, alias}) => alias ?
    `${name}: ${fixed(frequency_hz, 1)} Hz, seen at ${fixed(appears_hz, 1)} Hz (alias, dashed)` :
    `${name}: ${fixed(frequency_hz, 1)} Hz`;

const spectrum = {
  latest: null,
  plot: null,
  place: null
};

function spectrumData({amplitude, df_hz}) {
  const frequency_hz = amplitude[0].map((_, k) => k * df_hz);
  // the mean's own bin would set the scale, and a logarithm has no place for zero
  return [
    frequency_hz, ...amplitude.map((values) => values.map((value, k) => (k > 0 && value > 0 ? value : null)))
  ];
}

function makeSpectrumPlot() {
  spectrum.plot?.destroy();
  spectrum.plot = null;
  if (!spectrum.latest) return;
  const {amplitude, unit} = spectrum.latest;
  const data = spectrumData(spectrum.latest);
  spectrum.plot =
      new uPlot(
          {
            width: spectrum.place.clientWidth,
            height: 260,
            padding: [8 + labelRowsShown * labelHeight, 12, 0, 0],
            legend: {show: false},
            cursor: {show: false},
            scales: {x: {time: false, range: [0, data[0].at(-1)]}, y: {distr: 3, log: 10}},
            axes: [
              liveAxis({label: 'frequency [Hz]', labelFont: plotFont(), labelSize: 18, size: 26}),
              liveAxis({
                label: `amplitude [${unit}]`,
                labelFont: plotFont(),
                labelSize: 18,
                size: 52,
                values: (_, values) => values.map((v) => (known(v) ? `${+ v.toPrecision(2)}` : ''))
              }),
            ],
            series: [
              {}, ...amplitude.map((_, rotor) => ({
                                     stroke: rotorColours()[rotor % 4],
                                     width: 1,
                                     points: {show: false}
                                   }))
            ],
            hooks: {draw: [(plot) => drawLines(plot, spectrum.latest.lines)]},
          },
          data, spectrum.place);
}

function receiveSpectrum(latest) {
  const was = spectrum.latest;
  spectrum.latest = latest;
  if (document.hidden) return;
  const same = was && was.unit === latest.unit && was.df_hz === latest.df_hz &&
      was.amplitude.length === latest.amplitude.length &&
      was.amplitude[0].length === latest.amplitude[0].length;
  if (same && spectrum.plot)
    spectrum.plot.setData(spectrumData(latest));
  else
    makeSpectrumPlot();
}

function startSpectrum() {
  spectrum.place = h('div', {
    class: 'plot spectrum',
    role: 'img',
    'aria-label': 'Amplitude over frequency for each rotor, on logarithmic scale'
  });
  const legend = h('p', {class: 'legend'});
  const lines = h('ul', {class: 'lines', 'aria-label': 'Lines of the rotor and the mains'});
  const none =
      h('p', {class: 'soft'},
        'There is a spectrum once the frames of three seconds have come without a long gap.');
  byId('spectrum').append(none, legend, spectrum.place, lines);
  startWaterfall();
  on('hello', ({rotors}) => {
    legend.replaceChildren(...Array.from(
        {length: rotors},
        (_, i) =>
            h('span', {}, h('span', {class: `marker rotor-${i + 1}`, 'aria-hidden': 'true'}),
              `Rotor ${i + 1} `)));
  });
  let run = null;
  on('state', (state) => {
    if (state.run === run) return;  // else what is shown is another run's
    run = state.run;
    spectrum.latest = null;
    makeSpectrumPlot();
    none.hidden = false;
    lines.dataset.shown = '';
    lines.replaceChildren();
  });
  on('spectrum', (latest) => {
    none.hidden = true;
    receiveSpectrum(latest);
    const texts = latest.lines.map(lineText);
    if (lines.dataset.shown !== texts.join()) {
      lines.dataset.shown = texts.join();
      lines.replaceChildren(...texts.map((text) => h('li', {}, text)));
    }
  });
  onNewLook(makeSpectrumPlot);
}
