/** A wheel of hue, around, and saturation, outwards. The sliders below it do the same by keyboard. */

import { html, useRef } from '../vendor/preact.js';
import { t } from '../language/language.js';

/** @typedef {(hue: number, saturation: number, isFinal: boolean) => void} SetHue */

/** Red is at the top, and hues go clockwise.
 * @param {{hue: number, saturation: number, set: SetHue}} props hue in degrees, saturation 0 to 1;
 *   isFinal: false while it is dragged */
export function ColourWheel({ hue, saturation, set }) {
  const pointer = useRef(/** @type {number | null} */ (null));
  const pick = (/** @type {PointerEvent} */ event, /** @type {boolean} */ isFinal) => {
    const wheel = /** @type {HTMLElement} */ (event.currentTarget);
    const { left, top, width, height } = wheel.getBoundingClientRect();
    const x = (2 * (event.clientX - left)) / width - 1;
    const y = (2 * (event.clientY - top)) / height - 1;
    const angle = (Math.atan2(x, -y) * 180) / Math.PI;
    set((angle + 360) % 360, Math.min(1, Math.hypot(x, y)), isFinal);
  };
  const down = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0 || pointer.current !== null) return;
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
    pointer.current = event.pointerId;
    pick(event, false);
  };
  const follow = (/** @type {boolean} */ isFinal) => (/** @type {PointerEvent} */ event) => {
    if (event.pointerId !== pointer.current) return;
    if (isFinal) pointer.current = null;
    pick(event, isFinal);
  };
  const angle = (hue * Math.PI) / 180;
  const place = {
    left: `${50 * (1 + saturation * Math.sin(angle))}%`,
    top: `${50 * (1 - saturation * Math.cos(angle))}%`,
  };
  return html`<div class="wheel" aria-hidden="true" data-tip=${t('Hue around the wheel, saturation outwards')} onPointerDown=${down}
    onPointerMove=${follow(false)} onPointerUp=${follow(true)} onPointerCancel=${follow(true)}>
    <i style=${place}></i></div>`;
}
