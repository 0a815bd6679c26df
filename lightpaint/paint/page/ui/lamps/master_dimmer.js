/** The dimmer of all lights together, over the answer. */

import { Button, Slider } from '../controls.js';
import { percentText, stopsText } from '../format.js';
import { html } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../ui_state.js").Ui} Ui */

const TIP = t(
  'Dims what is shown and exported. The painting, the solve and the levels below stay as they are.',
);

/** @param {{ui: Ui, app: App}} props */
export function MasterDimmer({ ui, app }) {
  const { master } = ui;
  const isFull = master === 1;
  const stops = master > 0 ? stopsText(Math.log2(master)) : t('off');
  const set = (/** @type {number} */ percent, /** @type {boolean} */ isFinal) =>
    void app.session.setMaster(percent / 100, isFinal);
  return html`<div class=${`master ${isFull ? '' : 'is-set'}`} role="group" aria-label=${t('Master dimmer')}>
    <${Slider} label=${t('Master')} value=${100 * master} min=${0} max=${200} step=${1} unit="%"
      resetValue=${100} tip=${TIP} text=${`${percentText(master)}, ${stops}`} change=${set} />
    <span class="stops" aria-hidden="true">${isFull ? '' : stops}</span>
    ${!isFull && html`<${Button} icon="undo" tip=${t('Master to 100 %')} act=${() => set(100, true)} />`}
  </div>`;
}
