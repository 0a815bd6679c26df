/** The brush cursor over the pictures, and the light and object under it. */

import { paneAt } from './pointer_input.js';

/** @typedef {import('./engine_interface.js').Engine} Engine */
/** @typedef {import('./ui_state.js').Ui} Ui */
/** @typedef {import('./ui_state.js').UiStore} UiStore */

/**
 * Draw the brush at a place, or at its last one: a ring under the pointer, and a fainter one at the
 * same place in the other picture.
 * @param {HTMLElement | null} rings @param {Engine} engine @param {Ui} ui
 * @param {number} [x] @param {number} [y]
 */
export function ring(
  rings,
  engine,
  ui,
  x = Number(rings?.dataset.x),
  y = Number(rings?.dataset.y),
) {
  if (!rings || !Number.isFinite(x)) return;
  // Changes while no pointer is there do not show the brush again.
  if (rings.hidden && x === Number(rings.dataset.x) && y === Number(rings.dataset.y)) return;
  rings.dataset.x = String(x);
  rings.dataset.y = String(y);
  const pane = paneAt(engine, x, y);
  const others = engine.panes().filter((one) => one !== pane && ui.show.layout === 'side');
  const [own, twin] = /** @type {HTMLElement[]} */ ([...rings.children]);
  rings.hidden = !pane;
  if (!pane) return;
  const isPoint =
    ['pick', 'fill'].includes(ui.tool) || (ui.tool === 'adjust' && ui.about === 'object');
  const size = isPoint ? 14 : Math.max(4, ui.size * pane.scale);
  place(own, x, y, size, ui.hardness);
  twin.hidden = !others.length;
  if (others.length)
    place(twin, x - pane.left + others[0].left, y - pane.top + others[0].top, size, 1);
}

/** @param {HTMLElement} element @param {number} x @param {number} y @param {number} size
 * @param {number} hardness */
function place(element, x, y, size, hardness) {
  element.style.width = element.style.height = `${size}px`;
  element.style.transform = `translate(${x - size / 2}px, ${y - size / 2}px)`;
  element.style.setProperty('--hard', String(hardness));
}

/** Pointer places to report in the next frame.
 * @type {WeakMap<UiStore, {x: number, y: number, frame: number}>} */
const waiting = new WeakMap();

/** Last place of the pointer. @type {WeakMap<UiStore, {x: number, y: number}>} */
const last = new WeakMap();

/** Report what is under the pointer, once per frame. @param {Engine} engine @param {UiStore} store
 * @param {number} x @param {number} y */
export function point(engine, store, x, y) {
  last.set(store, { x, y });
  const place = waiting.get(store) ?? { x, y, frame: 0 };
  Object.assign(place, { x, y });
  if (waiting.has(store)) return;
  waiting.set(store, place);
  place.frame = requestAnimationFrame(() => {
    waiting.delete(store);
    const pane = paneAt(engine, place.x, place.y);
    const pointed = pane && pointedIn(engine, pane, place.x, place.y);
    if (pointed || store.value.pointed) store.set({ pointed });
  });
}

/** The pointer has left the pictures. @param {UiStore} store */
export function pointAway(store) {
  cancelAnimationFrame(waiting.get(store)?.frame ?? 0);
  waiting.delete(store);
  last.delete(store);
  store.set({ pointed: null });
}

/** The pictures have changed under a resting pointer. @param {Engine} engine
 * @param {UiStore} store */
export function pointAgain(engine, store) {
  const place = last.get(store);
  if (place) point(engine, store, place.x, place.y);
}

/** @param {Engine} engine @param {import('./engine_interface.js').Pane} pane @param {number} x
 * @param {number} y @returns {import('./engine_interface.js').Pointed | null} */
function pointedIn(engine, { kind, left, top, scale }, x, y) {
  const [px, py] = [(x - left) / scale, (y - top) / scale];
  const found = engine.pointed(px, py);
  if (!found) return null;
  const light = engine.lightAt(kind, px, py);
  return { ...found, light, paint: engine.paintAt(kind, px, py, light) };
}
