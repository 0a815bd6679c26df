/** A list of colour filters, found by number or name. */

import { gelsNamed } from '../../../../viewer/gels/gel_list.js';
import { filtered, gelName, lossInStops } from '../../../../viewer/gels/gels.js';
import { useId } from '../controls.js';
import { signedText } from '../format.js';
import { atFullBrightness, toHex } from '../paint_colour.js';
import { html, useState } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** @typedef {import("../../../../viewer/gels/gels.js").Gel} Gel */
/** @typedef {import("../engine_interface.js").RGB} RGB */

/** @param {{white: RGB, gel: Gel | null, choose: (gel: Gel | null) => void}} props white: of the lamp,
 * without a filter */
export function GelPicker({ white, gel, choose }) {
  const [text, setText] = useState('');
  const gels = gelsNamed(text);
  const id = useId();
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === 'Enter' && gels.length) choose(gels[0]);
    if (event.key === 'Escape') setText('');
    if (event.key !== 'ArrowDown') return;
    event.preventDefault();
    const field = /** @type {HTMLElement} */ (event.currentTarget);
    /** @type {HTMLElement | null | undefined} */ (
      field.closest('.gels')?.querySelector('select')
    )?.focus();
  };
  const label = (/** @type {Gel} */ one) =>
    t('{gel} {name}, {signed} st', {
      gel: gelName(one),
      name: one.name,
      signed: signedText(-lossInStops(one, white)),
    });
  return html`<div class="gels">
    <label class="field words"><span class="name" id=${id}>${t('Filter')}</span>
      <input type="text" value=${text} placeholder=${t('201, R80, amber')} spellcheck=${false} autocomplete="off"
        data-typed=${text ? 'yes' : 'no'} data-tip=${t('Number or name; Enter takes the first of the list')}
        onInput=${(/** @type {any} */ event) => setText(event.currentTarget.value)}
        onKeyDown=${press} /></label>
    <select size="6" value=${gel?.code ?? ''} aria-label=${t('Filters')} data-tip=${t('Stops that each costs on this lamp')}
      onChange=${(/** @type {any} */ event) =>
        choose(gels.find(({ code }) => code === event.currentTarget.value) ?? null)}>
      ${!text && html`<option value="">${t('No filter')}</option>`}
      ${gels.map(
        (one) => html`<option key=${one.code} value=${one.code}
          style=${{ '--gel': toHex(atFullBrightness(filtered(one, white))) }}>${label(one)}</option>`,
      )}
    </select>
    ${!gels.length && html`<p class="faint">${t('No filter has this number or name.')}</p>`}
  </div>`;
}
