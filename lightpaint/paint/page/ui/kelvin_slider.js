/** A slider for colour temperature, in mireds, so that equal steps look equal; warm is right. */

import { html } from '../vendor/preact.js';
import { ofKelvin, toHex } from './paint_colour.js';
import { Slider } from './controls.js';

/** @typedef {import("./engine_interface.js").RGB} RGB */

/** Ends of the slider. */
const [WARMEST, COOLEST] = [1500, 15000];

const MIRED = {
  to: (/** @type {number} */ k) => 1e6 / k,
  of: (/** @type {number} */ t) => Math.round(1e6 / t / 50) * 50,
};

/** Return the CSS gradient of the track. @param {RGB[]} colours */
export const gradient = (colours) => `linear-gradient(to right, ${colours.map(toHex).join(', ')})`;

const TRACK = gradient(
  Array.from({ length: 12 }, (_, i) => {
    const [low, high] = [MIRED.to(COOLEST), MIRED.to(WARMEST)];
    return ofKelvin(MIRED.of(low + (i / 11) * (high - low)));
  }),
);

/** @param {number} kelvin */
export const withinKelvin = (kelvin) => Math.min(COOLEST, Math.max(WARMEST, kelvin));

/** @param {{value: number, change: (kelvin: number, done: boolean) => void, label?: string,
 *   disabled?: boolean}} props */
export function KelvinSlider({ value, change, label = 'CCT', disabled }) {
  return html`<${Slider} label=${label} value=${withinKelvin(value)} least=${WARMEST}
    most=${COOLEST} step=${100} unit="K" curve=${MIRED} track=${TRACK} disabled=${disabled}
    tip="Correlated colour temperature: warmer to the right" change=${change} />`;
}
