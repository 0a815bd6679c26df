/** The options of the gradient tool, above the pictures. */

import { warmer } from '../../../../viewer/drawing/colour.js';
import { html } from '../../vendor/preact.js';
import { Choice, NumberField } from '../controls.js';
import { paintOf } from '../display_state.js';
import { t } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./gradient_settings.js").GradientUi} GradientUi */

export const GRADIENT_SHAPES = [
  {
    value: 'linear',
    label: t('Linear'),
    tip: t('From one line to another'),
  },
  {
    value: 'radial',
    label: t('Radial'),
    tip: t('Around the place where the drag begins'),
  },
];

const EFFECTS = [
  {
    value: false,
    label: t('Paint'),
    tip: t('Light of the current colour'),
  },
  {
    value: true,
    label: t('Adjust'),
    tip: t('Brighter and warmer by numbers'),
  },
];

/** @param {Ui} ui */
const endsOf = (ui) => [
  { value: false, label: t('To nothing'), tip: t('It fades out') },
  {
    value: true,
    label: t('To 2nd colour'),
    tip: t('It becomes the second colour. The key swaps the two.'),
    keys: shortcutsOf(ui, 'swap'),
  },
];

/** @param {{ui: Ui, app: App}} props */
export function GradientOptions({ ui, app }) {
  const { gradient } = ui;
  const set = (/** @type {Partial<GradientUi>} */ changes) =>
    app.store.set((state) => ({ gradient: { ...state.gradient, ...changes } }));
  return html`
    <${Choice} label=${t('Shape')} value=${gradient.shape} choices=${GRADIENT_SHAPES}
      change=${(/** @type {any} */ shape) => set({ shape })} />
    <${Choice} label=${t('Effect')} value=${gradient.isAdjusting} choices=${EFFECTS}
      change=${(/** @type {boolean} */ isAdjusting) => set({ isAdjusting })} />
    ${
      gradient.isAdjusting
        ? html`<${NumberField} label=${t('Brighter')} value=${gradient.stops} min=${-8} max=${8} step=${0.1}
            unit=${t('st')} change=${(/** @type {number} */ stops) => set({ stops })} />
          <${NumberField} label=${t('Warmer')} value=${gradient.mired} min=${-300} max=${300} step=${5} digits=${0}
            unit=${t('mired')} change=${(/** @type {number} */ mired) => set({ mired })} />`
        : html`<${Choice} label=${t('End')} value=${gradient.hasEnd} choices=${endsOf(ui)}
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
