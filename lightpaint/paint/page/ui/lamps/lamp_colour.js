/** The colour of lamps that are held: white, HSV, RGB, hex, or a filter. */

import { gelOn, gelsNamed } from '../../../../viewer/gels/gel_list.js';
import { gelName, lossInStops, filtered } from '../../../../viewer/gels/gels.js';
import { ColourMixer, MIXERS } from '../colour_mixers.js';
import { useId } from '../controls.js';
import { signedText } from '../format.js';
import { atFullBrightness, luminance, toHex } from '../../../../viewer/drawing/colour.js';
import { html, useState } from '../../vendor/preact.js';
import { ownWhite } from './lamp_colours.js';
import { t } from '../../language/language.js';

/** @import { App, RGB, Ui } from '../ui_state.js' */
/** @import { Gel } from '../../../../viewer/gels/gels.js' */

const LAMP_MIXERS = [
  ...MIXERS,
  { value: 'gel', label: t('Gel'), tip: t('Colour filters by number') },
];

/** Controls for the colour of some lamps, which keep their levels; they begin at the first one's.
 * @param {{ui: Ui, app: App, lights: number[]}} props */
export function LampColour({ ui, app, lights }) {
  const { lampMixer: mixer } = ui;
  const [first] = lights;
  const light = ui.lights[first];
  const rgb = ui.weights[first];
  const white = ownWhite(light);
  const gel = gelOn(rgb, white, ui.gelCodes[light.name]);
  const colour = atFullBrightness(luminance(rgb) > 0 ? rgb : white);
  const { many } = app.session;
  const set = (/** @type {RGB} */ newColour, /** @type {boolean} */ isFinal) => {
    if (Math.max(...newColour) > 0) many.colour(lights, newColour, isFinal);
  };
  return html`<div class="lamp-colour colour" role="group" aria-label=${t('Colour')}>
    <${ColourMixer} colour=${colour} set=${set} mixer=${mixer} choices=${LAMP_MIXERS} isLamp
      choose=${(/** @type {Ui["lampMixer"]} */ lampMixer) => app.store.set({ lampMixer })} />
    ${
      mixer === 'gel' &&
      html`<${GelPicker} white=${white} gel=${gel}
        choose=${(/** @type {any} */ newGel) => many.gel(lights, newGel)} />`
    }
    ${
      gel &&
      html`<p class="faint" role="status">${t('{gel} {name}, {signed} st', {
        gel: gelName(gel),
        name: gel.name,
        signed: signedText(-lossInStops(gel, white)),
      })}</p>`
    }
  </div>`;
}

/** @param {{white: RGB, gel: Gel | null, choose: (gel: Gel | null) => void}} props white: of the lamp,
 * without a filter */
function GelPicker({ white, gel, choose }) {
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
