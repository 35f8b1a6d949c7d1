// Whether each run is what it should be, over the days of the campaign.

const days = (seconds) => new Date(1000 * seconds).toISOString();

/** What is looked at of every run, one above the other on one axis of time. */
const checks = [
  {
    title: 'drift / its error',
    tells: 'drift over its standard error',
    unit: '',
    limit: 4.5,
    value: (r, i) => r.drift_z[i]
  },
  {
    title: 'clipped [%]',
    tells: 'samples clipped',
    unit: ' %',
    value: (r, i) => (known(r.clipped[i]) ? (100 * r.clipped[i]) / r.samples[i] : null)
  },
  {
    title: 'lost [%]',
    tells: 'frames lost',
    unit: ' %',
    value: (r, i) => (r.frames[i] ? (100 * r.lost[i]) / r.frames[i] : null)
  },
  {
    title: 'shaft line −<br>tachometer<br>[rev/min]',
    tells: 'shaft line minus tachometer',
    unit: ' rev/min',
    value: (r, i) => (known(r.shaft_rpm[i]) && known(r.speed_rpm[i]) ? r.shaft_rpm[i] - r.speed_rpm[i] : null)
  },
];

const runLabel = (i) => `run ${plain(report.runs.run[i])}, ${
    report.runs.tare[i] ? 'tare' : plain(report.runs.location[i])}, session ${plain(report.runs.session[i])}`;

function checkTrace(check, row, chosen, name, colour, symbol) {
  const shown = chosen.filter((i) => known(check.value(report.runs, i)));
  return {
    type: 'scatter',
    mode: 'markers',
    name,
    legendgroup: name,
    showlegend: row === 0,
    x: shown.map((i) => days(report.runs.start_s[i])),
    y: shown.map((i) => check.value(report.runs, i)),
    text: shown.map(runLabel),
    xaxis: 'x',
    yaxis: `y${row || ''}`.replace('y0', 'y'),
    marker: {color: colour, size: 5, symbol},
    hovertemplate: `%{text}<br>%{x}<br>${check.tells} %{y:.3~g}${check.unit}<extra></extra>`
  };
}

function drawHealth() {
  const all = report.runs.run.map((_, i) => i);
  const kinds = [
    ['thrust runs', all.filter((i) => !report.runs.tare[i]), 'circle'],
    ['tares', all.filter((i) => report.runs.tare[i]), 'triangle-up-open']
  ];
  const data = [],
        layout = {shapes: [], hovermode: 'closest', legend: {orientation: 'h', y: 1.01, yanchor: 'bottom'}};
  checks.forEach((check, k) => {
    const number = k + 1, id = number === 1 ? 'y' : `y${number}`;
    const top = 1 - k / checks.length;
    kinds.forEach(
        ([name, chosen, symbol], c) =>
            data.push({...checkTrace(check, k, chosen, name, rotorColours()[c], symbol), yaxis: id}));
    layout[`yaxis${number === 1 ? '' : number}`] =
        axis(check.title, {domain: [top - 1 / checks.length + 0.03, top - 0.01], rangemode: 'tozero'});
    if (check.limit)
      layout.shapes.push(
          ...[-1, 1].map((sign) => rule(sign * check.limit, style('--bad'), {yref: id, xref: 'paper'})));
  });
  layout.xaxis = axis('start of the run (UTC)', {type: 'date', anchor: `y${checks.length}`});
  return {data, layout};
}

function healthSection() {
  const moving = report.runs.drift_z.filter((z) => Math.abs(z) >= 4.5).length;
  const place = plot('Drift, clipping, losses and speed of every run over time', () => 820, drawHealth);
  return figure(
      'Every run over the days', [], place,
      'From the top: how far the mean of a run moves, over the standard error of that drift, in the channel where it is most (beyond the dotted ' +
          `lines at ±4.5 it is no longer noise: ${
              counted(
                  moving,
                  'run')}); samples at the end of the converter's range; frames lost on the way; and the shaft's line in ` +
          'the spectrum, a second tachometer, against the one that was read. A mean is worth its error bar only where the first three are quiet.',
      command('doctor'));
}

/** Zero of each cell against the mean of all its tares; a line for each session. */
function drawTares({readings, gain_V_per_N: gain}) {
  const data = readings[0].mean_V.map((_, cell) => {
    const scale = 1000 / (gain ? gain[cell] : 1);
    const mean = readings.reduce((sum, r) => sum + r.mean_V[cell], 0) / readings.length;
    const x = [], y = [], u95 = [], text = [];
    readings.forEach((reading, i) => {
      if (i > 0 && readings[i - 1].session !== reading.session)
        [x, y, u95, text].forEach((list) => list.push(null));
      x.push(days(reading.start_s));
      y.push(scale * (reading.mean_V[cell] - mean));
      u95.push(2 * Math.abs(scale) * reading.standard_error_V[cell]);
      text.push(`cell ${cell + 1}, session ${plain(reading.session)}, run ${plain(reading.run)}`);
    });
    const colour = rotorColours()[cell];
    return {
      type: 'scatter',
      mode: 'lines+markers',
      name: `cell ${cell + 1}`,
      x,
      y,
      text,
      connectgaps: false,
      error_y: {array: u95, color: colour, thickness: 1, width: 2},
      line: {color: colour, width: 1.3},
      marker: {color: colour, size: 6, symbol: symbols[cell]},
      hovertemplate: '%{text}<br>%{x}<br>%{y:+.1f}<extra></extra>'
    };
  });
  return {
    data,
    layout: {
      xaxis: axis('start of the tare (UTC)', {type: 'date'}),
      yaxis: axis(gain ? 'zero − its mean [mN]' : 'zero − its mean [mV]'),
      legend: {orientation: 'h', y: 1.01, yanchor: 'bottom'}
    }
  };
}

function taresSection(section) {
  const place = plot('Zeros of the cells over the sessions', () => 420, () => drawTares(section));
  return figure(
      'Zeros of the cells, session by session', [], place,
      `The reading of each cell with the motors stopped, against its mean over all ${
          counted(section.readings.length, 'tare')}; lines join the tares of a session. ` +
          'Within a session the zero of a run is interpolated between them; what the zero does from session to session does not matter then. Error bars: ' +
          'twice the standard error of the tare\'s mean.',
      command('reduce'));
}
