/** The panel of measuring planes: what the answer gives there, and what is wished for. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { Button, Checkbox, Select } from '../controls.js';
import { overlayOf } from '../display_state.js';
import { numberText } from '../format.js';
import { updateDisplay } from '../tools.js';
import { toggled } from '../ui_store.js';
import { t } from '../../language/language.js';
import { cellsInView } from './plane_cells.js';
import { caseOf, casesOf, hasPlanesInView } from './plane_overlay.js';
import { drawPlane, luxText, scaleTop } from './plane_picture.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { MeasuredPlane, PlaneLight, PlaneWish } from '../../engine/messages.js' */

/** Standard errors of the ends of a 95 % interval. */
const NORMAL_95 = 1.96;

/** @param {number} share */
const shareText = (share) => share.toFixed(2);

/** @param {{ui: Ui, app: App}} props */
export function PlanesPanel({ ui, app }) {
  const { planes: info, planesReading: reading } = ui;
  if (!info || !reading) return null;
  const ignores = Boolean(ui.settings.ignore_wishes);
  const hasWishes = reading.power || reading.planes.some(({ wishes }) => wishes.length);
  return html`<div class="planes">
    ${
      reading.is_old &&
      html`<p class="planes-note" role="status">${t('Lights have moved: these numbers are of before. They are being measured anew.')}</p>`
    }
    ${info.planes.length > 0 && html`<${OverlaySwitch} ui=${ui} app=${app} />`}
    <ul>${info.planes.map(
      (plane, k) => html`<${PlaneRow} key=${plane.name} plane=${plane} light=${reading.planes[k]}
        most=${scaleTop(info, reading, plane.case)} extra=${html`<${EyeButton} ui=${ui} app=${app} index=${k} />`} />`,
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

/** The switch of the false colours in the pictures, and the case that they show.
 * @param {{ui: Ui, app: App}} props */
function OverlaySwitch({ ui, app }) {
  const { store } = app;
  if (!hasPlanesInView(ui))
    return html`<p class="planes-note">${t('This camera bends the picture: planes cannot be drawn in it.')}</p>`;
  const isOn = overlayOf(ui) === 'lux';
  const cases = casesOf(ui.planes);
  return html`<${Checkbox} label=${t('Lux in the picture')} checked=${isOn}
      tip=${t('Draws the planes in the picture of the answer, in false colours. Rest the pointer on them for lx.')}
      change=${(/** @type {boolean} */ isSet) => updateDisplay(store, { overlay: isSet ? 'lux' : null })} />
    ${
      isOn &&
      cases.length > 1 &&
      html`<${Select} label=${t('Case')} value=${caseOf(ui)} choices=${cases.map((name) => ({ value: name, label: name }))}
        change=${(/** @type {string} */ planeCase) => store.set({ planeCase })} />`
    }`;
}

/** The button that hides a plane in the pictures, where it can be seen in this one.
 * @param {{ui: Ui, app: App, index: number}} props */
function EyeButton({ ui, app, index }) {
  if (!ui.planes || overlayOf(ui) !== 'lux') return null;
  const { plane: name, case: ownCase } = ui.planes.planes[index];
  if (ownCase !== caseOf(ui)) return null;
  if (!cellsInView(ui.planes, ui.view).some(({ plane }) => plane === index))
    return html`<span class="faint" data-tip=${t('Something covers it, or it lies behind the camera')}>${t('not in view')}</span>`;
  const isHidden = ui.hiddenPlanes.includes(name);
  const toggle = () =>
    app.store.set(({ hiddenPlanes }) => ({ hiddenPlanes: toggled(hiddenPlanes, name) }));
  return html`<${Button} icon=${isHidden ? 'hidden' : 'eye'} act=${toggle}
    tip=${isHidden ? t('Show {name} in the picture', { name }) : t('Hide {name} in the picture', { name })} />`;
}

/** A plane: its picture, its illuminance and its wishes.
 * @param {{plane: MeasuredPlane, light: PlaneLight, most: number, extra: any}} props */
function PlaneRow({ plane, light, most, extra }) {
  const canvas = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useLayoutEffect(() => {
    if (canvas.current) drawPlane(canvas.current, plane, light.lux, most);
  }, [plane, light, most]);
  const range = { least: numberText(Math.round(light.least)), most: luxText(light.most) };
  const error = numberText(NORMAL_95 * light.mean_error, 1);
  return html`<li class="plane">
    <canvas ref=${canvas} role="img" aria-label=${t('Illuminance on {name}: {least} to {most}', { name: plane.name, ...range })}></canvas>
    <div><div class="plane-head"><b>${plane.name}</b>${extra}</div>
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
