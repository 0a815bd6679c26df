/** The order of the side panels, which the browser keeps. */

import { t } from '../../language/language.js';
import { dragItem } from '../item_drag.js';

/** @import { UiStore } from '../ui_state.js' */

/** A panel, rendered: its key is its name.
 * @typedef {{key: string, props: {title: string}}} RenderedPanel */

/** Return what is valid of a stored order. @param {unknown} stored @returns {string[]} */
export function validOrder(stored) {
  const names = Array.isArray(stored) ? stored.filter((name) => typeof name === 'string') : [];
  return [...new Set(names)].slice(0, 40);
}

/** Return names in an order. One that the order lacks follows the name that it follows by default, as
 * a panel does that an older page did not have.
 * @param {string[]} names in their default order @param {string[]} order @returns {string[]} */
export function orderedNames(names, order) {
  const ordered = order.filter((name) => names.includes(name));
  names.forEach((name, k) => {
    if (!ordered.includes(name)) ordered.splice(k ? ordered.indexOf(names[k - 1]) + 1 : 0, 0, name);
  });
  return ordered;
}

/** Return rendered panels in an order. @param {any} children rendered panels, and nothing for
 * hidden ones @param {string[]} order @returns {RenderedPanel[]} */
export function orderedPanels(children, order) {
  const panels = /** @type {RenderedPanel[]} */ ([children].flat().filter((child) => child?.key));
  const names = orderedNames(panels.map(({ key }) => key), order);
  return names.flatMap((name) => panels.find(({ key }) => key === name) ?? []);
}

/** Return the order after a panel has been moved before another one, or for null to the end. Panels
 * that are hidden now keep the panel that they follow.
 * @param {string[]} order @param {string[]} shown names as they are shown, from top to bottom
 * @param {string} name @param {string | null} before @returns {string[]} */
export function withPanelBefore(order, shown, name, before) {
  if (before === name) return order;
  const all = [...order];
  shown.forEach((one, k) => {
    if (!all.includes(one)) all.splice(k ? all.indexOf(shown[k - 1]) + 1 : 0, 0, one);
  });
  const others = all.filter((one) => one !== name);
  others.splice(before === null ? others.length : others.indexOf(before), 0, name);
  return others;
}

/** Return the order after a panel has been moved up or down by one of those shown; null at the end.
 * @param {string[]} order @param {string[]} shown @param {string} name @param {number} step -1 or 1
 * @returns {string[] | null} */
export function withPanelStepped(order, shown, name, step) {
  const at = shown.indexOf(name);
  if (at < 0 || !(at + step in shown)) return null;
  const before = step < 0 ? shown[at - 1] : (shown[at + 2] ?? null);
  return withPanelBefore(order, shown, name, before);
}

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
