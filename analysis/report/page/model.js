// What the adopted model gained, as the explanation that it comes from has it.

function modelSection(versions) {
  return versions.map(({version, created_utc: created, arguments: made, explanation}) => {
    const {adopted, unknown, unit} = explanation;
    return [
      h('p', {},
        prose(`Model ${version}, stored ${created}, from ${counted(explanation.runs, 'run')} in ${
            counted(explanation.blocks, 'block')}; response ${explanation.response}.`)),
      errorFigure(explanation, made),
      adopted.length ? parameterTable(adopted, unit) : [],
      adopted.map(
          (effect) => h('p', {}, h('strong', {}, `${effectLabel(effect)}. `), prose(confusionText(effect)))),
      unknown.map((u) => h('p', {}, h('strong', {}, 'unknown. '), prose(unknownText(u, unit)))),
    ];
  });
}
