// What the instruments beside the board say: a form with units, ranges and the last value of each.

const rangeText = ({low, high, unit, value}) => sentences(
    known(low) && known(high) &&
        `${String(low).replace('-', '−')} to ${high}${unit === '0 to 1' || !unit ? '' : ` ${unit}`};`,
    known(value) ? `last: ${+ value.toPrecision(7)}` : 'not given yet');

function metadataField(quantity) {
  const {label, unit, low, high, value} = quantity;
  const limits = {...(known(low) ? {min: String(low)} : {}), ...(known(high) ? {max: String(high)} : {})};
  const parts = field(
      `${label}${unit && unit !== '0 to 1' ? ` [${unit}]` : ''}`, rangeText(quantity),
      {type: 'number', step: 'any', inputmode: 'decimal', name: quantity.name, ...limits});
  parts.input.value = known(value) ? String(+value.toPrecision(7)) : '';
  parts.input.addEventListener('input', () => (parts.edited = true));
  return {...parts, quantity, isEdited: () => parts.edited, forget: () => (parts.edited = false)};
}

/** What was typed; null: the field was emptied. */
const typed = ({input}) => (input.value.trim() === '' ? null : Number(input.value));

function startMetadata() {
  const form = h('form', {class: 'metadata'});
  byId('metadata').append(form);
  let fields = [];
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const edited = fields.filter((f) => f.isEdited());
    if (edited.length === 0) return say('Nothing was changed.', false);
    const values = Object.fromEntries(edited.map((f) => [f.quantity.name, typed(f)]));
    if (await send('metadata', {values}, 'The conditions hold from the next run on.'))
      edited.forEach((f) => f.forget());
  });
  on('hello', ({metadata}) => {
    const names = (list) => list.map(({name}) => name).join();
    if (names(fields.map((f) => f.quantity)) !== names(metadata ?? [])) {
      fields = (metadata ?? []).map(metadataField);
      form.replaceChildren(
          ...fields.map((f) => f.place),
          h('button', {type: 'submit', class: 'main'}, 'Use from the next run on'));
      return;
    }
    fields.forEach((f, i) => {
      f.quantity = metadata[i];
      f.hint.replaceChildren(...prose(rangeText(f.quantity)));
      if (!f.isEdited())
        f.input.value = known(f.quantity.value) ? String(+f.quantity.value.toPrecision(7)) : '';
    });
  });
}
