/** One light of the mixer: its row with its sliders. */

import { luminance } from '../drawing/chromaticity.js';
import { decodeSrgb, encodeSrgb } from '../drawing/view_transform.js';
import { slideByTouch } from '../touch_sliders.js';
import { createElement, createSlider } from './page_elements.js';

/** @import { RGB } from '../drawing/colour.js' */
/** kelvin: if the look's colour is white, else null.
 * joint: lights that share this row.
 * @typedef {{name: string, unit: string, isFixed: boolean, isScalar: boolean,
 *   joint?: import("./mixer_data.js").Joint,
 *   present: RGB, answer: RGB, kelvin: {present: number | null, answer: number | null}}} Light */

/** Ends of the dimmer, in stops from the current level; the left one is off. */
const [DIMMER_MIN_STOPS, DIMMER_MAX_STOPS] = [-8, 6];

/** Colours of luminance 1 by temperature, interpolated in mireds.
 * @param {import("./mixer_data.js").Data["kelvins"]} table colors: evenly in mireds
 * @typedef {ReturnType<typeof kelvinTable>} Kelvins */
export function kelvinTable({ coolest, warmest, colors }) {
  const [first, last, count] = [1e6 / coolest, 1e6 / warmest, colors.length - 1];
  /** @param {number} mired @returns {RGB} */
  const rgb = (mired) => {
    const position = Math.min(count, Math.max(0, (count * (mired - first)) / (last - first)));
    const k = Math.min(count - 1, Math.floor(position));
    const [a, b] = [colors[k], colors[k + 1]];
    const blend = /** @type {RGB} */ (a.map((x, c) => x + (position - k) * (b[c] - x)));
    const presentLevel = luminance(blend);
    return /** @type {RGB} */ (blend.map((x) => x / presentLevel));
  };
  return { rgb, coolest: first, warmest: last };
}

/** A light with sliders. */
export class Row {
  /** @param {Light} light @param {Kelvins} kelvins @param {() => void} onChange */
  constructor(light, kelvins, onChange) {
    this.light = light;
    /** Index of its plane. */
    this.plane = 0;
    this.kelvins = kelvins;
    this.onChange = onChange;
    this.rgb = light.answer;
    this.kelvin = light.kelvin.answer;
    /** Its colour when it was last on. */
    this.hue = light.answer;
    this.isSolo = false;
    this.isMute = false;
    const levels = [light.present, light.answer].map(luminance);
    this.presentLevel = levels[0] || levels[1] || 1;
    const stops = levels.filter((x) => x > 0).map((x) => Math.log2(x / this.presentLevel));
    this.maxStops = Math.ceil(Math.max(DIMMER_MAX_STOPS, ...stops));
    this.minStops = Math.floor(Math.min(DIMMER_MIN_STOPS, ...stops.map((x) => x - 1)));
    const { name } = light;
    this.element = createElement('div', 'mixer-light');
    this.thumb = document.createElement('canvas');
    this.swatch = createElement('input', 'mixer-swatch');
    this.swatch.type = 'color';
    this.swatch.disabled = light.isFixed || light.isScalar;
    this.swatch.ariaLabel = `${name}: colour`;
    this.checkbox = createElement('input');
    this.checkbox.type = 'checkbox';
    this.checkbox.ariaLabel = `Select ${name}`;
    this.solo = this.toggle('S', `Solo: show ${name} alone`, () => (this.isSolo = !this.isSolo));
    this.mute = this.toggle('M', `Mute: show all but ${name}`, () => (this.isMute = !this.isMute));
    this.dimmerSlider = createSlider(`${name}: stops from now`, this.minStops, this.maxStops);
    this.dimmerOutput = createElement('output');
    this.temperatureSlider = createSlider(
      `${name}: colour temperature`,
      kelvins.coolest,
      kelvins.warmest,
    );
    this.temperatureOutput = createElement('output');
    this.build();
  }

  build() {
    const { light, kelvins } = this;
    this.element.setAttribute('role', 'group');
    this.element.ariaLabel = light.name;
    this.thumb.setAttribute('aria-hidden', 'true');
    const head = createElement('div', 'mixer-head');
    const name = createElement('span', 'mixer-name', light.name);
    name.title = light.name;
    const toggles = createElement('span', 'mixer-hear');
    toggles.append(this.solo, this.mute);
    if (!light.isFixed) head.append(this.checkbox);
    head.append(this.swatch, name, toggles);
    const body = createElement('div', 'mixer-sliders');
    this.element.append(this.thumb, head, body);
    if (light.isFixed) {
      body.append(createElement('small', '', 'stays as it is in the scene'));
      return;
    }
    body.append(this.dimmerSlider, this.dimmerOutput);
    const restore = () => this.show();
    this.dimmerSlider.addEventListener('input', () => this.dim(Number(this.dimmerSlider.value)));
    slideByTouch(this.dimmerSlider, (stops) => this.dim(stops), restore);
    this.dimmerSlider.addEventListener('dblclick', () => this.dim(0));
    if (light.isScalar) return;
    this.swatch.addEventListener('input', () => this.setColour(this.swatch.value));
    this.temperatureSlider.classList.add('is-white');
    this.temperatureSlider.style.setProperty('--track', trackOf(kelvins));
    body.append(this.temperatureSlider, this.temperatureOutput);
    this.temperatureSlider.addEventListener('input', () =>
      this.setTemperature(Number(this.temperatureSlider.value)),
    );
    slideByTouch(this.temperatureSlider, (mired) => this.setTemperature(mired), restore);
  }

  /** @param {string} text @param {string} label @param {() => void} act */
  toggle(text, label, act) {
    const button = createElement('button', '', text);
    button.type = 'button';
    button.title = label;
    button.ariaLabel = label;
    button.addEventListener('click', () => {
      act();
      this.show();
      this.onChange();
    });
    return button;
  }

  /** @param {number} stops */
  dim(stops) {
    const presentLevel = stops <= this.minStops ? 0 : this.presentLevel * 2 ** stops;
    const factor = presentLevel / luminance(this.hue);
    this.set(/** @type {RGB} */ (this.hue.map((x) => x * factor)), this.kelvin);
  }

  /** @param {number} mired */
  setTemperature(mired) {
    const { coolest, warmest } = this.kelvins;
    const clamped = Math.min(warmest, Math.max(coolest, mired));
    this.setHue(this.kelvins.rgb(clamped), 1e6 / clamped);
  }

  /** @param {string} hex a colour; black has none */
  setColour(hex) {
    const codes = [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
    const rgb = /** @type {RGB} */ (codes.map(decodeSrgb));
    if (luminance(rgb) > 0) this.setHue(rgb, null);
  }

  /** Give the light a colour at its present level. @param {RGB} hue @param {number | null} kelvin */
  setHue(hue, kelvin) {
    const factor = luminance(this.rgb) / luminance(hue);
    if (!factor) this.hue = hue;
    this.set(/** @type {RGB} */ (hue.map((x) => x * factor)), kelvin);
  }

  /** @param {'answer' | 'present'} look */
  reset(look) {
    const { light } = this;
    this.isSolo = this.isMute = false;
    const otherEmission = look === 'answer' ? light.present : light.answer;
    const litColour = [light[look], otherEmission].find((rgb) => luminance(rgb) > 0);
    this.hue = litColour ?? [1, 1, 1];
    this.rgb = light[look];
    this.kelvin = light.kelvin[look];
    this.show();
  }

  /** @param {RGB} rgb @param {number | null} kelvin */
  set(rgb, kelvin) {
    this.rgb = rgb;
    this.kelvin = kelvin;
    if (luminance(rgb) > 0) this.hue = rgb;
    this.show();
    this.onChange();
  }

  show() {
    const {
      dimmerSlider,
      dimmerOutput,
      temperatureSlider,
      temperatureOutput,
      swatch,
      solo,
      mute,
      element: row,
    } = this;
    const presentLevel = luminance(this.rgb);
    const stops = presentLevel > 0 ? Math.log2(presentLevel / this.presentLevel) : this.minStops;
    const stopsText =
      presentLevel > 0 ? `${stops < -0.005 ? '\u2212' : '+'}${Math.abs(stops).toFixed(2)}` : 'off';
    dimmerSlider.value = String(stops);
    dimmerSlider.ariaValueText = presentLevel > 0 ? `${stopsText} stops` : 'off';
    dimmerOutput.textContent = stopsText;
    const { kelvin } = this;
    const temperature = kelvin === null ? 'own colour' : `${Math.round(kelvin / 10) * 10} K`;
    const { coolest, warmest } = this.kelvins;
    const mired = kelvin === null ? (coolest + warmest) / 2 : 1e6 / kelvin;
    temperatureSlider.value = String(mired);
    temperatureSlider.classList.toggle('is-none', kelvin === null);
    temperatureSlider.ariaValueText = temperature;
    temperatureOutput.textContent = kelvin === null ? 'colour' : temperature;
    swatch.value = hexOf(presentLevel > 0 ? this.rgb : this.hue);
    swatch.classList.toggle('is-off', !(presentLevel > 0));
    solo.ariaPressed = String(this.isSolo);
    mute.ariaPressed = String(this.isMute);
    row.classList.toggle('is-mute', this.isMute);
  }
}

/** Return the display colour of a light, its brightest channel at full. @param {RGB} rgb */
function hexOf(rgb) {
  const maxChannel = Math.max(...rgb) || 1;
  const codes = rgb.map((x) => Math.round(255 * encodeSrgb(x / maxChannel)));
  return `#${codes.map((code) => code.toString(16).padStart(2, '0')).join('')}`;
}

/** @param {Kelvins} kelvins */
function trackOf({ rgb, coolest, warmest }) {
  const stops = Array.from({ length: 9 }, (_, k) => coolest + (k / 8) * (warmest - coolest));
  return `linear-gradient(to right, ${stops.map((mired) => hexOf(rgb(mired))).join(', ')})`;
}
