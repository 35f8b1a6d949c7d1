// Tables of other rigs: C_T against speed, group by group.

const kFew = 8;  // groups that get a colour each

const sweepTrace = (group, colour, i) => ({
  type: 'scatter',
  mode: 'lines+markers',
  name: plain(group.group),
  x: group.speed_rpm,
  y: group.c_t,
  line: {color: colour, width: 1.6},
  marker: {color: colour, size: 6, symbol: symbols[i % symbols.length]},
  hovertemplate: '%{fullData.name}<br>%{x:.0f} rev/min<br>C<sub>T</sub> %{y:.5f}<extra></extra>'
});

/** All groups as one faint line, so that the chosen ones stand before them. */
function backdrop(groups) {
  const join = (column) => groups.flatMap((group) => [...group[column], null]);
  return {
    type: 'scatter',
    mode: 'lines',
    name: 'all groups',
    x: join('speed_rpm'),
    y: join('c_t'),
    line: {color: style('--soft'), width: 0.7},
    opacity: 0.4,
    hoverinfo: 'skip'
  };
}

/** From 0 to beyond what all but one in a hundred rows say, so that a few wild ones do not flatten the rest. */
function usualRange(groups) {
  const values = groups.flatMap((g) => g.c_t).sort((a, b) => a - b);
  const quantile = (share) => values[Math.round(share * (values.length - 1))];
  return [Math.min(0, 1.1 * quantile(0.01)), 1.1 * quantile(0.99)];
}

const outside = (groups, [low, high]) => groups.flatMap((g) => g.c_t).filter((c_t) => c_t < low || c_t > high);

/** What is not in the curves, and what in them is not to be believed. */
function reservations({unknown, at_rest: atRest, doubtful_rows: doubtful}) {
  const rows = doubtful.slice(0, 6).join(', ') + (doubtful.length > 6 ? ' and more' : '');
  return sentences(
      unknown && `${counted(unknown, 'row')} left out, whose speed or diameter is not known.`,
      atRest && `${counted(atRest, 'row')} left out, whose motor stood.`,
      rows && `In doubt, being far off the rest of their group: ${rows}.`);
}

function drawSweeps(section, chosen) {
  const colours = [...rotorColours(), ...budgetColours().slice(4)];
  const shown = chosen.slice(0, kFew);
  const data = shown.map((k, i) => sweepTrace(section.groups[k], colours[i % colours.length], i));
  return {
    data: section.groups.length > shown.length ? [backdrop(section.groups), ...data] : data,
    layout: {
      xaxis: axis('speed [rev/min]', {tickformat: ',d'}),
      yaxis: axis(`C<sub>T</sub> (${section.convention} convention) [–]`, {range: usualRange(section.groups)}),
      showlegend: true,
      legend: {orientation: 'h', y: -0.2, yanchor: 'top'}
    }
  };
}

/** Groups to choose from, with a field that narrows the list. */
function groupPicker(groups, chosen, change) {
  const options = groups.map((group, i) => h('option', {value: i}, group.group));
  const select = h('select', {multiple: '', size: '8', 'aria-label': 'Groups to show'}, options);
  chosen.forEach((i) => {
    options[i].selected = true;
  });
  select.addEventListener(
      'change', () => change([...select.selectedOptions].map((option) => Number(option.value))));
  const filter = h('input', {type: 'search', placeholder: 'part of a name'});
  filter.addEventListener('input', () => {
    const part = filter.value.toLowerCase();
    select.replaceChildren(...options.filter((option) => option.text.toLowerCase().includes(part)));
  });
  const how = `Choose up to ${kFew}: hold Ctrl (⌘) or Shift for more than one.`;
  return h('div', {class: 'picker'}, h('label', {}, 'Filter ', filter), select, h('p', {class: 'soft'}, how));
}

function sweepFigure(section) {
  const {groups, response, response_unit: unit, convention} = section;
  let chosen = groups.slice(0, 3).map((_, i) => i);
  const place = plot(
      'C_T against speed by group; the table beneath has a summary', (width) => (isNarrow(width) ? 460 : 500),
      () => drawSweeps(section, chosen));
  const picker = groupPicker(groups, chosen, (now) => {
    chosen = now;
    redraw(place);
  });
  const beyond = outside(groups, usualRange(groups)).length;
  const caption = sentences(
      `C_T of one rotor, from the column ${response}${response.includes(unit) ? '' : ` [${unit}]`},`,
      `in the ${convention} convention. Faint lines: all groups.`,
      beyond && `Outside the picture: ${counted(beyond, 'row')} (double-click to see all).`,
      'A table carries no repeats of its own, so there are no',
      'error bars: the scatter along a curve is what is known.', reservations(section));
  const content = groups.length > 1 ? h('div', {class: 'with-picker'}, picker, place) : place;
  return figure(
      'Thrust coefficient against speed', [], content, caption, command('reduce', '--csv coefficients.csv'));
}

/** Of the lowest or the highest speed that is known; rows without one stand behind the others. */
const atEnd = ({speed_rpm: speeds}, values, highest) => {
  const count = speeds.filter(known).length;
  return count ? values[highest ? count - 1 : 0] : null;
};

const sweepTable = (groups) => table(
    'C_T by group',
    [
      {name: 'group', cell: (g) => g.group, text: true},
      {name: 'rows', cell: (g) => String(g.c_t.length)},
      {name: 'speed from [rev/min]', cell: (g) => fixed(atEnd(g, g.speed_rpm, false), 0)},
      {name: 'to', cell: (g) => fixed(atEnd(g, g.speed_rpm, true), 0)},
      {name: 'C_T median', cell: (g) => fixed(g.median, 5)},
      {name: 'spread', cell: (g) => fixed(g.spread, 5)},
      {name: 'at the lowest speed', cell: (g) => fixed(atEnd(g, g.c_t, false), 5)},
      {name: 'at the highest', cell: (g) => fixed(atEnd(g, g.c_t, true), 5)},
    ],
    groups);

function tableSection(section) {
  const speeds = section.groups.some((g) => g.speed_rpm.some(known));
  return [
    speeds ? sweepFigure(section) :
             h('p', {class: 'absent'}, 'The table names no speed, so there is no curve.'),
    sweepTable(section.groups)
  ];
}
