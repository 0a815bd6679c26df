/** The colour of the paint as white, HSV, RGB or hex, its brightness, and swatches. */

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
import { Choice, Slider, useDraft } from './controls.js';
import { signedText } from './format.js';
import { KelvinSlider, gradient, clampKelvin } from './kelvin_slider.js';
import { paintOf } from './ui_state.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").RGB} RGB */
/** @typedef {import("./shortcuts.js").App} App */

/** Warm is right, as on the sliders and in an adjusting drag. */
const WHITES = [9000, 6500, 5600, 4300, 3200, 2700, 1900];
const GELS = [
  ['Red', '#ff2a1a'],
  ['Amber', '#ff9a1f'],
  ['Green', '#35d04a'],
  ['Cyan', '#2fd6e0'],
  ['Blue', '#2a55ff'],
  ['Magenta', '#e02fd0'],
  ['Black', '#000000'],
];
const MIXERS = [
  { value: 'white', label: 'White' },
  { value: 'hsv', label: 'HSV' },
  { value: 'rgb', label: 'RGB' },
];

/** @param {{ui: Ui, app: App}} props */
export function ColourPanel({ ui, app }) {
  const { store } = app;
  const set = (/** @type {RGB} */ colour) => store.set({ colour });
  const Mixer = { white: White, hsv: Hsv, rgb: Rgb }[ui.mixer];
  return html`<div class="colour">
    <div class="colour-row">
      <span class="patch" data-tip="Left: the colour. Right: how the display shows it at this brightness."
        style=${{ '--colour': toHex(ui.colour), '--shown': displayColour(ui, app) }}></span>
      <${Hex} colour=${ui.colour} set=${set} />
      <${Choice} label="Colour model" value=${ui.mixer} choices=${MIXERS}
        change=${(/** @type {any} */ mixer) => store.set({ mixer })} />
    </div>
    <${Mixer} colour=${ui.colour} set=${set} />
    <${Slider} label="Brightness" value=${ui.stops} min=${-8} max=${8} step=${0.1} digits=${1}
      unit="st" resetValue=${0} tip="Stops above display white. Paint can be brighter than white."
      change=${(/** @type {number} */ stops) => store.set({ stops })} />
    <${Swatches} ui=${ui} app=${app} />
  </div>`;
}

/** Return the display colour of the current paint on white. @param {Ui} ui @param {App} app */
export function displayColour(ui, { engine }) {
  return `rgb(${engine.codes(paintOf(ui), ui.display.stops).join(' ')})`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Hex({ colour, set }) {
  const [draft, setDraft, draftRef] = useDraft();
  const take = (/** @type {string} */ text) => {
    const rgb = fromHex(text);
    setDraft(null);
    if (rgb) set(rgb);
  };
  const press = (/** @type {any} */ { key, currentTarget }) => {
    if (key === 'Enter') take(currentTarget.value);
    if (key === 'Escape') setDraft(null);
  };
  return html`<label class="field hex"><span class="only-read">Hex</span>
    <input type="text" value=${draft ?? toHex(colour)} data-typed=${draft === null ? 'no' : 'yes'} spellcheck=${false} autocomplete="off"
      maxlength="7"
      onInput=${(/** @type {any} */ event) => setDraft(event.currentTarget.value)}
      onBlur=${() => draftRef.current !== null && take(draftRef.current)}
      onKeyDown=${press} /></label>`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function White({ colour, set }) {
  // For colours that are not white, and for black, the dials keep the last white.
  const [lastWhite, setLastWhite] = useState({ kelvin: 3200, green: 0 });
  const match = toKelvin(colour);
  const isLast = isSameHue(fromKelvin(lastWhite.kelvin, lastWhite.green), colour);
  const white = isLast ? lastWhite : (match ?? lastWhite);
  const isWhite = isLast || match !== null || !Math.max(...colour);
  const level = Math.max(...colour) || 1;
  const setWhite = (/** @type {{kelvin?: number, green?: number}} */ changes) => {
    const newWhite = { ...white, ...changes };
    setLastWhite(newWhite);
    const rgb = fromKelvin(newWhite.kelvin, newWhite.green);
    set(/** @type {RGB} */ (rgb.map((x) => x * level)));
  };
  const kelvin = clampKelvin(white.kelvin);
  const green = Math.min(20, Math.max(-20, white.green));
  return html`<div class=${`white ${isWhite ? '' : 'is-dim'}`}>
    <${KelvinSlider} value=${kelvin}
      change=${(/** @type {number} */ value) => setWhite({ kelvin: value })} />
    <${Slider} label="Tint" value=${green} min=${-20} max=${20} step=${1} digits=${0} resetValue=${0}
      track=${gradient([-20, 0, 20].map((tint) => fromKelvin(kelvin, tint)))}
      tip="Duv × 1000: green to the right, magenta to the left"
      change=${(/** @type {number} */ value) => setWhite({ green: value })} /></div>`;
}

/** Return whether two colours differ at most in brightness. @param {RGB} a @param {RGB} b */
function isSameHue(a, b) {
  const [m, n] = [Math.max(...a), Math.max(...b)];
  return n > 0 && a.every((x, c) => Math.abs(x / m - b[c] / n) < 1e-4);
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Hsv({ colour, set }) {
  const current = toHsv(colour);
  const [lastHsv, setLastHsv] = useState(current);
  // Grey has no hue and black no saturation; the sliders keep theirs.
  const hue = current[1] > 0.004 && current[2] > 0 ? current[0] : lastHsv[0];
  const hsv = /** @type {RGB} */ ([hue, current[2] > 0 ? current[1] : lastHsv[1], current[2]]);
  const setChannel = (/** @type {number} */ channel, /** @type {number} */ value) => {
    const newHsv = /** @type {RGB} */ (hsv.map((x, c) => (c === channel ? value : x)));
    setLastHsv(newHsv);
    set(fromHsv(newHsv));
  };
  const hues = Array.from({ length: 7 }, (_, i) => fromHsv([i * 60, 1, 1]));
  return html`<${Slider} label="Hue" value=${hsv[0]} min=${0} max=${360} unit="°"
      track=${gradient(hues)} change=${(/** @type {number} */ x) => setChannel(0, x)} />
    <${Slider} label="Saturation" value=${100 * hsv[1]} min=${0} max=${100} unit="%"
      track=${gradient([fromHsv([hsv[0], 0, hsv[2]]), fromHsv([hsv[0], 1, hsv[2]])])}
      change=${(/** @type {number} */ x) => setChannel(1, x / 100)} />
    <${Slider} label="Value" value=${100 * hsv[2]} min=${0} max=${100} unit="%"
      track=${gradient([[0, 0, 0], fromHsv([hsv[0], hsv[1], 1])])}
      change=${(/** @type {number} */ x) => setChannel(2, x / 100)} />`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Rgb({ colour, set }) {
  const replaceChannel = (/** @type {number} */ channel, /** @type {number} */ value) =>
    /** @type {RGB} */ (colour.map((x, c) => (c === channel ? decode(value / 255) : x)));
  return html`${['Red', 'Green', 'Blue'].map(
    (label, c) => html`<${Slider} key=${label}
    label=${label} value=${255 * encode(colour[c])} min=${0} max=${255}
    track=${gradient([replaceChannel(c, 0), replaceChannel(c, 255)])}
    change=${(/** @type {number} */ value) => set(replaceChannel(c, value))} />`,
  )}`;
}

/** @param {{ui: Ui, app: App}} props */
function Swatches({ ui, app }) {
  const { store } = app;
  const swatch = (/** @type {RGB} */ rgb, /** @type {string} */ tip, /** @type {number} */ stops) =>
    html`<${Swatch} key=${tip} rgb=${rgb} tip=${tip}
      act=${() => store.set({ colour: rgb, stops })} />`;
  const gels = GELS.map(([name, hex]) => ({ name, rgb: /** @type {RGB} */ (fromHex(hex)) }));
  return html`<div class="swatches" role="group" aria-label="Swatches">
    ${WHITES.map((kelvin) => swatch(fromKelvin(kelvin), `${kelvin} K`, ui.stops))}
    ${gels.map(({ name, rgb }) => swatch(rgb, name, ui.stops))}
  </div>
  <div class="swatches is-recent" role="group" aria-label="Recent colours">
    ${!ui.recent.length && html`<span class="faint">Recent colours</span>`}
    ${ui.recent.map(({ colour, stops }, k) => {
      const stopsLabel = signedText(stops, Math.abs(stops - Math.round(stops)) < 0.05 ? 0 : 1);
      const brightness = stopsLabel === '0' ? '' : `, ${stopsLabel} stops`;
      return html`<${Swatch} key=${k} rgb=${colour} stops=${brightness && stopsLabel}
        tip=${`Recent ${k + 1}: ${toHex(colour)}${brightness}`}
        act=${() => store.set({ colour, stops })} />`;
    })}
  </div>`;
}

/** A colour, with its brightness if that is part of it.
 * @param {{rgb: RGB, tip: string, stops?: string, act: () => void}} props */
function Swatch({ rgb, tip, stops, act }) {
  return html`<button type="button" class="swatch" aria-label=${tip} data-tip=${tip}
    style=${{ background: toHex(rgb) }} onClick=${act}>${
      stops && html`<span aria-hidden="true">${stops}</span>`
    }</button>`;
}
