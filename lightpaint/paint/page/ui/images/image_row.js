/** A row of the light list for a light that is an image: its map, solo, mute, lock and brightness. */

import { html } from '../../vendor/preact.js';
import { Button } from '../controls.js';
import { numberText, whiteText } from '../format.js';
import { Icon } from '../icons.js';
import { DIMMER_MIN_STOPS, presentLevel } from '../level_field.js';
import { Dimmer, DisplayButtons, LightValue, LockButton, Pick, Share } from '../row_parts.js';
import { isSelecting, toggleLights } from '../lamps/light_selection.js';
import { atFullBrightness, luminance, toHex, toKelvin } from '../../../../viewer/drawing/colour.js';
import { plural, t } from '../../language/language.js';
import { heldTexels } from './image_actions.js';
import { ImageMap } from './image_map.js';
import { exposureOf, meanOf, wholeLight } from './light_images.js';
import { TexelMap } from './texel_map.js';
import { isHeld } from '../lamps/many_lights.js';
import { LevelAndColour } from '../light_constraints.js';
import { findTie } from '../tied_lights.js';

/** @import { App, Constraints, RGB, Ui } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */

/** Key of an image among what is unfolded. @param {LightImage} image */
const imageKey = ({ name }) => `image ${name}`;

/** @param {{image: LightImage, ui: Ui, app: App}} props */
export function ImageRow({ image, ui, app }) {
  const { store } = app;
  const { name, lights } = image;
  const isOpen = ui.open[imageKey(image)] ?? false;
  const isSelected = lights.every((k) => ui.selectedLights.includes(k));
  const isMute = lights.every((k) => ui.mute.includes(k));
  const share = sum(lights, (k) => ui.lightAnswers[k]?.share ?? 0);
  const pointerShare = ui.probe ? sum(lights, (k) => ui.probe?.shares[k] ?? 0) : undefined;
  const held = heldTexels(ui, image);
  const press = (/** @type {MouseEvent} */ event) =>
    isSelecting(event)
      ? toggleLights(store, lights)
      : store.set({ open: { ...ui.open, [imageKey(image)]: !isOpen } });
  const size = `${image.places[0].length}x${image.places.length}`;
  const heldText = plural(held.length, {
    one: '{count} texel is locked.',
    other: '{count} texels are locked.',
  });
  return html`<div class=${`light is-image ${isMute ? 'is-dim' : ''} ${isOpen ? 'is-open' : ''} ${isSelected ? 'is-selected' : ''}`}
      role="group" aria-label=${name} data-light=${name}>
    <div class="light-thumb">
      <${ImageMap} image=${image} weights=${ui.weights} stops=${exposureOf(ui, image)} />
      <${Share} share=${share} pointerShare=${pointerShare} />
      ${held.length > 0 && html`<span class="badge" data-tip=${heldText}>${t('{count} locked', { count: held.length })}</span>`}
      <${Pick} label=${name} isSelected=${isSelected} select=${() => toggleLights(store, lights)} />
    </div>
    <div class="light-main">
      <div class="light-head">
        <button type="button" class="light-name" aria-expanded=${String(isOpen)} aria-label=${name}
          onClick=${press} data-tip=${t('{name}, an image of {size} texels', { name, size })}>
          <${Icon} name="fold" /><span class="its-name"><span>${name}</span></span></button>
        <${Buttons} image=${image} ui=${ui} app=${app} held=${held} />
      </div>
      <${Numbers} image=${image} ui=${ui} />
      <${Brightness} image=${image} ui=${ui} app=${app} isHeld=${held.length === lights.length} />
    </div>
    ${isOpen && html`<${TexelMap} image=${image} ui=${ui} app=${app} held=${held} />`}
    ${isOpen && html`<${ImageConstraints} image=${image} ui=${ui} app=${app} />`}
  </div>`;
}

/** @param {number[]} lights @param {(light: number) => number} value */
const sum = (lights, value) => lights.reduce((total, k) => total + value(k), 0);

/** Buttons for the display; then, apart, those for the solve.
 * @param {{image: LightImage, ui: Ui, app: App, held: number[]}} props */
function Buttons({ image, ui, app, held }) {
  const { name: label, lights } = image;
  const { store, session } = app;
  const areIn = (/** @type {"solo" | "mute"} */ key) => lights.every((k) => ui[key].includes(k));
  const toggle = (/** @type {"solo" | "mute"} */ key) => {
    const others = ui[key].filter((k) => !lights.includes(k));
    store.set({ [key]: areIn(key) ? others : [...others, ...lights] });
  };
  const isLocked = held.length === lights.length;
  const lock = () => void (isLocked ? session.many.unlock(lights) : session.many.lock(lights));
  return html`<${DisplayButtons} label=${label} isSolo=${areIn('solo')} isMute=${areIn('mute')} toggle=${toggle} />
    <span class="marks is-solve" role="group" aria-label=${t('Solve')}>
      <${Button} icon="undo" disabled=${!held.length} act=${() => session.images.reset(image)}
        tip=${t('Reset {label}: the solve sets all texels again', { label })} />
      <${LockButton} label=${label} isLocked=${isLocked} lock=${lock} />
    </span>`;
}

/** The mean of an image. @param {{image: LightImage, ui: Ui}} props */
function Numbers({ image, ui }) {
  const rgb = meanOf(image, (k) => ui.weights[k] ?? ui.lights[k].present);
  const level = luminance(rgb);
  const match = toKelvin(rgb);
  const white = match && whiteText(match.kelvin, match.green);
  const value = [white, numberText(level)].filter(Boolean).join(' · ');
  const { unit } = ui.lights[image.lights[0]];
  return html`<div class="light-numbers">
    <${LightValue} level=${level} swatch=${toHex(atFullBrightness(rgb))} value=${value}
      tip=${t('{value} {unit}, mean of the image', { value, unit })} />
  </div>`;
}

/** @param {{image: LightImage, ui: Ui, app: App, isHeld: boolean}} props */
function Brightness({ image, ui, app, isHeld }) {
  const { images } = app.session;
  const light = wholeLight(image, ui.lights);
  const rgb = meanOf(image, (k) => ui.weights[k] ?? ui.lights[k].present);
  const scale = (/** @type {number} */ stops, /** @type {boolean} */ isFinal) =>
    images.scale(image, stops <= DIMMER_MIN_STOPS ? 0 : presentLevel(light) * 2 ** stops, isFinal);
  return html`<${Dimmer} light=${light} rgb=${rgb} label=${image.name} app=${app} scale=${scale} isHeld=${isHeld}
    change=${(/** @type {RGB} */ newRgb) => images.scale(image, luminance(newRgb), true)} />`;
}

/** Nothing where all texels are locked or off, as for a single light.
 * @param {{image: LightImage, ui: Ui, app: App}} props */
function ImageConstraints({ image, ui, app }) {
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
