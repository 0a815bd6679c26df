/** A label at the pointer: the adjustment of a drag, or the light that the picker would take. */

import { html, useLayoutEffect, useRef } from '../vendor/preact.js';
import { toHex } from '../../../viewer/drawing/colour.js';
import { paintText } from './format.js';
import { exposureOf } from './display_state.js';
import { paneAt } from './pointer_input.js';
import { luxAtPointer } from './planes/plane_overlay.js';
import { t } from '../language/language.js';

/** @import { Engine, Ui } from './ui_state.js' */

/** @param {{ui: Ui, engine: Engine, rings: {current: HTMLElement | null}}} props */
export function PointerLabel({ ui, engine, rings }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => {
    if (ref.current && rings.current) place(ref.current, rings.current, engine, ui);
  });
  const { dragAdjustment, probe, tool } = ui;
  if (dragAdjustment)
    return html`<div class="near asking" ref=${ref} role="status">${adjustmentText(dragAdjustment)}</div>`;
  const lux = luxAtPointer(ui);
  if (lux && !ui.isLive) return html`<div class="near" ref=${ref} aria-hidden="true">${lux}</div>`;
  if (tool !== 'pick' || !probe) return null;
  const exposedPaint = probe.paint.map((x) => Math.max(0, x) * 2 ** exposureOf(ui.state));
  return html`<div class="near picking" ref=${ref} aria-hidden="true">
    <i style=${{ background: toHex(exposedPaint) }}></i>${paintText(exposedPaint) || t('no light')}</div>`;
}

/** Above the brush, where no hand covers it, or beside it without room above; always within the
 * picture. @param {HTMLElement} element @param {HTMLElement} rings @param {Engine} engine
 * @param {Ui} ui */
function place(element, rings, engine, ui) {
  const { offsetWidth: width, offsetHeight: height } = element;
  const [x, y] = [Number(rings.dataset.x), Number(rings.dataset.y)];
  const pane = paneAt(engine, x, y) ?? engine.panes()[0];
  if (!pane || !Number.isFinite(x)) return;
  const gap = window.matchMedia('(pointer: coarse)').matches ? 56 : 22;
  const [rows, columns] = ui.state.size;
  const [left, top] = [Math.max(pane.x, pane.left), Math.max(pane.y, pane.top)];
  const right = Math.min(pane.x + pane.width, pane.left + columns * pane.scale) - width;
  const bottom = Math.min(pane.y + pane.height, pane.top + rows * pane.scale) - height;
  const isAbove = y - gap - height >= top;
  const besideX = x - gap - width >= left ? x - gap - width : x + gap;
  const labelX = clamp(isAbove ? x - width / 2 : besideX, left, right);
  const labelY = clamp(isAbove ? y - gap - height : y - height / 2, top, bottom);
  element.style.transform = `translate(${Math.round(labelX)}px, ${Math.round(labelY)}px)`;
}

/** @param {number} x @param {number} min @param {number} max */
const clamp = (x, min, max) => Math.max(min, Math.min(max, x));

/** @param {{stops: number, mired: number}} adjustment */
function adjustmentText({ stops, mired }) {
  const brightness =
    Math.abs(stops) >= 0.05 &&
    (stops > 0
      ? t('{stops} stops brighter', { stops: stops.toFixed(1) })
      : t('{stops} stops darker', { stops: (-stops).toFixed(1) }));
  const warmth =
    Math.abs(mired) >= 3 &&
    (mired > 0
      ? t('{mired} mired warmer', { mired: Math.round(mired) })
      : t('{mired} mired cooler', { mired: Math.abs(Math.round(mired)) }));
  return [brightness, warmth].filter(Boolean).join(', ') || t('no change');
}
