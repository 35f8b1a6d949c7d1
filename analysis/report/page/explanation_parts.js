// What an explanation says, in words and with its errors: of the explanation's own page, and of the report
// where a model was adopted.

/** "0.0123": three digits of anything. */
function digits(value, n = 3) {
  if (!known(value)) return '–';
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-4 || size >= 1e6) ? size.toExponential(n - 1) :
                                                            String(Number(size.toPrecision(n)));
  return (value < 0 ? '−' : '') + text;
}

/** No p is below one over the simulated data sets and one: there it is a bound. The report knows no number of them. */
const isLeastP = (p) => known(p) && p * (report.settings?.simulations + 1) < 1.001;
const digitsOfP = (p) => (isLeastP(p) ? '≤ ' : '') + digits(p);
const sayP = (p) => `p ${isLeastP(p) ? '≤' : '='} ${digits(p)}`;

const bracket = ([low, high]) => `[${digits(low)}, ${digits(high)}]`;
const unitSuffix = (unit) => (unit && unit !== '1' ? ` ${unit}` : '');
const unitBracket = (unit) => (unit === '' ? '' : ` [${unit === '1' ? '–' : unit}]`);

const effectLabel = ({effect, form, rotor, from_rotor: from}) => effect + (form ? ` (${form})` : '') +
    (from ? ` from rotor ${from}` : '') + (rotor ? ` ${from ? 'to' : 'of'} rotor ${rotor}` : '');

/** What the error after counts: where there are curves without a name, whether they are in it. */
const afterTitle = ({unknown, empirical = []}) => !unknown.length ? 'after' :
    empirical.length                                              ? 'after, curves included' :
                                                                    'after, named effects only';

function drawErrors(explanation) {
  const {before, after, noise_floor: floor, unit} = explanation;
  const afterName = afterTitle(explanation);
  const names = ['noise floor', afterName, 'before'];
  const colours = rotorColours();
  const dot = (y, error, colour, symbol) => ({
    type: 'scatter',
    mode: 'markers',
    name: y,
    x: [error.held_out_rmse],
    y: [y],
    error_x: {
      type: 'data',
      symmetric: false,
      array: [error.held_out_ci95[1] - error.held_out_rmse],
      arrayminus: [error.held_out_rmse - error.held_out_ci95[0]],
      color: colour,
      thickness: 2,
      width: 8
    },
    marker: {color: colour, size: 13, symbol},
    hovertemplate: `${y}: ${digits(error.held_out_rmse, 4)} ${bracket(error.held_out_ci95)}${
        unitSuffix(unit)}<extra></extra>`
  });
  const floorDot = {
    type: 'scatter',
    mode: 'markers',
    x: [floor],
    y: ['noise floor'],
    marker: {color: style('--ink'), size: 13, symbol: 'diamond'},
    hovertemplate: `noise floor: ${digits(floor, 4)}${unitSuffix(unit)}<extra></extra>`
  };
  const line = {
    type: 'line',
    yref: 'paper',
    y0: 0,
    y1: 1,
    x0: floor,
    x1: floor,
    line: {color: style('--ink'), width: 1, dash: 'dot'}
  };
  // Of two or three blocks an interval may end far outside: the errors are what is to be seen.
  const farthest = 4 * Math.max(before.held_out_rmse, after.held_out_rmse, floor);
  const end = Math.min(farthest, 1.05 * Math.max(before.held_out_ci95[1], after.held_out_ci95[1], floor));
  return {
    data: [floorDot, dot(afterName, after, colours[0], 'circle'), dot('before', before, colours[1], 'square')],
    layout: {
      xaxis: axis(`root mean square error on blocks held out${unitBracket(unit)}`, {range: [0, end]}),
      yaxis: axis('', {type: 'category', categoryarray: names, categoryorder: 'array', range: [-0.5, 2.5]}),
      shapes: [line],
      showlegend: false
    }
  };
}

function errorFigure(explanation, made) {
  const {before, after, noise_floor: floor, unit} = explanation;
  const value = (error) =>
      `${digits(error.held_out_rmse, 4)} ${bracket(error.held_out_ci95)}${unitSuffix(unit)}`;
  const caption = sentences(
      `Error on blocks held out: before ${value(before)}; ${afterTitle(explanation)}, ${value(after)}; bars are 95 % intervals,`,
      'by resampling the blocks. The noise floor,',
      `${digits(floor, 4)}${unitSuffix(unit)}, is the error to expect of an exact model: scatter of runs`,
      'and sessions, and the uncertainty of its coefficients.',
      explanation.unknown.length && !(explanation.empirical || []).length &&
          'Structure without a name is no part of the error after, but is allowed for in the floor.');
  return figure(
      'Held-out error', [],
      plot('Held-out error before and after, and the noise floor', () => 230, () => drawErrors(explanation)),
      caption, made);
}

const parameterTable = (adopted, unit) => {
  const rows = adopted.flatMap(
      (effect) => Object.entries(effect.parameters).map(([name, p]) => ({effect, name, ...p})));
  return table(
      'Parameters with 95 % intervals (jackknife over the blocks)',
      [
        {name: 'effect', cell: (r) => effectLabel(r.effect), text: true},
        {name: 'parameter', cell: (r) => r.name, text: true},
        {name: 'value', cell: (r) => digits(r.value, 4) + (r.theory ? ' (theory)' : '')},
        {name: '95 % interval', cell: (r) => bracket(r.ci95)},
        {name: 'unit', cell: (r) => (r.unit === '1' ? '–' : r.unit), text: true},
        {name: 'p of the effect', cell: (r) => digitsOfP(r.effect.p_value)},
        {name: `gain${unitBracket(unit)}`, cell: (r) => digits(r.effect.held_out_gain)},
      ],
      rows);
};

/** What cannot be told from an effect, and what would tell. */
function confusionText({confounded_with: rivals, separating_run: run}) {
  if (!rivals.length) return 'Nothing else that was tried does as well on blocks that it has not seen.';
  const list = rivals.map((name) => `\`${name}\``).join(', ');
  const remedy =
      run ? ` To tell them apart, make ${run.text}.` : ' No run within reach would tell them apart.';
  return `These data cannot tell it from ${list}.${remedy}`;
}

const nameOfText = (label) => label || '(empty)';

/** What each text makes, against the mean of all, with half of its 95 % interval. */
const labelsText = ({shape, labels = []}, unit) => labels.length === 0 ?
    '' :
    ` ${shape.map(([x, y, low, high]) => `${nameOfText(labels[x - 1])} ${digits(y)} ± ${digits((high - low) / 2, 2)}`)
            .join(', ')}${unitSuffix(unit)}, with 95 % intervals.`;

/** What a slope that goes with the place does where. */
const placeText = (place) => place === 'tunnel' ? ' in the tunnel, compared with open space' :
    place                                       ? ` in proportion to \`${place}\` of the location (amplitude: where that is 1)` :
                                                  '';

/** What a slope that goes with another condition does. */
const timesText = (times) => times ?
    ` in proportion to how far \`${times}\` is from its mean (amplitude: where that is farthest)` :
    '';

const namesText = (unknown, onAllBlocks) => (unknown.could_be ?? [])
    .filter((name) => Boolean(name.on_all_blocks) === onAllBlocks)
    .map((name) => `${name.effect}${name.rotor ? ` at rotor ${name.rotor}` : ''}${
        name.at_theory ? ' at theory’s coefficient' : ''}`)
    .join(', or ');

const unknownText = (unknown, unit) => {
  const {covariate, place, times, rotor, amplitude, p_value: p, instead_of: insteadOf = []} = unknown;
  const bySealed = unknown.by_sealed_too ?
      ' The blocks that were not sealed are too few to show it, so it is in no error, and is not adopted as a curve.' :
      '';
  const given = namesText(unknown, false);
  const ofAll = namesText(unknown, true);
  const names = `${given ? ` ${given} may have a part in it: found before it, and not beyond chance beside it.` : ''}${
      ofAll ? `${unknown.by_sealed_too ? '' : ' With the sealed blocks in,'} ${
                  ofAll} would do as well, and could not be scored any more: more sessions would tell.` :
              ''}`;
  const twins = unknown.collinear_with?.length ? ` Not to be told from ${unknown.collinear_with.join(', ')}.` : '';
  const where = `${rotor ? ` at rotor ${rotor}` : ''}${placeText(place)}${timesText(times)}`;
  return `Depends on \`${covariate}\`${where}: amplitude ${digits(amplitude)}${
      unitSuffix(unit)}, ${sayP(p)}. A shape, not a cause.${twins}${bySealed}${names}${labelsText(unknown, unit)}${
      insteadOf.length ? ` It bends away from the formula of ${insteadOf.join(', ')}.` : ''}`;
};
