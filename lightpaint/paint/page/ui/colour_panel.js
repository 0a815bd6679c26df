/** The colour of the paint as white, HSV, RGB or hex, its brightness, and swatches. */

import { html, useState } from '../vendor/preact.js';
import { encode, decode, ofHex, ofHsv, ofKelvin, toHex, toHsv, toKelvin } from './paint_colour.js';
import { Choice, Slider, useTyped } from './controls.js';
import { signed } from './format.js';
import { KelvinSlider, gradient, withinKelvin } from './kelvin_slider.js';
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
        style=${{ '--colour': toHex(ui.colour), '--shown': shownAs(ui, app) }}></span>
      <${Hex} colour=${ui.colour} set=${set} />
      <${Choice} label="Colour model" value=${ui.mixer} choices=${MIXERS}
        change=${(/** @type {any} */ mixer) => store.set({ mixer })} />
    </div>
    <${Mixer} colour=${ui.colour} set=${set} />
    <${Slider} label="Brightness" value=${ui.stops} least=${-8} most=${8} step=${0.1} digits=${1}
      unit="st" rest=${0} tip="Stops above display white. Paint can be brighter than white."
      change=${(/** @type {number} */ stops) => store.set({ stops })} />
    <${Swatches} ui=${ui} app=${app} />
  </div>`;
}

/** Return the display colour of the current paint on white. @param {Ui} ui @param {App} app */
export function shownAs(ui, { engine }) {
  return `rgb(${engine.codes(paintOf(ui), ui.show.stops).join(' ')})`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Hex({ colour, set }) {
  const [typed, setTyped, now] = useTyped();
  const take = (/** @type {string} */ text) => {
    const made = ofHex(text);
    setTyped(null);
    if (made) set(made);
  };
  const press = (/** @type {any} */ { key, currentTarget }) => {
    if (key === 'Enter') take(currentTarget.value);
    if (key === 'Escape') setTyped(null);
  };
  return html`<label class="field hex"><span class="only-read">Hex</span>
    <input type="text" value=${typed ?? toHex(colour)} data-typed=${typed === null ? 'no' : 'yes'} spellcheck=${false} autocomplete="off"
      maxlength="7"
      onInput=${(/** @type {any} */ event) => setTyped(event.currentTarget.value)}
      onBlur=${() => now.current !== null && take(now.current)}
      onKeyDown=${press} /></label>`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function White({ colour, set }) {
  // For colours that are not white, and for black, the dials keep the last white.
  const [last, setLast] = useState({ kelvin: 3200, green: 0 });
  const found = toKelvin(colour);
  const isLast = same(ofKelvin(last.kelvin, last.green), colour);
  const dials = isLast ? last : (found ?? last);
  const isWhite = isLast || found !== null || !Math.max(...colour);
  const level = Math.max(...colour) || 1;
  const dial = (/** @type {{kelvin?: number, green?: number}} */ changed) => {
    const made = { ...dials, ...changed };
    setLast(made);
    const rgb = ofKelvin(made.kelvin, made.green);
    set(/** @type {RGB} */ (rgb.map((x) => x * level)));
  };
  const kelvin = withinKelvin(dials.kelvin);
  const green = Math.min(20, Math.max(-20, dials.green));
  return html`<div class=${`white ${isWhite ? '' : 'is-dim'}`}>
    <${KelvinSlider} value=${kelvin}
      change=${(/** @type {number} */ made) => dial({ kelvin: made })} />
    <${Slider} label="Tint" value=${green} least=${-20} most=${20} step=${1} digits=${0} rest=${0}
      track=${gradient([-20, 0, 20].map((by) => ofKelvin(kelvin, by)))}
      tip="Duv × 1000: green to the right, magenta to the left"
      change=${(/** @type {number} */ made) => dial({ green: made })} /></div>`;
}

/** Return whether two colours differ at most in brightness. @param {RGB} a @param {RGB} b */
function same(a, b) {
  const [m, n] = [Math.max(...a), Math.max(...b)];
  return n > 0 && a.every((x, c) => Math.abs(x / m - b[c] / n) < 1e-4);
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Hsv({ colour, set }) {
  const now = toHsv(colour);
  const [kept, keep] = useState(now);
  // Grey has no hue and black no saturation; the sliders keep theirs.
  const hue = now[1] > 0.004 && now[2] > 0 ? now[0] : kept[0];
  const hsv = /** @type {RGB} */ ([hue, now[2] > 0 ? now[1] : kept[1], now[2]]);
  const to = (/** @type {number} */ at, /** @type {number} */ value) => {
    const made = /** @type {RGB} */ (hsv.map((x, c) => (c === at ? value : x)));
    keep(made);
    set(ofHsv(made));
  };
  const hues = Array.from({ length: 7 }, (_, i) => ofHsv([i * 60, 1, 1]));
  return html`<${Slider} label="Hue" value=${hsv[0]} least=${0} most=${360} unit="°"
      track=${gradient(hues)} change=${(/** @type {number} */ x) => to(0, x)} />
    <${Slider} label="Saturation" value=${100 * hsv[1]} least=${0} most=${100} unit="%"
      track=${gradient([ofHsv([hsv[0], 0, hsv[2]]), ofHsv([hsv[0], 1, hsv[2]])])}
      change=${(/** @type {number} */ x) => to(1, x / 100)} />
    <${Slider} label="Value" value=${100 * hsv[2]} least=${0} most=${100} unit="%"
      track=${gradient([[0, 0, 0], ofHsv([hsv[0], hsv[1], 1])])}
      change=${(/** @type {number} */ x) => to(2, x / 100)} />`;
}

/** @param {{colour: RGB, set: (colour: RGB) => void}} props */
function Rgb({ colour, set }) {
  const to = (/** @type {number} */ at, /** @type {number} */ value) =>
    /** @type {RGB} */ (colour.map((x, c) => (c === at ? decode(value / 255) : x)));
  return html`${['Red', 'Green', 'Blue'].map(
    (label, c) => html`<${Slider} key=${label}
    label=${label} value=${255 * encode(colour[c])} least=${0} most=${255}
    track=${gradient([to(c, 0), to(c, 255)])}
    change=${(/** @type {number} */ value) => set(to(c, value))} />`,
  )}`;
}

/** @param {{ui: Ui, app: App}} props */
function Swatches({ ui, app }) {
  const { store } = app;
  const swatch = (/** @type {RGB} */ rgb, /** @type {string} */ tip, /** @type {number} */ stops) =>
    html`<${Swatch} key=${tip} rgb=${rgb} tip=${tip}
      act=${() => store.set({ colour: rgb, stops })} />`;
  const gels = GELS.map(([name, hex]) => ({ name, rgb: /** @type {RGB} */ (ofHex(hex)) }));
  return html`<div class="swatches" role="group" aria-label="Swatches">
    ${WHITES.map((kelvin) => swatch(ofKelvin(kelvin), `${kelvin} K`, ui.stops))}
    ${gels.map(({ name, rgb }) => swatch(rgb, name, ui.stops))}
  </div>
  <div class="swatches is-recent" role="group" aria-label="Recent colours">
    ${!ui.recent.length && html`<span class="faint">Recent colours</span>`}
    ${ui.recent.map(({ colour, stops }, k) => {
      const by = signed(stops, Math.abs(stops - Math.round(stops)) < 0.05 ? 0 : 1);
      const bright = by === '0' ? '' : `, ${by} stops`;
      return html`<${Swatch} key=${k} rgb=${colour} stops=${bright && by}
        tip=${`Recent ${k + 1}: ${toHex(colour)}${bright}`}
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
