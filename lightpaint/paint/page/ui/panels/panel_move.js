/** Moving a side panel to another place: a drag of its title or its grip, or the arrow keys with Alt. */

import { t } from '../../language/language.js';
import { dragItem } from '../item_drag.js';
import { withPanelBefore, withPanelStepped } from './panel_order.js';

/** @typedef {import("../ui_state.js").UiStore} UiStore */

/** @param {Element} side @returns {HTMLElement[]} */
const panelsIn = (side) => [...side.querySelectorAll(':scope > [data-panel]')].map((one) => /** @type {HTMLElement} */ (one));

/** @param {HTMLElement} panel @returns {string} */
const nameOf = (panel) => panel.dataset.panel ?? '';

/** Begin a drag of a panel, if a press on its head becomes one. Fingers drag by the grip, since
 * elsewhere they scroll. @param {PointerEvent} event on the panels @param {UiStore} store */
export function dragPanel(event, store) {
  const target = /** @type {HTMLElement} */ (event.target);
  const handle = target.closest(event.pointerType === 'mouse' ? '.fold-grip, .fold-head h2' : '.fold-grip');
  const panel = /** @type {HTMLElement | null} */ (handle?.closest('[data-panel]') ?? null);
  const side = /** @type {HTMLElement} */ (event.currentTarget);
  if (!panel || panel.parentElement !== side || event.button !== 0) return;
  dragItem(event, panel, {
    move: ({ clientY }) => markPlace(side, placeBelow(side, clientY)),
    drop: ({ clientY }) => movePanel(store, side, nameOf(panel), placeBelow(side, clientY)),
  });
}

/** Return the name of the panel that a drag at a height would come before; null at the end.
 * @param {HTMLElement} side @param {number} y */
function placeBelow(side, y) {
  const below = panelsIn(side).find((panel) => {
    const { top, height } = panel.getBoundingClientRect();
    return y < top + height / 2;
  });
  return below ? nameOf(below) : null;
}

/** Mark where a panel would be dropped. @param {HTMLElement} side @param {string | null} before */
function markPlace(side, before) {
  const panels = panelsIn(side);
  for (const panel of panels) delete panel.dataset.drop;
  const next = panels.find((panel) => nameOf(panel) === before);
  const last = panels.at(-1);
  if (next) next.dataset.drop = 'before';
  else if (last) last.dataset.drop = 'after';
}

/** @param {UiStore} store @param {HTMLElement} side @param {string} name @param {string | null} before */
function movePanel(store, side, name, before) {
  const shown = panelsIn(side).map(nameOf);
  store.set(({ panelOrder }) => ({ panelOrder: withPanelBefore(panelOrder, shown, name, before) }));
}

/** Move a panel by Alt and an arrow key on its title. @param {KeyboardEvent} event on the panels
 * @param {UiStore} store */
export function stepPanel(event, store) {
  const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  const title = /** @type {HTMLElement} */ (event.target).closest('.fold-head h2 button');
  const panel = /** @type {HTMLElement | null} */ (title?.closest('[data-panel]') ?? null);
  const side = /** @type {HTMLElement} */ (event.currentTarget);
  if (!step || !event.altKey || !panel || panel.parentElement !== side) return;
  event.preventDefault();
  event.stopPropagation();
  const shown = panelsIn(side).map(nameOf);
  const order = withPanelStepped(store.value.panelOrder, shown, nameOf(panel), step);
  const place = {
    name: panel.getAttribute('aria-label') ?? '',
    place: shown.indexOf(nameOf(panel)) + 1 + (order ? step : 0),
    count: shown.length,
  };
  const note = t('{name}: {place} of {count} panels', place);
  store.set(order ? { panelOrder: order, panelNote: note } : { panelNote: note });
  // An element that is moved loses the focus.
  requestAnimationFrame(() => {
    const own = `[data-panel="${nameOf(panel)}"] .fold-head h2 button`;
    const button = /** @type {HTMLElement | null} */ (side.querySelector(own));
    button?.focus({ preventScroll: true });
    button?.scrollIntoView({ block: 'nearest' });
  });
}
