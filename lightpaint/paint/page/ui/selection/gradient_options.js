/** The options of the gradient tool, above the pictures. */

import { warmer, toHex } from '../../../../viewer/drawing/colour.js';
import { html } from '../../vendor/preact.js';
import { Choice, NumberField, Button } from '../controls.js';
import { paintOf, exposureOf } from '../display_state.js';
import { t } from '../../language/language.js';
import { shortcutsOf } from '../key_bindings.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { Gradient, Layer } from '../../engine/messages.js' */

const GRADIENT_SHAPES = [
  { value: 'linear', label: t('Linear'), tip: t('From one line to another') },
  { value: 'radial', label: t('Radial'), tip: t('Around the place where the drag begins') },
];

const EFFECTS = [
  { value: false, label: t('Paint'), tip: t('Light of the current colour') },
  { value: true, label: t('Adjust'), tip: t('Brighter and warmer by numbers') },
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
  const set = (/** @type {Partial<Ui["gradient"]>} */ changes) =>
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

/** @param {{ui: Ui, gradient: Gradient, set: (made: Partial<Layer>, label: string) => void}} props */
export function GradientFields({ ui, gradient, set }) {
  const change = (/** @type {Partial<Gradient>} */ made) =>
    set({ gradient: { ...gradient, ...made } }, t('gradient'));
  const [rows, columns] = ui.state?.size ?? [1, 1];
  const field = (
    /** @type {"start" | "end"} */ end,
    /** @type {0 | 1} */ k,
    /** @type {string} */ label,
  ) =>
    html`<${NumberField} label=${label} value=${gradient[end][k]} min=${-4 * columns} max=${4 * Math.max(rows, columns)}
      digits=${0} unit=${t('px')} change=${(/** @type {number} */ to) => {
        /** @type {[number, number]} */
        const place = [...gradient[end]];
        place[k] = to;
        change({ [end]: place });
      }} />`;
  const paint = paintOf(ui);
  return html`<div class="gradient-fields" data-numbers>
    <${Choice} label=${t('Shape')} value=${gradient.shape} choices=${GRADIENT_SHAPES}
      change=${(/** @type {any} */ shape) => change({ shape })} />
    <div class="gradient-place" role="group" aria-label=${t('Start')}>${field('start', 0, t('From x'))}${field('start', 1, 'y')}</div>
    <div class="gradient-place" role="group" aria-label=${t('End')}>${field('end', 0, t('To x'))}${field('end', 1, 'y')}</div>
    ${
      gradient.light &&
      html`<div class="row">
        <${Light} ui=${ui} light=${gradient.light} />
        <${Button} label=${t('Start in current colour')} act=${() => change({ light: paint })} />
      </div>
      <div class="row">
        <${Light} ui=${ui} light=${gradient.end_light} />
        <${Button} label=${t('End in it')} act=${() => change({ end_light: paint })} />
        <${Button} label=${t('Fade out')} disabled=${!gradient.end_light} act=${() => change({ end_light: null })} />
      </div>`
    }
  </div>`;
}

/** The light at an end; a crossed field for none. @param {{ui: Ui, light: Gradient["light"]}} props */
function Light({ ui, light }) {
  const shown = light?.map((x) => x * 2 ** exposureOf(ui.state));
  return html`<i class=${shown ? 'gradient-light' : 'gradient-light is-none'} aria-hidden="true"
    style=${shown ? { background: toHex(shown) } : {}}></i>`;
}
