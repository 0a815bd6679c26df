/** A lasso over the pictures, which selects the lights whose marks it encloses. */

import { html, useRef, useState } from '../../vendor/preact.js';
import { isInside } from '../lamp_geometry.js';
import { t } from '../../language/language.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @typedef {[x: number, y: number]} Point */

/** @param {{ui: Ui, app: App}} props */
export function LampLasso({ ui, app }) {
  const [points, setPoints] = useState(/** @type {Point[]} */ ([]));
  const outline = useRef(/** @type {Point[]} */ ([]));
  if (!ui.isLassoing || !ui.areLampsMarked) return null;
  const { store } = app;
  const draw = (/** @type {PointerEvent} */ event, /** @type {Point[]} */ earlier) => {
    const { left, top } = /** @type {Element} */ (event.currentTarget).getBoundingClientRect();
    outline.current = [...earlier, [event.clientX - left, event.clientY - top]];
    setPoints(outline.current);
  };
  const begin = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0) return;
    event.stopPropagation();
    event.preventDefault();
    /** @type {Element} */ (event.currentTarget).setPointerCapture(event.pointerId);
    draw(event, []);
  };
  const move = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    if (outline.current.length) draw(event, outline.current);
  };
  const end = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation();
    const found = marksWithin(/** @type {Element} */ (event.currentTarget), outline.current);
    const lights = ui.lights.map((_, k) => k).filter((k) => found.has(ui.lights[k].label));
    outline.current = [];
    setPoints([]);
    store.set(({ selectedLights }) => ({
      isLassoing: false,
      selectedLights: isAdding(event) ? [...new Set([...selectedLights, ...lights])] : lights,
    }));
    if (!lights.length) app.session.toast(t('No light is marked there. Draw around the marks.'));
  };
  const cancel = () => {
    outline.current = [];
    setPoints([]);
  };
  return html`<svg class="lasso" onPointerDown=${begin} onPointerMove=${move} onPointerUp=${end}
    onPointerCancel=${cancel} role="presentation"><polygon points=${points.join(' ')} /></svg>`;
}

/** @param {PointerEvent} event */
const isAdding = ({ shiftKey, ctrlKey, metaKey }) => shiftKey || ctrlKey || metaKey;

/** Return the labels of the marks within an outline. @param {Element} lasso @param {Point[]} outline
 * @returns {Set<string>} */
function marksWithin(lasso, outline) {
  const { left, top } = lasso.getBoundingClientRect();
  const marks = /** @type {HTMLElement[]} */ ([
    ...(lasso.parentElement?.querySelectorAll('.lamp[data-lamp]') ?? []),
  ]);
  const isWithin = (/** @type {HTMLElement} */ mark) => {
    const box = mark.getBoundingClientRect();
    return isInside(outline, (box.left + box.right) / 2 - left, (box.top + box.bottom) / 2 - top);
  };
  return new Set(marks.filter(isWithin).map((mark) => mark.dataset.lamp ?? ''));
}
