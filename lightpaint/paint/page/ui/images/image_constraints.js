/** Controls for the constraints that hold for all texels of an image. */

import { html } from '../../vendor/preact.js';
import { isHeld } from '../lamps/many_lights.js';
import { LevelAndColour } from '../light_constraints.js';
import { findTie } from '../tied_lights.js';
import { t } from '../../language/language.js';
import { meanOf, wholeLight } from './light_images.js';

/** @typedef {import("../ui_state.js").Constraints} Constraints */
/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./image_state.js").LightImage} LightImage */

/** Nothing where all texels are locked or off, as for a single light.
 * @param {{image: LightImage, ui: Ui, app: App}} props */
export function ImageConstraints({ image, ui, app }) {
  const { images } = app.session;
  const free = image.lights.filter((k) => !isHeld(ui, k) && !ui.lights[k].is_fixed);
  if (!free.length) return null;
  const light = wholeLight(image, ui.lights);
  const rgb = meanOf(image, (k) => ui.weights[k] ?? ui.lights[k].present);
  const constraints = sharedBy(free.map((k) => app.session.openConstraints(k)));
  return html`<div class="asking-light" role="group" aria-label=${t('Constraints on {label}', { label: image.name })}>
    <h3>${t('Constraints on each texel')}</h3>
    <${LevelAndColour} light=${light} rgb=${rgb} constraints=${constraints} isImage app=${app}
      isTied=${image.lights.some((k) => findTie(ui, k))}
      set=${(/** @type {Constraints} */ limited) => images.constrain(image, changeOf(constraints, limited))} />
  </div>`;
}

/** Return the constraints that all have. @param {Constraints[]} all @returns {Constraints} */
function sharedBy(all) {
  const [first, ...others] = all;
  const entries = Object.entries(first).filter(([key, value]) =>
    others.every((other) => isEqual(other[/** @type {keyof Constraints} */ (key)], value)),
  );
  return Object.fromEntries(entries);
}

/** What of the constraints is replaced together, since a light has one kind of colour. */
const PARTS = /** @type {(keyof Constraints)[][]} */ ([
  ['limits'],
  ['color', 'kelvin', 'duv', 'primaries'],
]);

/** Return the parts that differ after a change, with undefined for what is gone.
 * @param {Constraints} before @param {Constraints} after @returns {Constraints} */
function changeOf(before, after) {
  const changed = PARTS.filter((keys) => keys.some((key) => !isEqual(before[key], after[key])));
  return Object.fromEntries(changed.flat().map((key) => [key, after[key]]));
}

/** @param {unknown} a @param {unknown} b */
const isEqual = (a, b) => JSON.stringify(a) === JSON.stringify(b);
