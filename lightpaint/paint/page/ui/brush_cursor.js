/** The brush cursor over the pictures, and the light and object under it. */

import { paneAt } from './pointer_input.js';

/** @import { Engine, Pane, RGB, Ui, UiStore } from './ui_state.js' */
/** What is under the pointer. place: column and row in the picture, not rounded. light: of the picture there.
 * paint: what to paint with, as the hand does, to have that light there.
 * @typedef {NonNullable<ReturnType<Engine["probe"]>> & {place: [number, number], light: RGB, paint: RGB}} Probe */

/** Draw the brush at a place, or at its last one: a ring under the pointer, and a fainter one at the
 * same place in the other picture.
 * @param {HTMLElement | null} rings @param {Engine} engine @param {Ui} ui
 * @param {number} [x] @param {number} [y] */
export function drawRings(
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
  const otherPanes = engine
    .panes()
    .filter((other) => other !== pane && ui.display.layout === 'side');
  const [ownRing, twinRing] = /** @type {HTMLElement[]} */ ([...rings.children]);
  rings.hidden = !pane;
  if (!pane) return;
  const isPoint =
    ['pick', 'fill', 'select', 'gradient', 'neutral'].includes(ui.tool) ||
    (ui.tool === 'adjust' && ui.adjustedArea !== 'spot');
  const size = isPoint ? 14 : Math.max(4, ui.size * pane.scale);
  place(ownRing, x, y, size, ui.hardness);
  twinRing.hidden = !otherPanes.length;
  if (otherPanes.length)
    place(twinRing, x - pane.left + otherPanes[0].left, y - pane.top + otherPanes[0].top, size, 1);
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
const pendingReports = new WeakMap();

/** Last place of the pointer. @type {WeakMap<UiStore, {x: number, y: number}>} */
const lastPlaces = new WeakMap();

/** Report what is under the pointer, once per frame. @param {Engine} engine @param {UiStore} store
 * @param {number} x @param {number} y */
export function reportProbe(engine, store, x, y) {
  lastPlaces.set(store, { x, y });
  const place = pendingReports.get(store) ?? { x, y, frame: 0 };
  Object.assign(place, { x, y });
  if (pendingReports.has(store)) return;
  pendingReports.set(store, place);
  place.frame = requestAnimationFrame(() => {
    pendingReports.delete(store);
    const pane = paneAt(engine, place.x, place.y);
    const probe = pane && probePane(engine, pane, place.x, place.y);
    if (engine.isPainting) store.setWithNext({ probe });
    else if (probe || store.value.probe) store.set({ probe });
  });
}

/** The pointer has left the pictures. @param {UiStore} store */
export function clearProbe(store) {
  cancelAnimationFrame(pendingReports.get(store)?.frame ?? 0);
  pendingReports.delete(store);
  lastPlaces.delete(store);
  store.set({ probe: null });
}

/** The pictures have changed under a resting pointer. @param {Engine} engine
 * @param {UiStore} store */
export function refreshProbe(engine, store) {
  const place = lastPlaces.get(store);
  if (place) reportProbe(engine, store, place.x, place.y);
}

/** @param {Engine} engine @param {Pane} pane @param {number} x
 * @param {number} y @returns {Probe | null} */
function probePane(engine, { kind, left, top, scale }, x, y) {
  const [px, py] = [(x - left) / scale, (y - top) / scale];
  const result = engine.probe(px, py);
  if (!result) return null;
  const light = engine.lightAt(kind, px, py);
  return { ...result, place: [px, py], light, paint: engine.paintAt(kind, px, py, light) };
}
