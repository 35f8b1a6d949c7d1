// The data, and the commands that make them again.

const report = JSON.parse(document.getElementById('data').textContent);

/** "tunnelrig map --db my.db --out maps", with the model's terms where there are any. */
function command(verb, rest = '') {
  const {db, model} = report.made;
  const file = /^[\w./+-]+$/.test(db) ? db : `'${db.replaceAll('\'', '\'\\\'\'')}'`;
  const words = ['tunnelrig', verb, '--db', file];
  if (rest) words.push(rest);
  if (model !== 'thesis' && ['reduce', 'map'].includes(verb))
    words.push('--with', model.replaceAll('+', ','));
  return words.join(' ');
}
