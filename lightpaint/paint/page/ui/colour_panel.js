/** The colour of the paint as white, HSV, RGB or hex, its brightness, and swatches. */

import { html } from '../vendor/preact.js';
import { fromHex, fromKelvin, toHex } from '../../../viewer/drawing/colour.js';
import { ColourMixer } from './colour_mixers.js';
import { Slider } from './controls.js';
import { signedText } from './format.js';
import { paintOf } from './display_state.js';
import { t } from '../language/language.js';

/** @import { App, RGB, Ui } from './ui_state.js' */

/** Warm is right, as on the sliders and in an adjusting drag. */
const WHITES = [9000, 6500, 5600, 4300, 3200, 2700, 1900];
const GELS = [
  [t('Red'), '#ff2a1a'],
  [t('Amber'), '#ff9a1f'],
  [t('Green'), '#35d04a'],
  [t('Cyan'), '#2fd6e0'],
  [t('Blue'), '#2a55ff'],
  [t('Magenta'), '#e02fd0'],
  [t('Black'), '#000000'],
];

/** @param {{ui: Ui, app: App}} props */
export function ColourPanel({ ui, app }) {
  const { store } = app;
  const set = (/** @type {RGB} */ colour) => store.set({ colour });
  return html`<div class="colour">
    <${ColourMixer} colour=${ui.colour} set=${set} mixer=${ui.mixer}
      swatch=${html`<span class="patch" data-tip=${t('Left: the colour. Right: how the display shows it at this brightness.')}
        style=${{ '--colour': toHex(ui.colour), '--shown': displayColour(ui, app) }}></span>`}
      choose=${(/** @type {any} */ mixer) => store.set({ mixer })} />
    <${Slider} label=${t('Brightness')} value=${ui.stops} min=${-8} max=${8} step=${0.1} digits=${1}
      unit=${t('st')} resetValue=${0} tip=${t('Stops above display white. Paint can be brighter than white.')}
      change=${(/** @type {number} */ stops) => store.set({ stops })} />
    <${Swatches} ui=${ui} app=${app} />
  </div>`;
}

/** Return the display colour of the current paint on white. @param {Ui} ui @param {App} app */
export function displayColour(ui, { engine }) {
  return `rgb(${engine.codes(paintOf(ui), ui.display.stops).join(' ')})`;
}

/** @param {{ui: Ui, app: App}} props */
function Swatches({ ui, app }) {
  const { store } = app;
  const swatch = (/** @type {RGB} */ rgb, /** @type {string} */ tip, /** @type {number} */ stops) =>
    html`<${Swatch} key=${tip} rgb=${rgb} tip=${tip}
      act=${() => store.set({ colour: rgb, stops })} />`;
  const gels = GELS.map(([name, hex]) => ({ name, rgb: /** @type {RGB} */ (fromHex(hex)) }));
  return html`<div class="swatches" role="group" aria-label=${t('Swatches')}>
    ${WHITES.map((kelvin) => swatch(fromKelvin(kelvin), t('{kelvin} K', { kelvin }), ui.stops))}
    ${gels.map(({ name, rgb }) => swatch(rgb, name, ui.stops))}
  </div>
  <div class="swatches is-recent" role="group" aria-label=${t('Recent colours')}>
    ${!ui.recent.length && html`<span class="faint">${t('Recent colours')}</span>`}
    ${ui.recent.map(({ colour, stops }, k) => {
      const stopsLabel = signedText(stops, Math.abs(stops - Math.round(stops)) < 0.05 ? 0 : 1);
      const brightness = stopsLabel === '0' ? '' : t(', {stops} stops', { stops: stopsLabel });
      return html`<${Swatch} key=${k} rgb=${colour} stops=${brightness && stopsLabel}
        tip=${t('Recent {number}: {colour}{brightness}', { number: k + 1, colour: toHex(colour), brightness })}
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
