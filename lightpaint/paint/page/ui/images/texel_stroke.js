/** A stroke over the map of an image: it paints, locks or releases the texels that it passes. */

import { endOnEscape } from '../escape_key.js';
import { presentLevel, stopsOf } from '../level_field.js';
import { scaled } from '../lamps/lamp_colours.js';
import { atFullBrightness, luminance } from '../paint_colour.js';
import { useEffect, useRef } from '../../vendor/preact.js';
import { mapStops, wholeLight } from './light_images.js';

/** @typedef {import("../engine_interface.js").RGB} RGB */
/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./image_state.js").LightImage} LightImage */
/** @typedef {[row: number, column: number]} Place */
/** A stroke that goes on. stops: exposure at its start, which would change under the brush. weights:
 * the answer at its start. ignoreKeys: ends its listening to keys.
 * @typedef {{texels: Set<number>, last: Place, stops: number, weights: RGB[],
 *   ignoreKeys: () => void}} TexelStroke */

/** Ends of the brightness of paint, in stops from the mean of the image in the scene. */
export const MIN_STOPS = -8;
export const MAX_STOPS = 12;

/**
 * A stroke of the chosen tool, which becomes a step at its end. Escape cancels it.
 * @param {LightImage} image @param {Ui} ui @param {App} app
 * @param {(place: Place) => void} visit hears of each place that it comes to
 */
export function useTexelStroke(image, ui, app, visit) {
  const stroke = useRef(/** @type {TexelStroke | null} */ (null));
  const [rows, columns] = [image.places.length, image.places[0].length];
  const texelAt = (/** @type {Place} */ [row, column]) => image.places[row][column];
  const apply = (/** @type {boolean} */ isFinal) =>
    applyTool(image, ui, app, [...(stroke.current?.texels ?? [])], isFinal);
  const release = () => {
    stroke.current?.ignoreKeys();
    stroke.current = null;
  };
  const cancel = () => {
    const current = stroke.current;
    release();
    if (current && app.store.value.texelTool === 'paint') app.session.many.cancel(current.weights);
  };
  // The map may go away under the brush, and hears of no end then.
  useEffect(() => cancel, []);
  const begin = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0) return;
    event.preventDefault();
    const start = placeAt(event, rows, columns);
    if (event.altKey) return pick(image, ui, app, texelAt(start));
    const element = /** @type {HTMLElement} */ (event.currentTarget);
    element.setPointerCapture(event.pointerId);
    element.focus({ preventScroll: true });
    const texels = new Set([texelAt(start)].filter((k) => k >= 0));
    const [{ weights }, ignoreKeys] = [ui, endOnEscape(cancel)];
    stroke.current = { texels, last: start, stops: mapStops(image, weights), weights, ignoreKeys };
    visit(start);
    return apply(false);
  };
  const move = (/** @type {Place} */ next) => {
    const current = stroke.current;
    if (!current || String(next) === String(current.last)) return;
    for (const passed of placesBetween(current.last, next))
      if (texelAt(passed) >= 0) current.texels.add(texelAt(passed));
    current.last = next;
    visit(next);
    apply(false);
  };
  const end = () => {
    if (stroke.current) apply(true);
    release();
  };
  return { begin, move, end, stops: () => stroke.current?.stops ?? null };
}

/** Return the nearest of `count` indices. @param {number} index @param {number} count */
export const clamp = (index, count) => Math.min(count - 1, Math.max(0, Math.floor(index)));

/** Return the texel under the pointer. @param {PointerEvent} event @param {number} rows
 * @param {number} columns @returns {Place} */
export function placeAt(event, rows, columns) {
  const box = /** @type {Element} */ (event.currentTarget).getBoundingClientRect();
  return [
    clamp((rows * (event.clientY - box.top)) / box.height, rows),
    clamp((columns * (event.clientX - box.left)) / box.width, columns),
  ];
}

/** Return the places from one to another, without the first. @param {Place} from @param {Place} to
 * @returns {Place[]} */
function placesBetween(from, to) {
  const [rows, columns] = [to[0] - from[0], to[1] - from[1]];
  const count = Math.max(Math.abs(rows), Math.abs(columns));
  return Array.from({ length: count }, (_, i) => [
    Math.round(from[0] + (rows * (i + 1)) / count),
    Math.round(from[1] + (columns * (i + 1)) / count),
  ]);
}

/** Apply the chosen tool to texels. @param {LightImage} image @param {Ui} ui @param {App} app
 * @param {number[]} texels @param {boolean} isFinal false while a stroke goes on */
export function applyTool(image, ui, app, texels, isFinal) {
  const { images, many } = app.session;
  if (!texels.length) return;
  if (ui.texelTool === 'paint') {
    const level = presentLevel(wholeLight(image, ui.lights)) * 2 ** ui.texelStops;
    images.paint(texels, scaled(ui.texelColour, level / luminance(ui.texelColour)), isFinal);
  } else if (isFinal && ui.texelTool === 'lock') many.lock(texels);
  else if (isFinal) void many.unlock(texels);
}

/** Take the light of a texel as paint. @param {LightImage} image @param {Ui} ui @param {App} app
 * @param {number} k */
export function pick(image, ui, app, k) {
  const rgb = ui.weights[k];
  if (!rgb || !(luminance(rgb) > 0)) return;
  const stops = stopsOf(rgb, wholeLight(image, ui.lights)) ?? 0;
  const texelStops = Math.min(MAX_STOPS, Math.max(MIN_STOPS, stops));
  app.store.set({ texelColour: atFullBrightness(rgb), texelStops, texelTool: 'paint' });
}
