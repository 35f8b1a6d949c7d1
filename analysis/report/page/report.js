// The data, and the commands that make them again.

const report = JSON.parse(document.getElementById('data').textContent);

/** "tunnelrig map --db my.db --out maps", with the model's terms where there are any. */
function command(verb, rest = '') {
  const {db, model} = report.made;
  const file = /^[\w./+-]+$/.test(db) ? db : `'${db.replaceAll('\'', '\'\\\'\'')}'`;
  const terms = model !== 'thesis' && verb !== 'calibrate' && verb !== 'doctor' ?
      ` --with ${model.replaceAll('+', ',')}` :
      '';
  return `tunnelrig ${verb} --db ${file}${rest ? ` ${rest}` : ''}${terms}`;
}
