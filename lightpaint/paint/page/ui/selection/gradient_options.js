/** The options of the gradient tool, above the pictures. */

import { warmer } from '../../../../viewer/drawing/colour.js';
import { html } from '../../vendor/preact.js';
import { Choice, NumberField } from '../controls.js';
import { paintOf } from '../display_state.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./gradient_settings.js").GradientUi} GradientUi */

export const GRADIENT_SHAPES = [
  { value: 'linear', label: 'Linear', tip: 'From one line to another' },
  { value: 'radial', label: 'Radial', tip: 'Around the place where the drag begins' },
];

const EFFECTS = [
  { value: false, label: 'Paint', tip: 'Light of the current colour' },
  { value: true, label: 'Adjust', tip: 'Brighter and warmer by numbers' },
];

const ENDS = [
  { value: false, label: 'To nothing', tip: 'It fades out' },
  { value: true, label: 'To 2nd colour', tip: 'It becomes the second colour (X swaps them)' },
];

/** @param {{ui: Ui, app: App}} props */
export function GradientOptions({ ui, app }) {
  const { gradient } = ui;
  const set = (/** @type {Partial<GradientUi>} */ changes) =>
    app.store.set((state) => ({ gradient: { ...state.gradient, ...changes } }));
  return html`
    <${Choice} label="Shape" value=${gradient.shape} choices=${GRADIENT_SHAPES}
      change=${(/** @type {any} */ shape) => set({ shape })} />
    <${Choice} label="Effect" value=${gradient.isAdjusting} choices=${EFFECTS}
      change=${(/** @type {boolean} */ isAdjusting) => set({ isAdjusting })} />
    ${
      gradient.isAdjusting
        ? html`<${NumberField} label="Brighter" value=${gradient.stops} min=${-8} max=${8} step=${0.1}
            unit="st" change=${(/** @type {number} */ stops) => set({ stops })} />
          <${NumberField} label="Warmer" value=${gradient.mired} min=${-300} max=${300} step=${5} digits=${0}
            unit="mired" change=${(/** @type {number} */ mired) => set({ mired })} />`
        : html`<${Choice} label="End" value=${gradient.hasEnd} choices=${ENDS}
            change=${(/** @type {boolean} */ hasEnd) => set({ hasEnd })} />`
    }`;
}

/** Return the settings with which the engine makes a gradient. @param {Ui} ui
 * @returns {import("../../engine/layers/gradient.js").GradientSettings} */
export function gradientOf(ui) {
  const { shape, isAdjusting, hasEnd, stops, mired } = ui.gradient;
  const endRgb = paintOf({ ...ui, ...ui.second });
  return { shape, isAdjusting, hasEnd, gain: 2 ** stops, tint: warmer(mired), endRgb };
}
