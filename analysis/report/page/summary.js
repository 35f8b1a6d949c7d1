// What one reads first.

/** Whether anything was measured, said plainly. */
function originOfRuns({simulated, measured, unknown}) {
  const of = (n) => counted(n, 'run');
  const kinds = [simulated, measured, unknown].filter(Boolean).length;
  if (kinds > 1) {
    const parts = [
      simulated && `${of(simulated)} simulated by the virtual rig`,
      measured && `${of(measured)} recorded from a board`,
      unknown && `${of(unknown)} whose column \`source\` does not say where they come from`,
    ];
    return {kind: 'mixed', text: `Mixed: ${parts.filter(Boolean).join(', ')}.`};
  }
  if (simulated) {
    const text = `all ${of(simulated)} come from the virtual rig. No number on this page was measured.`;
    return {kind: 'simulated', text: `Simulated: ${text}`};
  }
  if (measured) return {kind: 'measured', text: `Measured: all ${of(measured)} were recorded from a board.`};
  const text =
      'the column `source` is empty in every run, so the file does not say whether they were measured ' +
      'or simulated.';
  return {kind: 'unknown', text: `Origin not recorded: ${text}`};
}

const percent = ({value, u95}) => `${withU95(value, u95, true)} %`;

/** "H4V-2 (ȳ = 0.80, z̄ = −0.40)" */
const place = ({location, y_norm: y, z_norm: z}) =>
    (known(y) ? `${location} (ȳ = ${fixed(y, 2)}, z̄ = ${fixed(z, 2)})` : location);

function changeOfThrust({greatest_delta_ct_percent: most, least_delta_ct_percent: least}) {
  if (!most) return '';
  const up = `${percent(most)} at ${place(most)}`, down = `${percent(least)} at ${place(least)}`;
  return `Against OT, C_T changes by up to ${up} and down to ${down}.`;
}

function unevenThrust({greatest_uneven_percent: uneven}) {
  if (!uneven) return '';
  const side = uneven.value < 0 ? 'right' : 'left';
  const value = `${percent(uneven)}, the ${side} pair lifting less`;
  const offset = known(uneven.offset) && percent({value: uneven.offset, u95: uneven.offset_u95});
  return offset ?
      `Less the rig’s own offset of ${offset}, the uneven thrust U is largest at ${place(uneven)}: ${value}.` :
      `The uneven thrust U as measured, the rig’s own offset included, is largest at ${place(uneven)}: ${value}.`;
}

/** What the model in force corrects for, and what that gained. */
function modelInForce({model}) {
  if (!model) return '';
  const {effects, before, after, noise_floor: floor, unit} = model;
  const error = (e) => `${digits(e.held_out_rmse)} ${bracket(e.held_out_ci95)}`;
  const gain = before && after ?
      ` On blocks held out, the error is ${error(before)} before and ${error(after)}${unitSuffix(unit)} after ` +
          `(95 % intervals)${known(floor) ? `; a model that were exact would leave ${digits(floor)}${unitSuffix(unit)}` : ''}.` :
      '';
  return `${counted(effects.length, 'effect')} adopted: ${effects.join(', ')}.${gain}`;
}

const contactsOf = (n) => (n ? counted(n, 'contact') : 'no contact');

function bestController({flown}) {
  if (!flown) return flown === null ? 'No controller came through all scenarios, so none is the best.' : '';
  const {scenarios, controllers, name, rms_mm: rms, contacts} = flown;
  const among = `Of ${counted(controllers, 'controller')}, flown in simulation through`;
  if (scenarios > 1) {
    return `${among} ${scenarios} scenarios, ${name} does best: ${fixed(rms, 1)} mm rms error over all, ${
        contactsOf(contacts)}; it is first, or not told apart from the first, in ${flown.first_in} of them.`;
  }
  const {ci95_mm: interval, as_good: others} = flown;
  const bar = interval ? ` (mean over the runs, 95 %: ${fixed(interval[0], 1)} to ${fixed(interval[1], 1)} mm)` : '';
  const ties = others.length ? `; the runs do not tell it from ${others.join(', ')}` : '';
  return `${among} ${flown.scenario} in the ${flown.tunnel} tunnel, ${name} does best: ${
      fixed(rms, 1)} mm rms error${bar}, ${contactsOf(contacts)}${ties}.`;
}

function losses({frames_emitted: emitted, frames_lost: lost}) {
  const all = emitted.toLocaleString('en');
  if (!emitted) return 'There are no raw data, so no losses either.';
  if (!lost) return `None of the ${all} frames sampled was lost.`;
  const share = fixed((100 * lost) / emitted, 3);
  return `Of the ${all} frames sampled, ${lost.toLocaleString('en')} were lost (${share} %).`;
}

function verdict({calibration_passed: passed}) {
  if (passed === undefined) return '';
  return `The calibration ${passed ? 'passed all its gates' : 'did not pass all its gates'}.`;
}

function whatPlusMinusIs({u95_without: without}) {
  if (!without.length) return 'Every ± on this page is U95, which holds the value with 95 % probability.';
  return `Every ± on this page is U95 without the scatter between ${without.join(' and ')}, which no location ` +
      'shows: it holds the value with less than 95 % probability.';
}

function summaryText(summary) {
  const places = {OT: 'in the middle of the tunnel (OT)', OS: 'in open space (OS)'};
  const c_t = (summary.c_t ?? []).map((v) => `${withU95(v.value, v.u95)} ${places[v.location]}`);
  const runs = `${counted(summary.runs, 'run')} in ${counted(summary.sessions, 'session')};`;
  const {reduced_runs: reduced, locations} = summary;
  const coefficients = () => `${counted(reduced, 'thrust run')} at ${counted(locations, 'location')}`;
  return sentences(
      runs, reduced ? `${coefficients()} give coefficients.` : 'none gives coefficients yet.',
      c_t.length && `C_T is ${c_t.join(' and ')}.`, changeOfThrust(summary), unevenThrust(summary),
      modelInForce(summary), bestController(summary), losses(summary), verdict(summary), ...summary.missing,
      reduced && whatPlusMinusIs(summary));
}

function headOfCampaign() {
  const {kind, text} = originOfRuns(report.summary.origins);
  return [
    h('p', {class: `origin ${kind}`}, prose(text)),
    h('p', {class: 'summary'}, prose(summaryText(report.summary))),
    h('p', {class: 'soft'}, 'As figures for a paper, 84 mm wide: ', code(command('report', '--figures figures'))),
  ];
}

function headOfTable() {
  const {table} = report.sections;
  const rows = counted(report.observations, 'observation');
  const groups = () =>
      `, ${counted(table.reduced, 'value')} of C_T in ${counted(table.groups.length, 'group')}`;
  return [
    h('p', {class: 'origin unknown'},
      'A table of observations made elsewhere: this program recorded none of them.'),
    h('p', {class: 'summary'}, prose(sentences(
        `${rows}${table.absent ? '' : groups()}.`, bestController(report.summary), ...report.summary.missing ?? []))),
  ];
}

function head() {
  document.title = `${report.name} – tunnelrig report`;
  const rest = report.kind === 'table' ? headOfTable() : headOfCampaign();
  return [h('p', {class: 'kind'}, 'tunnelrig report'), h('h1', {}, report.name), ...rest];
}
