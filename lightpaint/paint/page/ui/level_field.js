/** A text field for the level of a light, relative to the scene: in stops or percent. */

import { html } from '../vendor/preact.js';
import { luminance } from './paint_colour.js';
import { useTyped } from './controls.js';
import { asTyped, stopsText } from './format.js';

/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").Light} Light */

/** Ends of the dimmer, in stops from now; the left one is off. */
export const DARKEST = -8;
export const BRIGHTEST = 6;

/** Return the reference of a level: the current luminance, or one unit for a light that is off.
 * @param {Light} light */
export const nowOf = (light) => luminance(light.present) || 1;

/** Return whether percentages make sense, since the light is currently on. @param {Light} light */
export const isOnNow = (light) => luminance(light.present) > 0;

/** Return stops from the current level; null for off. @param {RGB} rgb @param {Light} light
 * @returns {number | null} */
export function stopsOf(rgb, light) {
  const level = luminance(rgb);
  return level > 0 ? Math.log2(level / nowOf(light)) : null;
}

/** Stops from the current level below which the colour of a light is invisible. */
const UNSEEN = -6;

/** Return the same colour at another level. For a nearly dark light, whose solved colour is
 * arbitrary, use its colour from the scene. @param {RGB} rgb @param {Light} light
 * @param {number} level
 * @returns {RGB} */
export function atLevel(rgb, light, level) {
  const isSeen = luminance(rgb) > (isOnNow(light) ? nowOf(light) * 2 ** UNSEEN : 0);
  const base = isSeen ? rgb : isOnNow(light) ? light.present : [1, 1, 1];
  const factor = level / luminance(base);
  return /** @type {RGB} */ (base.map((x) => x * factor));
}

/** Parse typed text: stops (`+1.5`, `-2 st`), percent of the current level (`80 %`), `as now`, `off`. A
 * plain number means stops if it is unambiguous.
 * @param {string} text @param {Light} light @returns {number | null} a level; null for what is none */
function levelOf(text, light) {
  const plain = asTyped(text).toLowerCase();
  if (plain === 'off') return 0;
  if (/^(as )?now$/.test(plain)) return luminance(light.present);
  const found = /^([+-]?(?:\d+\.?\d*|\.\d+))\s*(%|st|stops?)?$/.exec(plain);
  if (!found) return null;
  const amount = Number(found[1]);
  const most = found[2] ? MOST : MOST_ALONE;
  if (found[2] !== '%') return Math.abs(amount) <= most ? nowOf(light) * 2 ** amount : null;
  return isOnNow(light) && amount >= 0 ? (nowOf(light) * amount) / 100 : null;
}

/** Largest typed change in stops: with the unit, and without it, where 12 or 80 could also mean
 * percent. */
const [MOST, MOST_ALONE] = [20, 8];

/** Return why text is not a level, and what would be. @param {string} text @param {Light} light */
function refused(text, light) {
  const plain = text.trim();
  if (!isOnNow(light))
    return `${plain} is not a level. ${light.label} is off now: type stops (+1.5 st) or off.`;
  if (Number.isFinite(Number(asTyped(plain))))
    return `${plain} could be stops or percent: add the unit (12 st, 80 %).`;
  return `${plain} is not a level. Type stops from now (+1.5), percent (80 %), as now, or off.`;
}

/**
 * The level beside a dimmer: typed in stops or percent, stepped by the arrow keys.
 * @param {{light: Light, rgb: RGB, disabled: boolean, change: (rgb: RGB) => void,
 *   say: (text: string) => void}} props
 */
export function Level({ light, rgb, disabled, change, say }) {
  const [typed, setTyped, now] = useTyped();
  const stops = stopsOf(rgb, light);
  const take = (/** @type {string | null} */ text) => {
    setTyped(null);
    if (!text?.trim()) return;
    const level = levelOf(text, light);
    if (level === null) say(refused(text, light));
    else change(atLevel(rgb, light, level));
  };
  const press = (/** @type {any} */ event) => {
    const way = { ArrowUp: 0.1, ArrowDown: -0.1 }[/** @type {string} */ (event.key)];
    if (event.key === 'Enter') take(typed);
    if (event.key === 'Escape') setTyped(null);
    if (!way) return;
    event.preventDefault();
    if (stops === null && way < 0) return; // nothing is below off
    const to = (stops ?? DARKEST) + way * (event.shiftKey ? 10 : 1);
    take(`${Math.min(MOST, Math.max(-MOST, Number(to.toFixed(1))))} st`);
  };
  return html`<input class="level" type="text" data-typed=${typed === null ? 'no' : 'yes'} autocomplete="off" spellcheck=${false}
    aria-label=${`${light.label}, level`} data-tip="Stops from now. Type +1.5, 80 % or off."
    value=${typed ?? (stops === null ? 'off' : stopsText(stops))} disabled=${disabled}
    onFocus=${(/** @type {any} */ event) => event.currentTarget.select()}
    onInput=${(/** @type {any} */ event) => setTyped(event.currentTarget.value)}
    onBlur=${() => take(now.current)} onKeyDown=${press} />`;
}
