// The page of one explanation: sections in their order.

const {explanation} = report;
const made = report.made.arguments;

const verdictKinds = {
  explained: 'ok',
  no_structure: 'neutral',
  confounded: 'note',
  partly_explained: 'note'
};

function answerSection() {
  const {adopted, unknown, unit, verdict, detectable_at_80_percent_power: detectable} = explanation;
  const nothing =
      `No effect above ${digits(detectable)}${unitSuffix(unit)} (rms) is likely to have gone unseen: `;
  return [
    h('p', {}, badge(verdictKinds[verdict] ?? 'problem', verdict), ' ', prose(report.verdict_in_words)),
    verdict === 'no_structure' ? h('p', {}, `${nothing}one as large is found at 80 % power.`) : [],
    adopted.map((effect, i) => {
      const {label, formula, physics} = report.effects[i];
      return [
        h('h3', {}, label), h('p', {}, code(formula)), h('p', {}, physics),
        h('p', {}, prose(confusionText(effect)))
      ];
    }),
    adopted.length ? parameterTable(adopted, unit) : [],
    unknown.map((u) => [h('h3', {}, `unknown: ${[u.covariate, u.times].filter(Boolean).join(' × ')}`), h('p', {}, prose(unknownText(u, unit)))]),
  ];
}

const residualSection = () =>
    [...report.panels.map((panel) => panelFigure(panel, made)),
     ...report.courses.map((course) => courseFigure(course, made)),
     orderFigure(made),
];

const rankingSection = () =>
    [...report.rounds.map((round, i) => roundFigure(round, i, made)),
     ...report.curve_rounds.map((round, i) => curveRoundFigure(round, i, made)),
];

const untestableSection = () => table(
    'Candidates that these data cannot test',
    [
      {name: 'effect', cell: (u) => u.effect, text: true},
      {
        name: 'why',
        cell: (u) => h('span', {class: 'wrap'}, u.missing.length && u.effect !== 'structure' ? `not recorded: ${u.missing.join(', ')}` : u.reason),
        text: true
      },
    ],
    explanation.untestable, 'whole');

const suspectSection = () =>
    [h('p', {},
       'Beyond what the scatter of so many runs reaches in one campaign of a hundred; kept in the fit.'),
     table(
         'Suspect rows',
         [
           {name: 'row', cell: (s) => s.row, text: true},
           {name: 'studentised residual', cell: (s) => fixed(s.studentised, 1, true)},
         ],
         explanation.suspect_rows),
];

const warningSection = () => h('ul', {}, explanation.warnings.map((warning) => h('li', {}, warning)));

function provenance() {
  const {program, created_utc: created, db} = report.made;
  const {alpha, seed, simulations, most_effects: most} = report.settings;
  const facts = [
    ['This page', [code(made), h('br'), `${program}, ${created}`]],
    ['Campaign file', h('code', {}, db)],
    ['Response and baseline', `${explanation.response}, ${explanation.baseline}`],
    ...(explanation.model_in_force ?
            [['Model', `version ${explanation.model_in_force} is in force for reduce, map and report; this explanation starts anew from the baseline ${explanation.baseline}`]] :
            []),
    ['Settings', `α ${alpha}, at most ${most} effects, up to ${simulations} simulated maxima, seed ${seed}`],
  ];
  return h('dl', {}, facts.map(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
}

const explanationSections = [
  {id: 'answer', title: 'What was found', build: answerSection, has: true},
  {id: 'error', title: 'Error before and after', build: () => errorFigure(explanation, made), has: true},
  {id: 'residuals', title: 'Residuals', build: residualSection, has: true},
  {id: 'ranking', title: 'Why: the candidates', build: rankingSection, has: report.rounds.length > 0},
  {
    id: 'untestable',
    title: 'What could not be tested',
    build: untestableSection,
    has: explanation.untestable.length > 0
  },
  {id: 'suspect', title: 'Suspect rows', build: suspectSection, has: explanation.suspect_rows.length > 0},
  {id: 'warnings', title: 'Warnings', build: warningSection, has: explanation.warnings.length > 0},
  {id: 'provenance', title: 'Provenance', build: provenance, has: true},
].filter(({has}) => has);

document.title = `${explanation.campaign} – tunnelrig explanation`;
const {runs, blocks} = explanation;
document.getElementById('head').replaceChildren(
    h('p', {class: 'kind'}, 'tunnelrig explanation'), h('h1', {}, explanation.campaign),
    h('p', {class: 'summary'},
      prose(`${counted(runs, 'run')} in ${counted(blocks, 'block')}; response ${
          explanation.response}, baseline ${explanation.baseline}. ${report.verdict_in_words}`)),
    h('nav', {'aria-label': 'Contents'},
      h('ol', {}, explanationSections.map(({id, title}) => h('li', {}, h('a', {href: `#${id}`}, title))))));
document.getElementById('main').replaceChildren(...explanationSections.map(
    ({id, title, build}) =>
        h('section', {id, 'aria-labelledby': `${id}-title`}, h('h2', {id: `${id}-title`}, title), build())));
startPlots();
