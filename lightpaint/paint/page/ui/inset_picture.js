/** The small picture in a corner of a large one: a press makes it large, a drag takes it elsewhere. */

import { html, useRef } from '../vendor/preact.js';
import { updateDisplay } from './tools.js';
import { t } from '../language/language.js';

/** @import { Display, Pane, UiStore } from './ui_state.js' */

/** Pixels after which a press is a drag. */
const THRESHOLD = 6;

/** Make the small picture the large one. @param {UiStore} store */
export const swapInset = (store) =>
  updateDisplay(store, { large: store.value.display.large === 'left' ? 'right' : 'left' });

/** Return the large picture and the small one; of other layouts all, and none. @param {Display} display
 * @param {Pane[]} panes @returns {{main: Pane[], inset: Pane | null}} */
export function splitPanes({ layout }, panes) {
  const inset = layout === 'inset' ? (panes[1] ?? null) : null;
  return { main: inset ? panes.slice(0, 1) : panes, inset };
}

/** Return a clip path around the small picture, for what is drawn over the large one.
 * @param {Pane | null} inset */
export function aroundInset(inset) {
  if (!inset) return {};
  const { x, y, width, height } = inset;
  const corners = [[x, y], [x, y + height], [x + width, y + height], [x + width, y], [x, y]];
  const hole = corners.map((corner) => corner.map((length) => `${length}px`).join(' ')).join(', ');
  return { '--around-inset': `polygon(evenodd, 0 0, 100% 0, 100% 100%, 0 100%, 0 0, ${hole})` };
}

/** Return the corner that is nearest to a place. @param {number} x @param {number} y
 * @param {{width: number, height: number}} area @returns {Display["corner"]} */
const nearestCorner = (x, y, { width, height }) =>
  `${y < height / 2 ? 'top' : 'bottom'}-${x < width / 2 ? 'left' : 'right'}`;

/** Return the corner that an arrow key leads to. @param {Display["corner"]} corner
 * @param {string} key @returns {Display["corner"] | null} null for other keys */
function steppedCorner(corner, key) {
  const [row, column] = corner.split('-');
  const side = /** @type {Record<string, string>} */ ({
    ArrowUp: `top-${column}`,
    ArrowDown: `bottom-${column}`,
    ArrowLeft: `${row}-left`,
    ArrowRight: `${row}-right`,
  })[key];
  return /** @type {Display["corner"] | undefined} */ (side) ?? null;
}

/** A button over the small picture. @param {{inset: Pane | null, name: string,
 *   corner: Display["corner"], store: UiStore}} props */
export function InsetFrame({ inset, name, corner, store }) {
  const press = useRef(/** @type {{x: number, y: number, isDrag: boolean} | null} */ (null));
  const wasDrag = useRef(false);
  if (!inset) return null;
  const button = (/** @type {Event} */ event) => /** @type {HTMLElement} */ (event.currentTarget);
  const shift = (/** @type {HTMLElement} */ element, x = 0, y = 0) =>
    (element.style.transform = x || y ? `translate(${x}px, ${y}px)` : '');
  const begin = (/** @type {PointerEvent} */ event) => {
    event.stopPropagation(); // paint is for the large picture
    wasDrag.current = false;
    if (event.button !== 0) return;
    button(event).setPointerCapture(event.pointerId);
    press.current = { x: event.clientX, y: event.clientY, isDrag: false };
  };
  const move = (/** @type {PointerEvent} */ event) => {
    const { current } = press;
    if (!current) return;
    event.stopPropagation();
    const [dx, dy] = [event.clientX - current.x, event.clientY - current.y];
    current.isDrag ||= Math.hypot(dx, dy) > THRESHOLD;
    if (current.isDrag) shift(button(event), dx, dy);
  };
  const end = (/** @type {PointerEvent} */ event) => {
    const { current } = press;
    press.current = null;
    if (!current) return;
    event.stopPropagation();
    wasDrag.current = current.isDrag;
    shift(button(event));
    const area = button(event).parentElement;
    if (!current.isDrag || !area || event.type !== 'pointerup') return;
    const { left, top, width, height } = area.getBoundingClientRect();
    const place = nearestCorner(event.clientX - left, event.clientY - top, { width, height });
    updateDisplay(store, { corner: place });
  };
  const key = (/** @type {KeyboardEvent} */ event) => {
    const next = steppedCorner(corner, event.key);
    if (next) updateDisplay(store, { corner: next });
    // The brush does not move by the same key, nor does Enter paint.
    if (next || event.key === 'Enter' || event.key === ' ') event.stopPropagation();
    if (next) event.preventDefault();
  };
  const { x, y, width, height } = inset;
  return html`<button type="button" class="inset-frame" aria-label=${t('Make it large: {name}', { name })}
    data-tip=${t('Press to make it large. Drag it, or press arrow keys, for another corner.')}
    style=${{ left: `${x}px`, top: `${y}px`, width: `${width}px`, height: `${height}px` }}
    onPointerDown=${begin} onPointerMove=${move} onPointerUp=${end} onPointerCancel=${end}
    onKeyDown=${key} onClick=${(/** @type {MouseEvent} */ { detail }) => {
      // The press that ends a drag is a click as well, which none of a key is.
      if (!detail || !wasDrag.current) swapInset(store);
    }} />`;
}
