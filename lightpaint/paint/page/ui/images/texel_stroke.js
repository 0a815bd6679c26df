/** A stroke over the map of an image: it paints, locks or releases the texels that it passes, draws a
 * gradient, fills a half of a sky, or places a sun. */

import { endOnEscape } from '../lamps/mark_drag.js';
import { presentLevel, stopsOf } from '../level_field.js';
import { atFullBrightness, luminance } from '../../../../viewer/drawing/colour.js';
import { useEffect, useRef } from '../../vendor/preact.js';
import { t } from '../../language/language.js';
import { wholeLight } from './light_images.js';
import { aboveHorizon, skyViewOf } from './sky_marks.js';
import { gradientLights, radianceOf, sunLights, texelsToFill } from './texel_arithmetic.js';

/** @import { App, RGB, Ui } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */
/** @import { MapPoint } from './texel_arithmetic.js' */

/** What a press or a drag on the map of an image does to its texels.
 * @typedef {"paint" | "fill" | "gradient" | "sun" | "lock" | "release"} TexelTool */
/** @typedef {[row: number, column: number]} Place */
/** A stroke that goes on. start, end: where it began and where it is now, between texels. weights: the
 * answer at its start. ignoreKeys: ends its listening to keys.
 * @typedef {{texels: Set<number>, last: Place, start: MapPoint, end: MapPoint, weights: RGB[],
 *   ignoreKeys: () => void}} TexelStroke */

/** Ends of the brightness of paint, in stops from the mean of the image in the scene. */
export const MIN_STOPS = -8;
export const MAX_STOPS = 12;

/** A stroke of the chosen tool, which becomes a step at its end. Escape cancels it.
 * @param {LightImage} image @param {Ui} ui @param {App} app
 * @param {(place: Place) => void} visit hears of each place that it comes to */
export function useTexelStroke(image, ui, app, visit) {
  const stroke = useRef(/** @type {TexelStroke | null} */ (null));
  const [rows, columns] = [image.places.length, image.places[0].length];
  const texelAt = (/** @type {Place} */ [row, column]) => image.places[row][column];
  const apply = (/** @type {boolean} */ isFinal) => {
    const { current } = stroke;
    if (current) applyTool(image, ui, app, { ...current, texels: [...current.texels] }, isFinal);
  };
  const release = () => {
    stroke.current?.ignoreKeys();
    stroke.current = null;
  };
  const cancel = () => {
    const current = stroke.current;
    release();
    if (current && ['paint', 'gradient'].includes(app.store.value.texelTool))
      app.session.many.cancel(current.weights);
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
    const [{ weights }, ignoreKeys, point] = [ui, endOnEscape(cancel), pointAt(event, rows, columns)];
    stroke.current = { texels, last: start, start: point, end: point, weights, ignoreKeys };
    visit(start);
    return apply(false);
  };
  const move = (/** @type {Place} */ next, /** @type {PointerEvent} */ event) => {
    const current = stroke.current;
    if (!current) return;
    current.end = pointAt(event, rows, columns);
    if (app.store.value.texelTool === 'gradient') apply(false);
    if (String(next) === String(current.last)) return;
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
  return { begin, move, end, current: () => stroke.current };
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

/** Return the place under the pointer, also between the middles of texels. @param {PointerEvent} event
 * @param {number} rows @param {number} columns @returns {MapPoint} */
export function pointAt(event, rows, columns) {
  const box = /** @type {Element} */ (event.currentTarget).getBoundingClientRect();
  const within = (/** @type {number} */ share) => Math.min(1, Math.max(0, share));
  return [
    rows * within((event.clientY - box.top) / box.height) - 0.5,
    columns * within((event.clientX - box.left) / box.width) - 0.5,
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

/** Apply the chosen tool. @param {LightImage} image @param {Ui} ui @param {App} app
 * @param {{texels: number[], start: MapPoint, end: MapPoint}} stroke @param {boolean} isFinal false
 * while the stroke goes on */
export function applyTool(image, ui, app, { texels, start, end }, isFinal) {
  const { images, many } = app.session;
  const { texelTool, texelColour, texelStops, secondTexelPaint } = ui;
  const mean = presentLevel(wholeLight(image, ui.lights));
  const paint = { colour: texelColour, stops: texelStops };
  if (texelTool === 'gradient') {
    const paints = /** @type {[typeof paint, typeof paint]} */ ([paint, secondTexelPaint]);
    images.paintEach(gradientLights(image, start, end, paints, mean), t('gradient'), isFinal);
  } else if (texelTool === 'fill') {
    if (!isFinal) return;
    const filled = texelsToFill(image, end, aboveHorizon(skyViewOf(ui, image), image));
    images.paint(filled, radianceOf(paint, mean), true);
  } else if (texelTool === 'sun') {
    if (!isFinal) return;
    const added = sunLights(image, end, ui.sunDiameter, paint, mean);
    const sum = [...added].map(([k, rgb]) => [k, rgb.map((value, c) => value + ui.weights[k][c])]);
    images.paintEach(new Map(/** @type {[number, RGB][]} */ (sum)), t('sun'), true);
  } else if (!texels.length) return;
  else if (texelTool === 'paint') images.paint(texels, radianceOf(paint, mean), isFinal);
  else if (isFinal && texelTool === 'lock') many.lock(texels);
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
