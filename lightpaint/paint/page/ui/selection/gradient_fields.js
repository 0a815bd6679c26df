/** A gradient in numbers, among the controls of its layer. */

import { html } from '../../vendor/preact.js';
import { Button, Choice, NumberField } from '../controls.js';
import { toHex } from '../paint_colour.js';
import { exposureOf, paintOf } from '../display_state.js';
import { GRADIENT_SHAPES } from './gradient_options.js';
import { t } from '../../language/language.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../../engine/messages.js").Gradient} Gradient */
/** @typedef {import("../../engine/messages.js").Layer} Layer */

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
