// What one reads first.

/** Whether anything was measured, said plainly. */
function originOfRuns({simulated, measured, unknown}) {
  const parts = [];
  if (simulated) parts.push(`${counted(simulated, 'run')} simulated by the virtual rig`);
  if (measured) parts.push(`${counted(measured, 'run')} recorded from a board`);
  if (unknown)
    parts.push(`${
        counted(
            unknown,
            'run')} imported without a word on where they come from (their column \`source\` is empty)`);
  if (simulated && !measured && !unknown)
    return {
      kind: 'simulated',
      text: `Simulated: all ${
          counted(simulated, 'run')} come from the virtual rig. No number on this page was measured.`
    };
  if (measured && !simulated && !unknown)
    return {kind: 'measured', text: `Measured: all ${counted(measured, 'run')} were recorded from a board.`};
  if (unknown && !simulated && !measured)
    return {
      kind: 'unknown',
      text: `Origin not recorded: the column \`source\` of all ${
          counted(
              unknown, 'run')} is empty, so the file does not say whether they were measured or simulated.`
    };
  return {
    kind: simulated ? 'simulated' : 'unknown',
    text: `Mixed: ${parts.join(', ')}. Locations may hold runs of more than one kind.`
  };
}

const at = ({location}) => `at ${location}`;

function extremes(summary) {
  const {greatest_delta_ct_percent: most, least_delta_ct_percent: least, greatest_uneven_percent: uneven} =
      summary;
  const sentences = [];
  if (most)
    sentences.push(
        `Against OT, the middle of the tunnel, C_T changes by up to ${
            withU95(most.value, most.u95, true)} % (${at(most)}) ` +
        `and down to ${withU95(least.value, least.u95, true)} % (${at(least)}).`);
  if (uneven)
    sentences.push(
        `The uneven thrust U is largest ${at(uneven)}: ${withU95(uneven.value, uneven.u95, true)} %` +
        `${uneven.value < 0 ? ', so the right pair lifts less' : ''}.`);
  return sentences;
}

function losses({frames_emitted: emitted, frames_lost: lost}) {
  if (!emitted) return 'There are no raw data, so no losses either.';
  if (!lost) return `None of the ${emitted.toLocaleString('en')} frames sampled was lost.`;
  return `Of the ${emitted.toLocaleString('en')} frames sampled, ${lost.toLocaleString('en')} were lost (${
      fixed((100 * lost) / emitted, 3)} %).`;
}

function summaryText(summary) {
  const names = {OT: 'in the middle of the tunnel (OT)', OS: 'in open space (OS)'};
  const c_t = (summary.c_t ?? []).map((v) => `${withU95(v.value, v.u95)} ${names[v.location]}`);
  const verdict = {
    true: 'The calibration passed all its gates.',
    false: 'The calibration did not pass all its gates.'
  };
  const reduced = summary.reduced_runs;
  return [
    `${counted(summary.runs, 'run')} in ${counted(summary.sessions, 'session')}` +
        (reduced ? `; ${counted(reduced, 'thrust run')} at ${
                       counted(summary.locations, 'location')} give coefficients.` :
                   '; none gives coefficients yet.'),
    c_t.length ? `C_T is ${c_t.join(' and ')}.` : '',
    ...extremes(summary),
    losses(summary),
    verdict[summary.calibration_passed] ?? '',
    reduced ?
        'Every ± on this page is U95, half the width of the interval that holds the value with 95 % probability.' :
        '',
  ].filter(Boolean)
      .join(' ');
}

function headOfCampaign() {
  const origin = originOfRuns(report.summary.origins);
  return [
    h('p', {class: `origin ${origin.kind}`}, prose(origin.text)),
    h('p', {class: 'summary'}, prose(summaryText(report.summary)))
  ];
}

function headOfTable() {
  const {table} = report.sections;
  return [
    h('p', {class: 'origin unknown'},
      'A table of observations made elsewhere: this program recorded none of them.'),
    h('p', {class: 'summary'},
      prose(
          table.absent ?
              `${counted(report.observations, 'observation')}.` :
              `${counted(report.observations, 'observation')}, ${counted(table.reduced, 'value')} of C_T in ${
                  counted(table.groups.length, 'group')}.`)),
  ];
}

function head() {
  document.title = `${report.name} – tunnelrig report`;
  return [
    h('p', {class: 'kind'}, 'tunnelrig report'), h('h1', {}, report.name),
    ...(report.kind === 'table' ? headOfTable() : headOfCampaign())
  ];
}
