/** Controls for all lights of a mixer, and for the selected ones together. */

import { slideByTouch } from '../touch_sliders.js';
import { createElement, createSlider } from './page_elements.js';

/** @import { RGB } from '../drawing/colour.js' */
/** @import { Row } from './mixer_light.js' */

/** Ends of the sliders: of the master in percent, of the others in stops and mireds. */
const [MASTER_MAX, DIM_RANGE, WARM_RANGE] = [200, 4, 100];

export class Selection {
  /** @param {Row[]} rows @param {() => void} redraw */
  constructor(rows, redraw) {
    this.rows = rows.filter(({ light }) => !light.isFixed);
    this.redraw = redraw;
    /** Factor of all lights but fixed ones. */
    this.master = 1;
    this.anchor = 0;
    this.element = createElement('div', 'mixer-all');
    /** What acts on selected lights. @type {HTMLInputElement[]} */
    this.controls = [];
    this.masterSlider = this.addSlider('Master', 0, MASTER_MAX, (percent) => {
      this.master = percent / 100;
      return `${Math.round(percent)} %`;
    });
    this.addRelative('Dim', DIM_RANGE, 'st', (row, rgb, stops) =>
      row.set(/** @type {RGB} */ (rgb.map((x) => x * 2 ** stops)), row.kelvin),
    );
    this.addRelative('Warm', WARM_RANGE, 'mired', (row, _, mired, kelvin) => {
      if (kelvin && !row.light.isScalar) row.setTemperature(1e6 / kelvin + mired);
    });
    this.pattern = createElement('input');
    Object.assign(this.pattern, { type: 'search', placeholder: 'Select: spot_*' });
    this.pattern.ariaLabel = 'Select lights by a pattern';
    this.pattern.addEventListener('input', () => this.selectMatching());
    this.count = createElement('span');
    this.count.setAttribute('role', 'status');
    this.element.append(this.pattern, this.count);
    this.rows.forEach((row, k) =>
      row.checkbox.addEventListener('click', (event) => this.press(k, event.shiftKey)),
    );
    this.show();
  }

  get selected() {
    return this.rows.filter((row) => row.checkbox.checked);
  }

  /** Select all rows from the last one with Shift. @param {number} k @param {boolean} isRange */
  press(k, isRange) {
    const [first, last] = [this.anchor, k].sort((a, b) => a - b);
    const { checked } = this.rows[k].checkbox;
    if (isRange) for (const row of this.rows.slice(first, last + 1)) row.checkbox.checked = checked;
    this.anchor = k;
    this.show();
  }

  /** Select the lights that match a pattern with * and ?. */
  selectMatching() {
    const text = this.pattern.value.trim().replace(/[.+^${}()|[\]\\]/g, '\\$&');
    const pattern = new RegExp(`^${text.replaceAll('*', '.*').replaceAll('?', '.')}$`, 'i');
    for (const { light, checkbox } of this.rows) checkbox.checked = pattern.test(light.name);
    this.show();
  }

  /** @param {string} label @param {number} min @param {number} max
   * @param {(value: number) => string} change returns the value as text */
  addSlider(label, min, max, change) {
    const slider = createSlider(label, min, max);
    const output = createElement('output');
    const move = (/** @type {number} */ value) => {
      slider.value = String(value);
      output.textContent = change(value);
      slider.ariaValueText = output.textContent;
      this.redraw();
    };
    slider.addEventListener('input', () => move(Number(slider.value)));
    slideByTouch(slider, move, () => {});
    this.element.append(createElement('span', '', label), slider, output);
    return { slider, move };
  }

  /** Add a slider that changes the selected lights from where they are, and goes back to 0.
   * @param {string} label @param {number} range @param {string} unit
   * @param {(row: Row, rgb: RGB, amount: number, kelvin: number | null) => void} change */
  addRelative(label, range, unit, change) {
    /** @type {[Row, RGB, number | null][]} */
    let start = [];
    const control = this.addSlider(`${label} selected`, -range, range, (amount) => {
      if (!start.length) start = this.selected.map((row) => [row, row.rgb, row.kelvin]);
      for (const [row, rgb, kelvin] of start) change(row, rgb, amount, kelvin);
      return `${amount < 0 ? '\u2212' : '+'}${Math.abs(amount).toFixed(unit === 'st' ? 2 : 0)} ${unit}`;
    });
    const { slider } = control;
    this.controls.push(slider);
    const rest = () => {
      start = [];
      slider.value = '0';
    };
    slider.addEventListener('change', rest);
    slider.addEventListener('pointerup', rest);
    slider.value = '0';
  }

  /** Add a control of the selected lights. @param {HTMLInputElement} control */
  addControl(control) {
    this.controls.push(control);
    this.element.append(control);
    this.show();
  }

  show() {
    const count = this.selected.length;
    this.count.textContent = `${count} selected`;
    for (const control of this.controls) control.disabled = !count;
  }

  reset() {
    this.masterSlider.move(100);
  }
}
