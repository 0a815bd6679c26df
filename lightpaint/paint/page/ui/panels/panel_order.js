/** The order of the side panels, which the browser keeps. */

/** A panel, rendered: its key is its name.
 * @typedef {{key: string, props: {title: string}}} RenderedPanel */

/** Return what is valid of a stored order. @param {unknown} stored @returns {string[]} */
export function validOrder(stored) {
  const names = Array.isArray(stored) ? stored.filter((name) => typeof name === 'string') : [];
  return [...new Set(names)].slice(0, 40);
}

/**
 * Return names in an order. One that the order lacks follows the name that it follows by default, as
 * a panel does that an older page did not have.
 * @param {string[]} names in their default order @param {string[]} order @returns {string[]}
 */
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

/**
 * Return the order after a panel has been moved before another one, or for null to the end. Panels
 * that are hidden now keep the panel that they follow.
 * @param {string[]} order @param {string[]} shown names as they are shown, from top to bottom
 * @param {string} name @param {string | null} before @returns {string[]}
 */
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
