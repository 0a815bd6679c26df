/** The options of the gradient tool, above the pictures. */

import { warmer } from '../../../../viewer/drawing/colour.js';
import { html } from '../../vendor/preact.js';
import { Choice, NumberField } from '../controls.js';
import { paintOf } from '../display_state.js';
import { words } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./gradient_settings.js").GradientUi} GradientUi */

export const GRADIENT_SHAPES = [
  {
    value: 'linear',
    label: words.gradientOptions.linear,
    tip: words.gradientOptions.fromOneLineToAnother,
  },
  {
    value: 'radial',
    label: words.gradientOptions.radial,
    tip: words.gradientOptions.aroundThePlaceWhereTheDrag,
  },
];

const EFFECTS = [
  {
    value: false,
    label: words.gradientOptions.paint,
    tip: words.gradientOptions.lightOfTheCurrentColour,
  },
  {
    value: true,
    label: words.gradientOptions.adjust,
    tip: words.gradientOptions.brighterAndWarmerByNumbers,
  },
];

/** @param {Ui} ui */
const endsOf = (ui) => [
  { value: false, label: words.gradientOptions.toNothing, tip: words.gradientOptions.itFadesOut },
  {
    value: true,
    label: words.gradientOptions.to2ndColour,
    tip: words.gradientOptions.itBecomesTheSecondColour,
    keys: shortcutsOf(ui, 'swap'),
  },
];

/** @param {{ui: Ui, app: App}} props */
export function GradientOptions({ ui, app }) {
  const { gradient } = ui;
  const set = (/** @type {Partial<GradientUi>} */ changes) =>
    app.store.set((state) => ({ gradient: { ...state.gradient, ...changes } }));
  return html`
    <${Choice} label=${words.gradientOptions.shape} value=${gradient.shape} choices=${GRADIENT_SHAPES}
      change=${(/** @type {any} */ shape) => set({ shape })} />
    <${Choice} label=${words.gradientOptions.effect} value=${gradient.isAdjusting} choices=${EFFECTS}
      change=${(/** @type {boolean} */ isAdjusting) => set({ isAdjusting })} />
    ${
      gradient.isAdjusting
        ? html`<${NumberField} label=${words.gradientOptions.brighter} value=${gradient.stops} min=${-8} max=${8} step=${0.1}
            unit=${words.gradientOptions.st} change=${(/** @type {number} */ stops) => set({ stops })} />
          <${NumberField} label=${words.gradientOptions.warmer} value=${gradient.mired} min=${-300} max=${300} step=${5} digits=${0}
            unit=${words.gradientOptions.mired} change=${(/** @type {number} */ mired) => set({ mired })} />`
        : html`<${Choice} label=${words.gradientOptions.end} value=${gradient.hasEnd} choices=${endsOf(ui)}
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
