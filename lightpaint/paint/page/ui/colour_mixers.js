/** The controls of one colour: white, HSV with a wheel, RGB and hex. */

import { html, useState } from '../vendor/preact.js';
import {
  encode,
  decode,
  fromHex,
  fromHsv,
  fromKelvin,
  toHex,
  toHsv,
  toKelvin,
} from './paint_colour.js';
import { ColourWheel } from './colour_wheel.js';
import { Slider, TextField } from './controls.js';
import { KelvinSlider, gradient, clampKelvin } from './kelvin_slider.js';
import { t } from '../language/language.js';

/** @typedef {import("./ui_state.js").RGB} RGB */
/** isFinal: false while a slider moves. @typedef {(colour: RGB, isFinal: boolean) => void} SetColour */

/** Choices of these controls. */
export const MIXERS = [
  { value: 'white', label: t('White') },
  { value: 'hsv', label: t('HSV') },
  { value: 'rgb', label: t('RGB') },
];

/** @param {{colour: RGB, set: SetColour}} props */
export function Hex({ colour, set }) {
  const take = (/** @type {string} */ text) => {
    const rgb = fromHex(text);
    if (rgb) set(rgb, true);
  };
  return html`<${TextField} class="hex" hidden label=${t('Hex')} value=${toHex(colour)} maxLength=${7} take=${take} />`;
}

/** @param {{colour: RGB, set: SetColour, isPure?: boolean}} props isPure: a new temperature is on
 * Planck's locus, unless the tint was set here */
export function White({ colour, set, isPure = false }) {
  // For colours that are not white, and for black, the dials keep the last white.
  const [lastWhite, setLastWhite] = useState({ kelvin: 3200, green: 0 });
  const match = toKelvin(colour);
  const isLast = isSameHue(fromKelvin(lastWhite.kelvin, lastWhite.green), colour);
  const white = isLast ? lastWhite : (match ?? lastWhite);
  const isWhite = isLast || match !== null || !Math.max(...colour);
  const level = Math.max(...colour) || 1;
  const setWhite = (
    /** @type {{kelvin?: number, green?: number}} */ changes,
    /** @type {boolean} */ isFinal,
  ) => {
    const newWhite = { ...white, ...changes };
    setLastWhite(newWhite);
    const rgb = fromKelvin(newWhite.kelvin, newWhite.green);
    set(/** @type {RGB} */ (rgb.map((x) => x * level)), isFinal);
  };
  const kelvin = clampKelvin(white.kelvin);
  const green = Math.min(20, Math.max(-20, white.green));
  return html`<div class=${`white ${isWhite ? '' : 'is-dim'}`}>
    <${KelvinSlider} value=${kelvin}
      change=${(/** @type {number} */ kelvin, /** @type {boolean} */ isFinal) =>
        setWhite({ kelvin, ...(isPure && !isLast ? { green: 0 } : {}) }, isFinal)} />
    <${Slider} label=${t('Tint')} value=${green} min=${-20} max=${20} step=${1} digits=${0} resetValue=${0}
      track=${gradient([-20, 0, 20].map((tint) => fromKelvin(kelvin, tint)))}
      tip=${t('Duv × 1000: green to the right, magenta to the left')}
      change=${(/** @type {number} */ value, /** @type {boolean} */ isFinal) =>
        setWhite({ green: value }, isFinal)} /></div>`;
}

/** Return whether two colours differ at most in brightness. @param {RGB} a @param {RGB} b */
function isSameHue(a, b) {
  const [m, n] = [Math.max(...a), Math.max(...b)];
  return n > 0 && a.every((x, c) => Math.abs(x / m - b[c] / n) < 1e-4);
}

/** @param {{colour: RGB, set: SetColour, hasValue?: boolean}} props hasValue: whether brightness is
 * part of the colour, as it is of paint */
export function Hsv({ colour, set, hasValue = true }) {
  const current = toHsv(colour);
  const [lastHsv, setLastHsv] = useState(current);
  // Grey has no hue and black no saturation; the sliders keep theirs.
  const hue = current[1] > 0.004 && current[2] > 0 ? current[0] : lastHsv[0];
  const hsv = /** @type {RGB} */ ([hue, current[2] > 0 ? current[1] : lastHsv[1], current[2]]);
  const setChannel =
    (/** @type {number} */ channel, divisor = 1) =>
    (/** @type {number} */ value, /** @type {boolean} */ isFinal) => {
      const newHsv = /** @type {RGB} */ (hsv.map((x, c) => (c === channel ? value / divisor : x)));
      setLastHsv(newHsv);
      set(fromHsv(newHsv), isFinal);
    };
  const hues = Array.from({ length: 7 }, (_, i) => fromHsv([i * 60, 1, 1]));
  const setHue = (
    /** @type {number} */ newHue,
    /** @type {number} */ saturation,
    /** @type {boolean} */ isFinal,
  ) => {
    const newHsv = /** @type {RGB} */ ([newHue, saturation, hsv[2]]);
    setLastHsv(newHsv);
    set(fromHsv(newHsv), isFinal);
  };
  return html`<${ColourWheel} hue=${hsv[0]} saturation=${hsv[1]} set=${setHue} />
    <${Slider} label=${t('Hue')} value=${hsv[0]} min=${0} max=${360} unit="°"
      track=${gradient(hues)} change=${setChannel(0)} />
    <${Slider} label=${t('Saturation')} value=${100 * hsv[1]} min=${0} max=${100} unit="%"
      track=${gradient([fromHsv([hsv[0], 0, hsv[2]]), fromHsv([hsv[0], 1, hsv[2]])])}
      change=${setChannel(1, 100)} />
    ${
      hasValue &&
      html`<${Slider} label=${t('Value')} value=${100 * hsv[2]} min=${0} max=${100} unit="%"
      track=${gradient([[0, 0, 0], fromHsv([hsv[0], hsv[1], 1])])} change=${setChannel(2, 100)} />`
    }`;
}

/** @param {{colour: RGB, set: SetColour}} props */
export function Rgb({ colour, set }) {
  const replaceChannel = (/** @type {number} */ channel, /** @type {number} */ value) =>
    /** @type {RGB} */ (colour.map((x, c) => (c === channel ? decode(value / 255) : x)));
  return html`${[t('Red'), t('Green'), t('Blue')].map(
    (label, c) => html`<${Slider} key=${label}
    label=${label} value=${255 * encode(colour[c])} min=${0} max=${255}
    track=${gradient([replaceChannel(c, 0), replaceChannel(c, 255)])}
    change=${(/** @type {number} */ value, /** @type {boolean} */ isFinal) =>
      set(replaceChannel(c, value), isFinal)} />`,
  )}`;
}
