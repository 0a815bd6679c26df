/** The colour of lamps that are held: white, HSV, RGB, hex, or a filter. */

import { gelOn } from '../../../../viewer/gels/gel_list.js';
import { gelName, lossInStops } from '../../../../viewer/gels/gels.js';
import { Hex, Hsv, MIXERS, Rgb, White } from '../colour_mixers.js';
import { Choice } from '../controls.js';
import { signedText } from '../format.js';
import { atFullBrightness, luminance } from '../paint_colour.js';
import { html } from '../../vendor/preact.js';
import { GelPicker } from './gel_picker.js';
import { ownWhite } from './lamp_colours.js';
import { t } from '../../language/language.js';

/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../engine_interface.js").RGB} RGB */

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
    <div class="colour-row">
      <${Hex} colour=${colour} set=${set} />
      <${Choice} label=${t('Colour model')} value=${mixer} choices=${LAMP_MIXERS}
        change=${(/** @type {Ui["lampMixer"]} */ lampMixer) => app.store.set({ lampMixer })} />
    </div>
    ${mixer === 'white' && html`<${White} colour=${colour} set=${set} isPure />`}
    ${mixer === 'hsv' && html`<${Hsv} colour=${colour} set=${set} hasValue=${false} />`}
    ${mixer === 'rgb' && html`<${Rgb} colour=${colour} set=${set} />`}
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
