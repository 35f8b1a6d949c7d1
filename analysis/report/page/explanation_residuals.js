// Residuals against what they depend on, before and after.

const suffixes = {
  _K_s: 'K/s',
  _m_s: 'm/s',
  _rpm: 'rpm',
  _Pa: 'Pa',
  _Hz: 'Hz',
  _C: '°C',
  _K: 'K',
  _V: 'V',
  _A: 'A',
  _N: 'N',
  _R: 'R',
  _s: 's',
  _m: 'm'
};
const plainUnits = {
  relative_humidity: '–',
  run_order: '–',
  session: '–',
  clip_fraction: '–'
};

/**
 * "air_temperature_C [°C]"; what says nothing of its unit stands alone. A table's column has a unit of its
 * own.
 */
function covariateTitle(name, own) {
  if (own && own !== '1') return `${plain(name)} [${plain(own)}]`;
  const suffix = Object.keys(suffixes).find((end) => name.endsWith(end));
  const unit = plainUnits[name] ?? suffixes[suffix];
  return plain(name) + (unit ? ` [${unit}]` : '');
}

const residualTitle = () => {
  const {response, unit} = report.explanation;
  return `measured − predicted ${plain(response)}${unitBracket(plain(unit))}`;
};

const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;

/** Groups of like x: every value of its own where there are few, else a dozen with as many points each. */
function binsOf(x, few = 14) {
  const order = x.map((_, i) => i).sort((a, b) => x[a] - x[b]);
  const values = [...new Set(x)];
  if (values.length <= few) return values.sort((a, b) => a - b).map((v) => order.filter((i) => x[i] === v));
  const count = 12;
  return Array
      .from(
          {length: count},
          (_, k) => order.slice(
              Math.round((k * order.length) / count), Math.round(((k + 1) * order.length) / count)))
      .filter((bin) => bin.length);
}

/** t(0.975) of few degrees of freedom, then Cornish and Fisher's expansion. */
function student975(dof) {
  const z = 1.959964;
  return [12.706, 4.303, 3.182, 2.776][dof - 1] ??
      z + (z ** 3 + z) / (4 * dof) + (5 * z ** 5 + 16 * z ** 3 + 3 * z) / (96 * dof ** 2);
}

function binned(x, y, bins) {
  const at = bins.map((bin) => mean(bin.map((i) => x[i])));
  const middle = bins.map((bin) => mean(bin.map((i) => y[i])));
  const half = bins.map((bin, k) => {
    const squares = bin.reduce((sum, i) => sum + (y[i] - middle[k]) ** 2, 0);
    return bin.length > 1 ? student975(bin.length - 1) * Math.sqrt(squares / (bin.length - 1) / bin.length) : 0;
  });
  return {at, middle, half};
}

const runText = (i, channel) => {
  const {runs} = report;
  const rotor = runs.before.length > 1 ? `, rotor ${channel}` : '';
  return plain(`${runs.name[i]} at ${runs.location[i]}${rotor}`);
};

/** A band about a line, under it. */
function bandOf(x, middle, half, colour) {
  const edge = (sign, more) => ({
    type: 'scatter',
    mode: 'lines',
    x,
    y: middle.map((v, i) => v + sign * half[i]),
    line: {width: 0},
    hoverinfo: 'skip',
    showlegend: false,
    ...more
  });
  return [edge(-1, {}), edge(1, {fill: 'tonexty', fillcolor: `${colour}33`})];
}

/** Clouds of residuals with the means of like x, and what the effect makes of them. */
function drawPanel(panel, which, reach) {
  const bins = binsOf(panel.x, panel.covariate === 'session' ? Infinity : undefined);
  const means = binned(panel.x, panel[which], bins);
  const texts = panel.labels.map((label) => plain(nameOfText(label)));
  const [blue, orange] = rotorColours();
  const data = [
    {
      type: 'scatter',
      mode: 'markers',
      name: 'runs',
      x: panel.x,
      y: panel[which],
      cliponaxis: false,
      text: panel.run.map((run, i) => runText(run, panel.channel[i])),
      marker: {color: style('--soft'), size: 4, opacity: 0.45},
      hovertemplate: '%{text}<br>%{x}: %{y:.4g}<extra></extra>'
    },
    {
      type: 'scatter',
      mode: 'markers',
      name: 'means',
      x: means.at,
      y: means.middle,
      error_y: {type: 'data', array: means.half, color: blue, thickness: 1.5, width: 4},
      marker: {color: blue, size: 8},
      hovertemplate: 'mean at %{x:.4g}: %{y:.4g}<extra></extra>'
    }
  ];
  const fitted = which === 'before' && panel.fitted.some((v) => v !== 0);
  if (fitted) {
    const curve = binned(panel.x, panel.fitted, bins);
    const half = panel.half ? binned(panel.x, panel.half, bins).middle : [];
    if (half.length && !texts.length) data.push(...bandOf(curve.at, curve.middle, half, orange));
    data.push({
      type: 'scatter',
      mode: texts.length ? 'markers' : 'lines+markers',  // nothing lies between texts
      name: 'fitted',
      x: curve.at,
      y: curve.middle,
      error_y: {type: 'data', array: half, color: orange, visible: half.length > 0 && texts.length > 0},
      line: {color: orange, width: 2.5},
      marker: {color: orange, size: 8, symbol: 'diamond-open'},
      hovertemplate: 'fitted at %{x:.4g}: %{y:.4g}<extra></extra>'
    });
  }
  const ticks = texts.length ? {
    tickvals: texts.map((_, i) => i + 1),
    ticktext: texts,
    range: [0.5, texts.length + 0.5],
    showgrid: false
  } :
                               {};
  return {
    data,
    layout: {
      xaxis: axis(covariateTitle(panel.covariate, panel.covariate_unit), {zeroline: false, ...ticks}),
      yaxis: axis(residualTitle(), {range: [-reach, reach]}),
      showlegend: true,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', traceorder: 'normal'}
    }
  };
}

/** Both plots of a panel show the same span; a few gross points may lie outside. */
function reachOf(values) {
  const sizes = values.map(Math.abs).sort((a, b) => a - b);
  return 1.15 * sizes[Math.min(sizes.length - 1, Math.floor(0.995 * sizes.length))] || 1;
}

/** How many of the points drawn lie beyond what their axis shows. */
function outsideText(values, reach) {
  const outside = values.filter((v) => known(v) && Math.abs(v) > reach).length;
  return outside ? `Outside the picture: ${counted(outside, 'point')} (double-click to see all).` : '';
}

function panelFigure(panel, made) {
  const reach = reachOf([...panel.before, ...panel.after]);
  const one = (which, title) => h(
      'div', {}, h('h4', {}, title),
      plot(`Residual against ${panel.covariate}, ${title}`, () => 320, () => drawPanel(panel, which, reach)));
  const of = panel.rotor ? `rotor ${panel.rotor}` : report.runs.before.length > 1 ? 'all rotors' : 'all rows';
  const session = panel.covariate === 'session';
  const caption = session ?
      'Each session’s residuals, numbered in order of time, with their means and 95 % intervals. No covariate explains why sessions differ.' :
      sentences(
          `Grey: every run, ${of}; blue: means of runs of like ${panel.covariate} with 95 % intervals`,
          'from the runs’ scatter; orange: what the fitted model makes of it for the same runs, without what the baseline’s',
          `own coefficients absorb${panel.half ? ', with its 95 % band' : ''}.`,
          'Before: everything else that was found is taken out. After: this too.', outsideText([...panel.before, ...panel.after], reach),
          panel.place ?
              `Only runs where ${panel.place} is 0.5 or more; below −0.5 too, with the sign of what was measured turned round.` :
              '',
          panel.times ?
              `Only that half of the runs where ${panel.times} is farther from its mean; below the mean with the sign of what was measured turned round.` :
              '');
  const plots = session ? one('after', 'sessions') :
                          h('div', {class: 'pair'}, one('before', 'before: all else taken out'), one('after', 'after: this taken out too'));
  return figure(`${panel.label}, against ${panel.covariate}`, [], plots, caption, made);
}

function drawOrder(which, reach) {
  const {runs} = report;
  const colours = rotorColours();
  const data =
      runs[which].map((values, c) => ({
                        type: 'scatter',
                        mode: 'markers',
                        name: runs[which].length > 1 ? `rotor ${c + 1}` : 'residual',
                        x: values.map((_, i) => i + 1),
                        y: values,
                        cliponaxis: false,
                        text: values.map((_, i) => runText(i, c + 1)),
                        marker: {color: colours[c % 4], symbol: symbols[c % 4], size: 4, opacity: 0.7},
                        hovertemplate: '%{text}<br>%{y:.4g}<extra></extra>'
                      }));
  const starts = runs.block.flatMap((block, i) => (i > 0 && block !== runs.block[i - 1] ? [i + 0.5] : []));
  const shapes = starts.length > 60 ? [] : starts.map((x) => ({
                                                        type: 'line',
                                                        yref: 'paper',
                                                        y0: 0,
                                                        y1: 1,
                                                        x0: x,
                                                        x1: x,
                                                        layer: 'below',
                                                        line: {color: style('--line'), width: 1}
                                                      }));
  return {
    data,
    layout: {
      xaxis: axis('number of the run, in order of time [–]', {zeroline: false, showgrid: false}),
      yaxis: axis(residualTitle(), {range: [-reach, reach]}),
      shapes,
      showlegend: data.length > 1,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom', itemsizing: 'constant'}
    }
  };
}

function orderFigure(made) {
  const {runs} = report;
  const values = [...runs.before, ...runs.after].flat().filter(known);
  const reach = reachOf(values);
  const curves = report.explanation.unknown.some((u) => u.covariate !== 'session' && !u.by_sealed_too);
  const one = (which, title) =>
      h('div', {}, h('h4', {}, title),
        plot(`Residuals in order of time, ${which}`, () => 320, () => drawOrder(which, reach)));
  const caption = sentences(
      'Residuals of all runs as the whole model is fitted to all of them, before with the baseline alone.',
      'Vertical lines: a new block begins.', outsideText(values, reach));
  return figure(
      'Residuals in order of time', [],
      h('div', {class: 'pair'}, one('before', 'before: the baseline alone'),
        one('after', curves ? 'after: names and curves taken out' : 'after')),
      caption, made);
}

function drawCourse(course, which, reach) {
  const [blue, orange] = rotorColours();
  const seconds = course.u.map((u) => u * course.duration_s);
  const middle = which === 'before' ? course.measured : course.after;
  const half = which === 'before' ? course.half : course.after_half;
  const line = (name, y, colour, dash) =>
      ({type: 'scatter', mode: 'lines', name, x: seconds, y, line: {color: colour, width: 2.5, dash}});
  const data = [...bandOf(seconds, middle, half, blue), line('mean of the runs', middle, blue, 'solid')];
  if (which === 'before') data.push(line('model', course.model, orange, 'dash'));
  return {
    data,
    layout: {
      xaxis: axis('time since the run’s first frame [s]'),
      yaxis: axis('reading − mean [% of mean]', {range: [-reach, reach]}),
      showlegend: true,
      legend: {orientation: 'h', y: 1.02, yanchor: 'bottom'}
    }
  };
}

function courseFigure(course, made) {
  const reach =
      reachOf(course.measured.flatMap((v, i) => [v - course.half[i], v + course.half[i], course.model[i]]));
  const one = (which, title) =>
      h('div', {}, h('h4', {}, title),
        plot(`Course within the run, ${which}`, () => 300, () => drawCourse(course, which, reach)));
  return figure(
      `${course.label}, within the runs`, [],
      h('div', {class: 'pair'}, one('before', 'before: as measured'), one('after', 'after: named effects taken out')),
      'Mean course of the runs’ windows with its 95 % band, as its first six cosines give it.', made);
}
