// The recording's own health: the ledger, the ring, the clocks, the disk, the last tare.

const ledgerNames = {
  stored: 'Frames stored',
  lost: 'lost',
  late: 'late',
  duplicate: 'duplicate packets',
  corrupt: 'corrupt packets',
  reboots: 'reboots of the board',
  silences: 'silences',
};

const clockText = ({board_clock_ppm: ppm, board_clock_ppm_interval: interval}) =>
    known(ppm) ? `${known(interval) ? withU95(ppm, interval, true) : fixed(ppm, 1, true)} ppm` : '–';

/** What is shown: a label, its value of a state, and whether the value is one to worry about. */
const healthRows = [
  ...Object.entries(ledgerNames).map(([name, label]) => ({
                                       label: name === 'stored' ? label : `… ${label}`,
                                       value: ({ledger}) => (ledger?.[name] ?? 0).toLocaleString('en'),
                                       bad: ({ledger}) =>
                                           !['stored', 'duplicate'].includes(name) && ledger?.[name] > 0,
                                     })),
  {
    label: 'Board\'s ring, highest fill',
    value: ({ring_high_water: fill}) => (known(fill) ? fill.toLocaleString('en') : '–'),
  },
  {label: 'Board\'s clock against this computer\'s', value: clockText},
  {label: 'Disk left', value: ({disk_free_B}) => bytes(disk_free_B)},
  {
    label: 'Last tare',
    value: ({tare_age_s}, mode) =>
        (known(tare_age_s) ? `${duration(tare_age_s)} ago` :
             mode === 'file' ? '–' :
                               'none in this session'),
  },
  {
    label: 'Pages open',
    value: ({viewers, display_frames_dropped: dropped}) =>
        `${viewers ?? '–'}${dropped ? `; ${dropped.toLocaleString('en')} display frames dropped` : ''}`,
  },
];

function startHealth() {
  const list = h('dl', {class: 'health'});
  const cells = healthRows.map(({label}) => {
    const value = h('dd', {}, '–');
    list.append(h('div', {}, h('dt', {}, label), value));
    return value;
  });
  byId('health').append(
      list,
      h('p', {class: 'soft'},
        'Display frames are dropped before anything else; what is stored does not depend on pages.'));
  let mode = 'log';
  on('hello', (hello) => (mode = hello.mode));
  on('state', (state) => {
    healthRows.forEach(({value, bad}, i) => {
      const wrong = Boolean(bad?.(state));
      setText(cells[i], (wrong ? '⚠ ' : '') + value(state, mode));
      setClass(cells[i], 'bad', wrong);
    });
  });
}
