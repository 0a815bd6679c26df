/** The controls of one colour: white, HSV with a wheel, RGB and hex. */

import { html, useState, useRef } from '../vendor/preact.js';
import { decode, encode, fromHex, fromHsv, fromKelvin } from '../../../viewer/drawing/colour.js';
import { isSameHue, toHex, toHsv, toKelvin } from '../../../viewer/drawing/colour.js';
import { Choice, Slider, TextField } from './controls.js';
import { t } from '../language/language.js';

/** @import { RGB } from './ui_state.js' */

/** @typedef {(hue: number, saturation: number, isFinal: boolean) => void} SetHue */

/** Red is at the top, and hues go clockwise.
 * @param {{hue: number, saturation: number, set: SetHue}} props hue in degrees, saturation 0 to 1;
 *   isFinal: false while it is dragged */
function ColourWheel({ hue, saturation, set }) {
  const pointer = useRef(/** @type {number | null} */ (null));
  const pick = (/** @type {PointerEvent} */ event, /** @type {boolean} */ isFinal) => {
    const wheel = /** @type {HTMLElement} */ (event.currentTarget);
    const { left, top, width, height } = wheel.getBoundingClientRect();
    const x = (2 * (event.clientX - left)) / width - 1;
    const y = (2 * (event.clientY - top)) / height - 1;
    const angle = (Math.atan2(x, -y) * 180) / Math.PI;
    set((angle + 360) % 360, Math.min(1, Math.hypot(x, y)), isFinal);
  };
  const down = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0 || pointer.current !== null) return;
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
    pointer.current = event.pointerId;
    pick(event, false);
  };
  const follow = (/** @type {boolean} */ isFinal) => (/** @type {PointerEvent} */ event) => {
    if (event.pointerId !== pointer.current) return;
    if (isFinal) pointer.current = null;
    pick(event, isFinal);
  };
  const angle = (hue * Math.PI) / 180;
  const place = {
    left: `${50 * (1 + saturation * Math.sin(angle))}%`,
    top: `${50 * (1 - saturation * Math.cos(angle))}%`,
  };
  return html`<div class="wheel" aria-hidden="true" data-tip=${t('Hue around the wheel, saturation outwards')} onPointerDown=${down}
    onPointerMove=${follow(false)} onPointerUp=${follow(true)} onPointerCancel=${follow(true)}>
    <i style=${place}></i></div>`;
}

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
const clampKelvin = (kelvin) => Math.min(MAX_KELVIN, Math.max(MIN_KELVIN, kelvin));

/** @param {{value: number, change: (kelvin: number, isFinal: boolean) => void, label?: string,
 *   disabled?: boolean}} props */
function KelvinSlider({ value, change, label = t('CCT'), disabled }) {
  return html`<${Slider} label=${label} value=${clampKelvin(value)} min=${MIN_KELVIN}
    max=${MAX_KELVIN} step=${100} unit=${t('K')} curve=${MIRED_CURVE} track=${TRACK} disabled=${disabled}
    tip=${t('Correlated colour temperature: warmer to the right')} change=${change} />`;
}

/** isFinal: false while a slider moves. @typedef {(colour: RGB, isFinal: boolean) => void} SetColour */

/** Choices of these controls. */
export const MIXERS = [
  { value: 'white', label: t('White') },
  { value: 'hsv', label: t('HSV') },
  { value: 'rgb', label: t('RGB') },
];

/** @param {{colour: RGB, set: SetColour}} props */
function Hex({ colour, set }) {
  const take = (/** @type {string} */ text) => {
    const rgb = fromHex(text);
    if (rgb) set(rgb, true);
  };
  return html`<${TextField} class="hex" hidden label=${t('Hex')} value=${toHex(colour)} maxLength=${7} take=${take} />`;
}

/** @param {{colour: RGB, set: SetColour, isPure?: boolean}} props isPure: a new temperature is on
 * Planck's locus, unless the tint was set here */
function White({ colour, set, isPure = false }) {
  // For colours that are not white, and for black, the dials keep the last white.
  const [lastWhite, setLastWhite] = useState({ kelvin: 3200, green: 0 });
  const match = toKelvin(colour);
  const isLast = isSameHue(fromKelvin(lastWhite.kelvin, lastWhite.green), colour, 1e-4);
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

/** @param {{colour: RGB, set: SetColour, hasValue?: boolean}} props hasValue: whether brightness is
 * part of the colour, as it is of paint */
function Hsv({ colour, set, hasValue = true }) {
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
function Rgb({ colour, set }) {
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

/** A colour as hex, white, HSV or RGB, and the choice among these.
 * @param {{colour: RGB, set: SetColour, mixer: string, choose: (mixer: any) => void, swatch?: any,
 *   choices?: {value: string, label: string, tip?: string}[], isLamp?: boolean}} props swatch: before the
 *   hex field. isLamp: brightness is not part of the colour */
export function ColourMixer({ colour, set, mixer, choose, swatch, choices = MIXERS, isLamp }) {
  return html`<div class="colour-row">${swatch}
      <${Hex} colour=${colour} set=${set} />
      <${Choice} label=${t('Colour model')} value=${mixer} choices=${choices} change=${choose} />
    </div>
    ${mixer === 'white' && html`<${White} colour=${colour} set=${set} isPure=${isLamp} />`}
    ${mixer === 'hsv' && html`<${Hsv} colour=${colour} set=${set} hasValue=${!isLamp} />`}
    ${mixer === 'rgb' && html`<${Rgb} colour=${colour} set=${set} />`}`;
}
