/** The lamps as somebody has set them as a start, which the solve improves and stays near. */

import { Button, Slider } from '../controls.js';
import { lockedLights } from '../tied_lights.js';
import { html } from '../../vendor/preact.js';
import { t } from '../../language/language.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Strengths of the pull at both ends of the slider, and the one that it begins with: at the first
 * it is not felt beside the paint, at the last the paint is hardly felt. */
const [LEAST, MOST, DEFAULT] = [0.01, 10, 0.1];

/** Strengths from the least to the most, in percent. */
const CURVE = {
  toPosition: (/** @type {number} */ near) =>
    (100 * Math.log(Math.max(near, LEAST) / LEAST)) / Math.log(MOST / LEAST),
  toValue: (/** @type {number} */ percent) =>
    Number((LEAST * (MOST / LEAST) ** (percent / 100)).toPrecision(3)),
};

/** The slider of the start; before it, the offer, which comes below the lights, where it moves no row.
 * @param {{ui: Ui, app: App}} props */
export function StartLamps({ ui, app }) {
  const { session } = app;
  if (!ui.isStarted)
    return (
      lockedLights(ui).length > 0 &&
      html`<div class="start-lamps"><${Button} label=${t('Start from my lamps')} class="wide"
        tip=${t('The lamps as they are now become the start: the solve improves them and stays near. Locked ones are released, and adjustments that they answer are hidden')}
        act=${() => session.send('start_from_lamps', { is_on: true })} /></div>`
    );
  const percent = CURVE.toPosition(ui.settings.near ?? DEFAULT);
  const set = (/** @type {number} */ value, /** @type {boolean} */ isFinal) => {
    const near = CURVE.toValue(value);
    if (isFinal) void session.changeSetting('near', near);
    else app.store.set({ settings: { ...ui.settings, near } });
  };
  return html`<div class="start-lamps" role="group" aria-label=${t('Start from my lamps')}>
    <${Slider} label=${t('Near my lamps')} value=${percent} min=${0} max=${100} step=${1} unit="%"
      resetValue=${CURVE.toPosition(DEFAULT)} change=${set}
      tip=${t('How near the solve stays to the lamps that you started from, where the paint does not say otherwise')} />
    <${Button} icon="close" tip=${t('Start from the scene again')}
      act=${() => session.send('start_from_lamps', { is_on: false })} />
  </div>`;
}
