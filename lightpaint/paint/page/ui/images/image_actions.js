/** What a person does to a light that is an image: each is one step of undo, and one solve. */

import { signedText } from '../format.js';
import { presentLevel } from '../level_field.js';
import { luminance } from '../../../../viewer/drawing/colour.js';
import { findTie } from '../tied_lights.js';
import { adjustableLights, isHeld } from '../lamps/many_lights.js';
import { scaled } from '../lamps/lamp_colours.js';
import { lightsText } from '../lamps/light_selection.js';
import { t } from '../../language/language.js';
import { meanOf, wholeLight } from './light_images.js';

/** @import { Constraints, RGB, SessionController, Ui } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */

export class ImageActions {
  /** @param {SessionController} session */
  constructor(session) {
    this.session = session;
    /** The answer when a slider began to move, so that the image survives being off.
     * @type {RGB[] | null} */
    this.startWeights = null;
  }

  /** Bring the mean of an image to a level: all its texels keep their ratio.
   * @param {LightImage} image @param {number} level luminance @param {boolean} isFinal */
  scale(image, level, isFinal) {
    const ui = this.session.store.value;
    const start = (this.startWeights ??= ui.weights);
    if (isFinal) this.startWeights = null;
    const isLit = (/** @type {(k: number) => RGB} */ radiance) => luminance(meanOf(image, radiance)) > 0;
    // An image that is off gets its colours from the scene; one that is off there is white.
    const radiance = [
      (/** @type {number} */ k) => start[k],
      (/** @type {number} */ k) => ui.lights[k].present,
      () => /** @type {RGB} */ ([1, 1, 1]),
    ].find(isLit);
    if (!radiance) return;
    const factor = level / luminance(meanOf(image, radiance));
    const stops = Math.log2(level / presentLevel(wholeLight(image, ui.lights)));
    const label = level > 0 ? t('{signed} st', { signed: signedText(stops) }) : t('off');
    const changes = new Map(image.lights.map((k) => [k, scaled(radiance(k), factor)]));
    this.set(changes, `${image.name}, ${label}`, isFinal);
  }

  /** Give texels a radiance. @param {number[]} texels @param {RGB} rgb @param {boolean} isFinal */
  paint(texels, rgb, isFinal) {
    const ui = this.session.store.value;
    const free = texels.filter((k) => !findTie(ui, k));
    if (!free.length) {
      if (isFinal) this.session.toast(t('Tied texels keep their colours: untie them first.'));
      return;
    }
    const changes = new Map(free.map((k) => [k, rgb]));
    const label = t('{texels}, painted', { texels: lightsText(ui, free) });
    this.set(changes, label, isFinal);
  }

  /** Give each of some texels a radiance. @param {Map<number, RGB>} radiances
   * @param {string} label what that is @param {boolean} isFinal */
  paintEach(radiances, label, isFinal) {
    const ui = this.session.store.value;
    const changes = new Map([...radiances].filter(([k]) => !findTie(ui, k)));
    if (changes.size)
      this.set(changes, `${lightsText(ui, [...changes.keys()])}, ${label}`, isFinal);
    else if (isFinal) this.session.toast(t('Tied texels keep their colours: untie them first.'));
  }

  /** Change constraints on all texels of an image, and keep the others of each.
   * @param {LightImage} image @param {Constraints} change undefined for what is gone */
  constrain(image, change) {
    const { many, unlockedConstraints } = this.session;
    const ui = this.session.store.value;
    /** @type {Record<string, Constraints>} */
    const constraints = {};
    /** @type {Record<string, Constraints>} */
    const earlier = {};
    for (const k of adjustableLights(ui, image.lights)) {
      const all = Object.entries({ ...this.session.openConstraints(k), ...change });
      const changed = Object.fromEntries(all.filter(([, value]) => value !== undefined));
      // A texel that is locked or off gets them once it is released.
      if (isHeld(ui, k)) {
        unlockedConstraints.set(k, changed);
        earlier[ui.lights[k].name] = changed;
      } else constraints[ui.lights[k].name] = changed;
    }
    const label = t('{name}, constraints', { name: image.name });
    if (Object.keys(constraints).length) void many.constrain(constraints, label, true, earlier);
  }

  /** Let the solve set all texels of an image again. @param {LightImage} image */
  reset(image) {
    void this.session.many.unlock(heldTexels(this.session.store.value, image));
  }

  /** Set texels by hand and lock them there. @param {Map<number, RGB>} changes
   * @param {string} label @param {boolean} isFinal */
  set(changes, label, isFinal) {
    const moves = new Map([...this.session.groupMoves, ...changes]);
    this.session.many.queue({ lights: changes, label, isFinal }, moves);
  }
}

/** Return the texels of an image that are locked or off. @param {Ui} ui @param {LightImage} image */
export const heldTexels = (ui, image) => image.lights.filter((k) => isHeld(ui, k));
