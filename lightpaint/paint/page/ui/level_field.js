/** A text field for the level of a light, relative to the scene: in stops or percent. */

import { html } from '../vendor/preact.js';
import { luminance } from '../../../viewer/drawing/colour.js';
import { useDraft } from './controls.js';
import { cleanNumberText, stopsText } from './format.js';
import { t } from '../language/language.js';

/** @import { Light, RGB } from './ui_state.js' */

/** Ends of the dimmer, in stops from now; the left one is off. */
export const DIMMER_MIN_STOPS = -8;
export const DIMMER_MAX_STOPS = 6;

/** Return the reference of a level: the current luminance, or one unit for a light that is off.
 * @param {Light} light */
export const presentLevel = (light) => luminance(light.present) || 1;

/** Return whether percentages make sense, since the light is currently on. @param {Light} light */
export const isOnAtPresent = (light) => luminance(light.present) > 0;

/** Return stops from the current level; null for off. @param {RGB} rgb @param {Light} light
 * @returns {number | null} */
export function stopsOf(rgb, light) {
  const level = luminance(rgb);
  return level > 0 ? Math.log2(level / presentLevel(light)) : null;
}

/** Stops from the current level below which the colour of a light is invisible. */
const MIN_VISIBLE_STOPS = -6;

/** Return the same colour at another level. For a nearly dark light, whose solved colour is
 * arbitrary, use its colour from the scene. @param {RGB} rgb @param {Light} light
 * @param {number} level
 * @returns {RGB} */
export function scaleToLevel(rgb, light, level) {
  const isVisible =
    luminance(rgb) > (isOnAtPresent(light) ? presentLevel(light) * 2 ** MIN_VISIBLE_STOPS : 0);
  const base = isVisible ? rgb : isOnAtPresent(light) ? light.present : [1, 1, 1];
  const factor = level / luminance(base);
  return /** @type {RGB} */ (base.map((x) => x * factor));
}

/** Parse typed text: stops (`+1.5`, `-2 st`), percent of the current level (`80 %`), `as now`, `off`. A
 * plain number means stops if it is unambiguous.
 * @param {string} text @param {Light} light @returns {number | null} a level; null for what is none */
function parseLevel(text, light) {
  const typed = cleanNumberText(text).toLowerCase();
  if (typed === 'off') return 0;
  if (/^(as )?now$/.test(typed)) return luminance(light.present);
  const match = /^([+-]?(?:\d+\.?\d*|\.\d+))\s*(%|st|stops?)?$/.exec(typed);
  if (!match) return null;
  const amount = Number(match[1]);
  const maxStops = match[2] ? MAX_TYPED_STOPS : MAX_UNITLESS_STOPS;
  if (match[2] !== '%')
    return Math.abs(amount) <= maxStops ? presentLevel(light) * 2 ** amount : null;
  return isOnAtPresent(light) && amount >= 0 ? (presentLevel(light) * amount) / 100 : null;
}

/** Largest typed change in stops: with the unit, and without it, where 12 or 80 could also mean
 * percent. */
const [MAX_TYPED_STOPS, MAX_UNITLESS_STOPS] = [20, 8];

/** Return why text is not a level, and what would be. @param {string} text @param {Light} light */
function refusalText(text, light) {
  const typed = text.trim();
  if (!isOnAtPresent(light))
    return t('{typed} is not a level. {label} is off now: type stops (+1.5 st) or off.', {
      typed,
      label: light.label,
    });
  if (Number.isFinite(Number(cleanNumberText(typed))))
    return t('{typed} could be stops or percent: add the unit (12 st, 80 %).', { typed });
  return t('{typed} is not a level. Type stops from now (+1.5), percent (80 %), as now, or off.', {
    typed,
  });
}

/** The level beside a dimmer: typed in stops or percent, stepped by the arrow keys.
 * @param {{light: Light, rgb: RGB, disabled: boolean, change: (rgb: RGB) => void,
 *   say: (text: string) => void}} props */
export function LevelField({ light, rgb, disabled, change, say }) {
  const [draft, setDraft, draftRef] = useDraft();
  const stops = stopsOf(rgb, light);
  const take = (/** @type {string | null} */ text) => {
    setDraft(null);
    if (!text?.trim()) return;
    const level = parseLevel(text, light);
    if (level === null) say(refusalText(text, light));
    else change(scaleToLevel(rgb, light, level));
  };
  const press = (/** @type {any} */ event) => {
    const step = { ArrowUp: 0.1, ArrowDown: -0.1 }[/** @type {string} */ (event.key)];
    if (event.key === 'Enter') take(draft);
    if (event.key === 'Escape') setDraft(null);
    if (!step) return;
    event.preventDefault();
    if (stops === null && step < 0) return; // nothing is below off
    const newStops = (stops ?? DIMMER_MIN_STOPS) + step * (event.shiftKey ? 10 : 1);
    take(
      t('{stops} st', {
        stops: Math.min(MAX_TYPED_STOPS, Math.max(-MAX_TYPED_STOPS, Number(newStops.toFixed(1)))),
      }),
    );
  };
  return html`<input class="level" type="text" data-typed=${draft === null ? 'no' : 'yes'} autocomplete="off" spellcheck=${false}
    aria-label=${t('{label}, level', { label: light.label })} data-tip=${t('Stops from now. Type +1.5, 80 % or off.')}
    value=${draft ?? (stops === null ? 'off' : stopsText(stops))} disabled=${disabled}
    onFocus=${(/** @type {any} */ event) => event.currentTarget.select()}
    onInput=${(/** @type {any} */ event) => setDraft(event.currentTarget.value)}
    onBlur=${() => take(draftRef.current)} onKeyDown=${press} />`;
}
