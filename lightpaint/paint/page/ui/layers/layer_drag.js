/** Dragging a layer to another place of the list, by mouse, pen or finger. */

import { dragItem } from '../item_drag.js';
import { movedLayer } from './layer_order.js';

/** @typedef {import("../shortcuts.js").App} App */

/** Pixels from the left of the list beyond which a layer below a group's last member joins it. */
const INDENT = 24;

/** Begin a drag, if a press becomes one. Fingers drag by the grip, since elsewhere they scroll.
 * @param {PointerEvent} event on the list @param {App} app */
export function dragLayer(event, app) {
  const target = /** @type {HTMLElement} */ (event.target);
  const isGrip = Boolean(target.closest('.grip'));
  const isHandle = isGrip || (event.pointerType === 'mouse' && target.closest('.layer-name, .layer-thumb'));
  const row = /** @type {HTMLElement | null} */ (target.closest('[data-layer]'));
  if (!row || !isHandle || event.button !== 0) return;
  const list = /** @type {HTMLElement} */ (event.currentTarget);
  const id = Number(row.dataset.layer);
  dragItem(event, row, {
    move: (now) => {
      app.store.set({ hoveredLayer: null });
      mark(list, placeAt(list, now, id));
    },
    drop: (last) => {
      const place = placeAt(list, last, id);
      if (place) app.engine.changeLayers(movedLayer(app.store.value.layers, id, place.before, place.group));
    },
  });
  if (isGrip) event.preventDefault();
}

/** Return before which layer, and into which group, a drag drops a layer; null where it is.
 * @param {HTMLElement} list @param {PointerEvent} event @param {number} id
 * @returns {{before: number | null, group: number | null} | null} */
function placeAt(list, event, id) {
  const rows = /** @type {HTMLElement[]} */ ([...list.querySelectorAll('[data-layer]')]);
  const own = rows.find((row) => Number(row.dataset.layer) === id);
  const isGroup = Boolean(own?.querySelector('.layer-fold'));
  const at = rows.findIndex((row) => {
    const line = /** @type {HTMLElement} */ (row.querySelector('.layer-line'));
    const { top, height } = line.getBoundingClientRect();
    return event.clientY < top + height / 2;
  });
  const [above, below] = [rows[at < 0 ? rows.length - 1 : at - 1], at < 0 ? undefined : rows[at]];
  const isInner = (/** @type {HTMLElement | undefined} */ row) =>
    Boolean(row?.classList.contains('is-inner'));
  const headOf = (/** @type {HTMLElement | undefined} */ row) => {
    let found = row;
    while (found && isInner(found)) found = /** @type {any} */ (found.previousElementSibling);
    return found ? Number(found.dataset.layer) : null;
  };
  const before = below ? Number(below.dataset.layer) : null;
  if (isGroup) return isInner(below) || before === id ? null : { before, group: null };
  const isFurther = event.clientX - list.getBoundingClientRect().left > INDENT;
  const isAfterHead = Boolean(above?.querySelector('.layer-fold'));
  const isIn = isInner(below) || (isFurther && (isAfterHead || isInner(above)) && above !== own);
  return { before: before === id ? nextOf(rows, at) : before, group: isIn ? headOf(isInner(below) ? below : above) : null };
}

/** @param {HTMLElement[]} rows @param {number} at */
const nextOf = (rows, at) => (rows[at + 1] ? Number(rows[at + 1].dataset.layer) : null);

/** Mark where a layer would be dropped. @param {HTMLElement} list
 * @param {{before: number | null, group: number | null} | null} place */
function mark(list, place) {
  const rows = /** @type {HTMLElement[]} */ ([...list.querySelectorAll('[data-layer]')]);
  for (const row of rows) delete row.dataset.drop;
  if (!place) return;
  const row = rows.find(({ dataset }) => Number(dataset.layer) === place.before);
  const inner = place.group === null ? '' : ' inner';
  if (row) row.dataset.drop = `before${inner}`;
  else if (rows.length) rows[rows.length - 1].dataset.drop = `after${inner}`;
}
