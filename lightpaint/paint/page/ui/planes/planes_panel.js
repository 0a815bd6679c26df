/** The panel of measuring planes: what the answer gives there, and what is wished for. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { Checkbox } from '../controls.js';
import { numberText } from '../format.js';
import { t } from '../../language/language.js';
import { drawPlane } from './plane_picture.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("../../engine/messages.js").MeasuredPlane} MeasuredPlane */
/** @typedef {import("../../engine/messages.js").PlaneLight} PlaneLight */
/** @typedef {import("../../engine/messages.js").PlaneWish} PlaneWish */

/** Standard errors of the ends of a 95 % interval. */
const NORMAL_95 = 1.96;

/** @param {number} lux */
const luxText = (lux) => t('{value} lx', { value: numberText(Number(lux.toPrecision(3))) });

/** @param {number} share */
const shareText = (share) => share.toFixed(2);

/** @param {{ui: Ui, app: App}} props */
export function PlanesPanel({ ui, app }) {
  const { planes: info, planesReading: reading } = ui;
  if (!info || !reading) return null;
  const most = Math.max(...reading.planes.map((plane) => plane.most));
  const ignores = Boolean(ui.settings.ignore_wishes);
  const hasWishes = reading.power || reading.planes.some(({ wishes }) => wishes.length);
  return html`<div class="planes">
    ${
      reading.is_old &&
      html`<p class="planes-note" role="status">${t('Lights have moved: these numbers are of before. They are being measured anew.')}</p>`
    }
    <ul>${info.planes.map(
      (plane, k) => html`<${PlaneRow} key=${plane.name} plane=${plane} light=${reading.planes[k]} most=${most} />`,
    )}</ul>
    ${reading.watts !== null && html`<${Power} watts=${reading.watts} area=${info.floor_m2} limit=${reading.power} />`}
    ${
      hasWishes &&
      html`<${Checkbox} label=${t('Answers meet the wishes')} checked=${!ignores}
        tip=${t('The answer comes as close to the paint as the wishes for planes leave. Off, only the paint counts.')}
        change=${(/** @type {boolean} */ isOn) => app.session.changeSetting('ignore_wishes', !isOn)} />`
    }
  </div>`;
}

/** A plane: its picture, its illuminance and its wishes.
 * @param {{plane: MeasuredPlane, light: PlaneLight, most: number}} props */
function PlaneRow({ plane, light, most }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useLayoutEffect(() => {
    if (canvas.current) drawPlane(canvas.current, plane, light.lux, most);
  }, [plane, light, most]);
  const range = { least: numberText(Math.round(light.least)), most: luxText(light.most) };
  const error = numberText(NORMAL_95 * light.mean_error, 1);
  return html`<li class="plane">
    <canvas ref=${canvas} role="img" aria-label=${t('Illuminance on {name}: {least} to {most}', { name: plane.name, ...range })}></canvas>
    <div><b>${plane.name}</b>
      <span class="plane-numbers" data-tip=${t('Mean illuminance ± {error} lx, and the darkest point over the mean', { error })}>${t('Em {lux}', { lux: luxText(light.mean) })}
        <span>${t('U0 {share}', { share: shareText(light.uniformity) })}</span></span>
      ${light.wishes.map((wish) => html`<${Wish} key=${wish.kind + wish.to} wish=${wish} />`)}
    </div>
  </li>`;
}

/** A wish, and whether it is met: by word and sign, and not by colour alone.
 * @param {{wish: PlaneWish}} props */
function Wish({ wish }) {
  const text = wish.is_met ? t('met') : t('missed');
  return html`<span class=${`plane-wish ${wish.is_met ? 'is-met' : 'is-missed'}`}>
    <i aria-hidden="true">${wish.is_met ? '✓' : '✕'}</i> ${wishText(wish)} <span>${text}</span></span>`;
}

/** Return what is wished for. @param {PlaneWish} wish */
function wishText({ kind, asked, to }) {
  if (kind === 'mean') return t('{lux} or more', { lux: luxText(asked) });
  if (kind === 'uniformity') return t('U0 {share} or more', { share: shareText(asked) });
  if (kind === 'max') return t('{lux} at most', { lux: luxText(asked) });
  if (kind === 'power') return t('{watts} W at most', { watts: numberText(asked) });
  return t('{share} of {name} or more', { share: shareText(asked), name: to });
}

/** The power of all lamps. @param {{watts: number, area: number | null, limit: PlaneWish | null}} props */
function Power({ watts, area, limit }) {
  const power = t('{watts} W', { watts: numberText(watts) });
  const density = area ? t('{value} W/m²', { value: numberText(watts / area, 2) }) : '';
  return html`<p class="plane-power"><b>${t('Power')}</b> ${[power, density].filter(Boolean).join(', ')}
    ${limit && html`<${Wish} wish=${limit} />`}</p>`;
}
