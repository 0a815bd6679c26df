/** Names of layers, made from what they do: "Knot, +1.2 stops, warmer"; "3 strokes, brighter". */
import { luminance } from '../../../../viewer/drawing/colour.js';
import { plural, t } from '../../language/language.js';

/** @import { Layer } from '../messages.js' */

/** Smallest change that a name mentions: in stops, and of red over blue in stops. */
const [LEAST_STOPS, LEAST_WARMTH] = [0.05, 0.02];

/** Smallest change of painted layers that a name mentions, in stops. */
const LEAST_SEEN = 0.15;

/** Return what an adjustment does: "+1.2 stops, warmer". @param {Pick<Layer, "gain" | "tint">} layer */
function adjustmentText({ gain, tint }) {
  const stops = Math.log2(gain);
  const warmth = Math.log2(tint[0] / tint[2]);
  const parts = [];
  if (Math.abs(stops) >= LEAST_STOPS) parts.push(stopsText(stops));
  if (Math.abs(warmth) >= LEAST_WARMTH) parts.push(warmth > 0 ? t('warmer') : t('cooler'));
  return parts.join(', ') || t('unchanged');
}

/** @param {number} stops */
function stopsText(stops) {
  const size = Math.abs(stops).toFixed(1);
  const signed = `${stops < 0 ? '−' : '+'}${size}`;
  return plural(Number(size), { one: '{signed} stop', other: '{signed} stops' }, { signed });
}

/** Return the name of an adjustment. @param {string} area @param {Layer} layer */
export const adjustmentName = (area, layer) => `${area}, ${adjustmentText(layer)}`;

/** Return the name of a layer with other properties: a name that was made follows them, one that
 * somebody typed stays. @param {Layer} before @param {Layer} after @returns {string} */
export function renamed(before, after) {
  const made = `, ${adjustmentText(before)}`;
  if (before.kind === 'weigh' && before.name === importanceName(before.times))
    return importanceName(after.times);
  const isAdjustment = before.kind === 'adjust' || before.kind === 'gradient';
  if (!isAdjustment || !before.name.endsWith(made)) return after.name;
  return adjustmentName(before.name.slice(0, -made.length), after);
}

/** @param {number} times */
export const importanceName = (times) =>
  t('Importance ×{value}', { value: Number(times.toPrecision(2)) });

/** @param {number} count */
const strokeCountText = (count) =>
  plural(count, { one: '{count} stroke', other: '{count} strokes' });

/** The number of strokes in a made name. */
const COUNTED = /\d+/;

/** Return the name of a painted layer after another stroke; a typed name stays.
 * @param {string} name before @param {string} effect @param {boolean} isNew */
export function strokesName(name, effect, isNew) {
  const before = Number(COUNTED.exec(name)?.[0] ?? NaN);
  if (!isNew && !name.startsWith(strokeCountText(before))) return name;
  return [strokeCountText(isNew ? 1 : before + 1), effect].filter(Boolean).join(', ');
}

/** Return what becomes of light, in words. @param {number[]} before mean RGB
 * @param {number[]} after @returns {string} */
export function effectText(before, after) {
  const [level, now] = [luminance(before), luminance(after)];
  if (!(level > 0) || !(now > 0)) {
    return now > level ? t('brighter') : level > 0 ? t('dark') : '';
  }
  const stops = Math.log2(now / level);
  const warmth = Math.log2((after[0] * before[2]) / (before[0] * after[2]));
  const parts = [];
  if (Math.abs(stops) >= LEAST_SEEN) parts.push(stops > 0 ? t('brighter') : t('darker'));
  if (Math.abs(warmth) >= LEAST_SEEN) parts.push(warmth > 0 ? t('warmer') : t('cooler'));
  return parts.join(', ');
}

/** Return the name of an object as a name begins: `marble_knot` as "Marble knot".
 * @param {string | null | undefined} name */
export function areaName(name) {
  const text = (name ?? '').replace(/[_]+/g, ' ').trim();
  return text ? text[0].toUpperCase() + text.slice(1, 48) : '';
}
