/** What rows of the light list share, of lights and of lights that are images. */

import { html } from '../vendor/preact.js';
import { Button, Slider } from './controls.js';
import { percentText, stopsText } from './format.js';
import { Icon } from './icons.js';
import { DIMMER_MAX_STOPS, DIMMER_MIN_STOPS, LevelField, stopsOf } from './level_field.js';
import { luminance } from '../../../viewer/drawing/colour.js';
import { t } from '../language/language.js';

/** @import { App, Light, RGB } from './ui_state.js' */

/** The box in the corner of a row that selects it.
 * @param {{label: string, isSelected: boolean, select: (event: MouseEvent) => void}} props */
export function Pick({ label, isSelected, select }) {
  return html`<button type="button" class="pick" role="checkbox" aria-checked=${String(isSelected)}
    aria-label=${t('Select {label}', { label })} onClick=${select}
    data-tip=${t('Select, for one action on several lights; with Shift all from the last one')}>${
      isSelected && html`<${Icon} name="check" />`
    }</button>`;
}

/** Buttons for what the page shows.
 * @param {{label: string, isSolo: boolean, isMute: boolean, toggle: (key: "solo" | "mute") => void}} props */
export function DisplayButtons({ label, isSolo, isMute, toggle }) {
  return html`<span class="marks" role="group" aria-label=${t('Display', { context: 'verb' })}>
    <${Button} label=${t('S')} class="letter" pressed=${isSolo} act=${() => toggle('solo')}
      tip=${t('Solo: show {label} alone. The answer does not change.', { label })} />
    <${Button} label=${t('M')} class="letter" pressed=${isMute} act=${() => toggle('mute')}
      tip=${t('Mute: show the picture without {label}. The answer does not change.', { label })} />
  </span>`;
}

/** @param {{label: string, isLocked: boolean, lock: () => void}} props */
export function LockButton({ label, isLocked, lock }) {
  return html`<${Button} icon="lock" pressed=${isLocked} act=${lock} tip=${
    isLocked
      ? t('Unlock {label}: the solve sets it again', { label })
      : t('Lock {label} as it is in the answer', { label })
  } />`;
}

/** The colour of a light, and its value in words. @param {{level: number, swatch: string | undefined,
 * value: string, tip: string}} props */
export function LightValue({ level, swatch, value, tip }) {
  const isOn = level > 0;
  return html`<span class=${`dot ${isOn ? '' : 'is-off'}`} aria-hidden="true"
      style=${{ background: isOn ? swatch : 'none' }}></span>
    <span class="values" data-tip=${isOn ? tip : undefined}>${isOn ? value : t('off')}</span>`;
}

/** The dimmer of a row, in stops from now, and the field beside it. scale: sets stops; the left end
 * is off. change: sets a level that was typed.
 * @param {{light: Light, rgb: RGB, label: string, app: App, isHeld: boolean, disabled?: boolean,
 *   scale: (stops: number, isFinal: boolean) => void, change: (rgb: RGB) => void}} props */
export function Dimmer({ light, rgb, label, app, isHeld, disabled = false, scale, change }) {
  const stops = stopsOf(rgb, light) ?? DIMMER_MIN_STOPS;
  return html`<div class=${`dimmer ${isHeld ? 'is-held' : ''}`}>
    <${Slider} plain label=${t('{label}, stops from now', { label })} value=${clampStops(stops)}
      min=${DIMMER_MIN_STOPS} max=${DIMMER_MAX_STOPS} step=${0.05} resetValue=${0}
      text=${luminance(rgb) > 0 ? stopsText(stops) : t('off')} disabled=${disabled} change=${scale} />
    <${LevelField} light=${light} rgb=${rgb} disabled=${disabled}
      say=${(/** @type {string} */ words) => app.session.toast(words)} change=${change} />
  </div>`;
}

/** Return stops within the ends of the dimmer. @param {number} stops */
const clampStops = (stops) => Math.min(DIMMER_MAX_STOPS, Math.max(DIMMER_MIN_STOPS, stops));

/** @param {{share: number, pointerShare?: number}} props */
export function Share({ share, pointerShare }) {
  const isAtPointer = pointerShare !== undefined;
  const value = isAtPointer ? pointerShare : share;
  return html`<span class=${`share ${isAtPointer ? 'is-here' : ''}`}
    data-tip=${isAtPointer ? t('Share of the light here') : t("Share of the picture's light")}>
    <i style=${{ '--share': String(value) }}></i><span>${percentText(value)}</span></span>`;
}
