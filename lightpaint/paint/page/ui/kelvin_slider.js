/** A slider for colour temperature, in mireds, so that equal steps look equal; warm is right. */

import { html } from '../vendor/preact.js';
import { fromKelvin, toHex } from './paint_colour.js';
import { Slider } from './controls.js';
import { t } from '../language/language.js';

/** @typedef {import("./engine_interface.js").RGB} RGB */

/** Ends of the slider. */
const [MIN_KELVIN, MAX_KELVIN] = [1500, 15000];

const MIRED_CURVE = {
  toPosition: (/** @type {number} */ k) => 1e6 / k,
  toValue: (/** @type {number} */ x) => Math.round(1e6 / x / 50) * 50,
};

/** Return the CSS gradient of the track. @param {RGB[]} colours */
export const gradient = (colours) => `linear-gradient(to right, ${colours.map(toHex).join(', ')})`;

const TRACK = gradient(
  Array.from({ length: 12 }, (_, i) => {
    const [low, high] = [MIRED_CURVE.toPosition(MAX_KELVIN), MIRED_CURVE.toPosition(MIN_KELVIN)];
    return fromKelvin(MIRED_CURVE.toValue(low + (i / 11) * (high - low)));
  }),
);

/** @param {number} kelvin */
export const clampKelvin = (kelvin) => Math.min(MAX_KELVIN, Math.max(MIN_KELVIN, kelvin));

/** @param {{value: number, change: (kelvin: number, isFinal: boolean) => void, label?: string,
 *   disabled?: boolean}} props */
export function KelvinSlider({ value, change, label = t('CCT'), disabled }) {
  return html`<${Slider} label=${label} value=${clampKelvin(value)} min=${MIN_KELVIN}
    max=${MAX_KELVIN} step=${100} unit=${t('K')} curve=${MIRED_CURVE} track=${TRACK} disabled=${disabled}
    tip=${t('Correlated colour temperature: warmer to the right')} change=${change} />`;
}
