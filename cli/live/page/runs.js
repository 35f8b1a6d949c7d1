// The runs, of all locations or of the chosen one, and what can be done with each.

const runsAtOnce = 25;

async function noteOn(run) {
  const text =
      await ask(`Note on ${run}`, {label: 'Note', accept: 'Add note', explain: 'It is kept with the run.'});
  if (text) send('note', {run, text}, `The note is with ${run}.`);
}

async function exclude(run) {
  const reason = await ask(`Exclude ${run}`, {
    label: 'Reason',
    accept: 'Exclude',
    explain: 'The run is kept in the file and left out of coefficients and maps.',
  });
  if (reason) send('exclude', {run, reason}, `${run} is excluded.`);
}

async function redo(run) {
  const sure = await ask(`Redo ${run}`, {
    accept: 'Record anew',
    explain: `The same location and repeat are recorded again, now. ${
        run} is kept, and excluded once the new run is complete.`,
  });
  if (sure) send('redo', {run}, `${run} is recorded anew.`);
}

const smallButton = (text, run, act) =>
    h('button', {type: 'button', class: 'small', 'aria-label': `${text} ${run}`, click: act}, text);

function actionsOn({run, excluded}) {
  return h(
      'span', {class: 'actions'}, smallButton('Note', run, () => noteOn(run)),
      smallButton('Redo', run, () => redo(run)),
      excluded ? smallButton('Include', run, () => send('include', {run}, `${run} counts again.`)) :
                 smallButton('Exclude', run, () => exclude(run)));
}

function remarksOn({state, alarms, excluded, notes}) {
  const words = [];
  if (state !== 'complete') words.push(badge('note', state));
  for (const alarm of alarms ?? []) words.push(badge('problem', `⚠ ${alarm.replaceAll('_', ' ')}`));
  if (excluded) words.push(h('span', {class: 'excluded'}, badge('note', 'excluded'), ` ${excluded}`));
  for (const note of notes ?? []) words.push(h('span', {}, `“${note}”`));
  return words.length ? h('span', {class: 'remarks'}, words.flatMap((word) => [word, ' '])) : '';
}

const runColumns = (writable) =>
    [{name: 'Run', cell: (r) => r.run, text: true},
     {name: 'Location', cell: (r) => r.location ?? '–', text: true},
     {name: 'Session', cell: (r) => r.session ?? '–', text: true},
     {name: 'Repeat', cell: (r) => (r.kind === 'tare' ? 'tare' : String(r.repeat ?? '–'))},
     {name: 'C_T', cell: (r) => fixed(r.c_t, 5)},
     {name: 'U [%]', cell: (r) => fixed(r.u_percent, 2, true)},
     {name: 'Frames', cell: (r) => (r.frames ?? 0).toLocaleString('en')},
     {name: 'Lost', cell: (r) => (r.lost ?? 0).toLocaleString('en')},
     {name: 'Remarks', cell: remarksOn, text: true},
     ...(writable ? [{name: 'Actions', cell: actionsOn, text: true}] : []),
];

/** The buttons are made anew with the table; the one that had the focus gets it back. */
function keepingFocus(place, refill) {
  const label =
      place.contains(document.activeElement) ? document.activeElement.getAttribute('aria-label') : null;
  const scroll = place.querySelector('.scroll')?.scrollLeft ?? 0;
  refill();
  const after = place.querySelector('.scroll');
  if (after) after.scrollLeft = scroll;
  if (label) place.querySelector(`[aria-label="${CSS.escape(label)}"]`)?.focus();
}

function startRuns() {
  const place = h('div', {}), head = h('p', {class: 'chosen'});
  byId('runs').append(head, place);
  let campaign = null, writable = false, shown = runsAtOnce;
  const fill = () => {
    if (!campaign) return;
    const location = campaign.locations.find((l) => l.label === chosen.label);
    const runs = campaign.runs.filter((r) => !chosen.label || r.location === chosen.label).reverse();
    head.replaceChildren(
        chosen.label ? `${chosen.label}: ${counted(runs.length, 'run')}. ` :
                       `${counted(runs.length, 'run')}, newest first. `,
        ...prose(location ? mapsAt(campaign, location) : ''), ' ',
        ...(chosen.label ? [h('button', {type: 'button', class: 'small', click: () => chooseLocation(null)},
                              'Show all locations')] :
                           []));
    if (runs.length === 0) return place.replaceChildren(h('p', {class: 'absent'}, 'None yet.'));
    const left = runs.length - shown;
    const more =
        h('button', {
          type: 'button',
          click: () => {
            shown += 10 * runsAtOnce;
            fill();
          }
        },
          `Show older runs (${left.toLocaleString('en')} more)`);
    keepingFocus(
        place,
        () => place.replaceChildren(
            table('Runs, newest first', runColumns(writable), runs.slice(0, shown)),
            ...(left > 0 ? [more] : [])));
  };
  on('hello', (hello) => {
    writable = hello.writable;
    fill();
  });
  on('campaign', (latest) => {
    campaign = latest;
    account.runs = latest.runs.length;
    fill();
  });
  chosen.listeners.push(() => {
    shown = runsAtOnce;
    fill();
  });
}
