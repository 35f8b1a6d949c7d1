// The data, and the commands that make them again.

const report = JSON.parse(document.getElementById('data').textContent);

/** The options that choose the model of this page: a version of the file's, or terms on the thesis's. */
function modelOptions({model}) {
  const [, version] = /^version (\d+)/.exec(model) ?? [];
  if (version) return [`--model ${version}`];
  if (model !== 'thesis') return [`--with ${model.replaceAll('+', ',')}`];
  return report.sections?.model ? ['--model thesis'] : [];  // where the newest version would be taken
}

/** "tunnelrig map --db my.db --out maps", with the model where it is not the one that would be taken. */
function command(verb, rest = '') {
  const {db} = report.made;
  const file = /^[\w./+-]+$/.test(db) ? db : `'${db.replaceAll('\'', '\'\\\'\'')}'`;
  const words = ['tunnelrig', verb, '--db', file];
  if (rest) words.push(rest);
  if (['reduce', 'map', 'report'].includes(verb)) words.push(...modelOptions(report.made));
  return words.join(' ');
}
