/** The brush over the pictures, and what lies under it. */

import { paneAt } from './pointer.js';

/** @typedef {import('./engine.js').Engine} Engine */
/** @typedef {import('./model.js').Ui} Ui */
/** @typedef {import('./model.js').UiStore} UiStore */

/**
 * The brush at a place, or where it was: one ring under the pointer, a fainter one at the same place
 * of the other picture.
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
  // What changes while no pointer is there brings no brush back.
  if (rings.hidden && x === Number(rings.dataset.x) && y === Number(rings.dataset.y)) return;
  rings.dataset.x = String(x);
  rings.dataset.y = String(y);
  const pane = paneAt(engine, x, y);
  const others = engine.panes().filter((one) => one !== pane && ui.show.layout === 'side');
  const [own, twin] = /** @type {HTMLElement[]} */ ([...rings.children]);
  rings.hidden = !pane;
  if (!pane) return;
  const isPoint =
    ['pick', 'fill'].includes(ui.tool) || (ui.tool === 'ask' && ui.about === 'object');
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

/** @type {WeakMap<UiStore, number>} */
const waiting = new WeakMap();

/** Say what is under the pointer, once a frame. @param {Engine} engine @param {UiStore} store
 * @param {number} x @param {number} y */
export function point(engine, store, x, y) {
  if (waiting.has(store)) return;
  waiting.set(
    store,
    requestAnimationFrame(() => {
      waiting.delete(store);
      const pane = paneAt(engine, x, y);
      const found =
        pane && engine.pointed((x - pane.left) / pane.scale, (y - pane.top) / pane.scale);
      if (found || store.value.pointed) store.set({ pointed: found });
    }),
  );
}
