/** What the pictures show: the chosen display with temporary changes, and the light of the paint. */

import { comparedDisplay } from './look_comparison.js';
import { withOriginal } from './held_pictures.js';

/** @import { DrawnDisplay, Light, RGB, Ui } from './ui_state.js' */

/** Return what is drawn: the chosen display with temporary changes.
 * @param {Ui} ui @returns {DrawnDisplay} */
export function effectiveDisplay(ui) {
  const overlay = overlayOf(ui);
  /** @type {DrawnDisplay} */
  const display = { ...ui.display, overlay: overlay === 'lux' ? null : overlay, master: ui.master };
  const hasSolo = ui.solo.length > 0;
  if (hasSolo || ui.mute.length) {
    display.visibleLights = ui.lights.map((_, k) =>
      hasSolo ? ui.solo.includes(k) : !ui.mute.includes(k),
    );
  }
  Object.assign(display, comparedDisplay(ui));
  if (ui.previousWeights && !ui.mix) {
    display.solutionWeights = ui.previousWeights;
    if (display.left !== 'solution') display.right = 'solution';
  }
  if (ui.isOriginalHeld) return withOriginal(display);
  const k = ui.hoveredLight;
  if (k !== null) {
    const gain = gainOf(ui, k);
    const colour = soloColour(ui.weights[k], ui.lights[k]).map((x) => x * gain);
    const rgb = /** @type {RGB} */ (colour);
    display.otherWeights = ui.weights.map((_, i) => (i === k ? rgb : [0, 0, 0]));
    display.right = 'other';
    display.visibleLights = null;
  }
  return display;
}

/** Return the overlay. The importance brush shows the importance by default. Lux need planes in the
 * view. @param {Ui} ui */
export function overlayOf({ display, tool, planes, view }) {
  const overlay = display.overlay === 'lux' && !planes?.cameras[view] ? null : display.overlay;
  return overlay ?? (tool === 'weight' ? 'importance' : null);
}

/** Return the extra exposure of a light shown alone, in whole stops, so that one of many is
 * visible.
 * @param {Ui} ui @param {number} k @returns {number} */
export function gainOf(ui, k) {
  const share = ui.lightAnswers[k]?.share ?? 1;
  return share > 0 ? 2 ** Math.min(10, Math.max(0, Math.round(Math.log2(0.5 / share)))) : 1;
}

/** A light that is off is shown as in the scene, or else at one unit. @param {RGB} rgb
 * @param {Light} light @returns {RGB} */
function soloColour(rgb, light) {
  if (Math.max(...rgb) > 0) return rgb;
  return Math.max(...light.present) > 0 ? light.present : [1, 1, 1];
}

/** Return the linear light of the current paint. At 0 stops it is as bright as white at the scene's
 * own exposure. @param {Ui} ui @returns {RGB} */
export function paintOf({ colour, stops, state }) {
  return /** @type {RGB} */ (colour.map((x) => x * 2 ** (stops - exposureOf(state))));
}

/** Return the exposure at which the scene is painted, in stops. @param {any} state
 * @returns {number} */
export function exposureOf(state) {
  return state?.transform?.stops ?? 0;
}
