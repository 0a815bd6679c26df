/** Changes of the layers' order, as requests: moved, grouped, copied and deleted layers. */

import { t } from '../../language/language.js';

/** @import { ChangeLayers, Layer } from '../../engine/messages.js' */
/** A row of the list, the topmost first: members of a group follow it.
 * @typedef {{layer: Layer, group: number | null}} Row */

/** Return the rows of the list, the topmost first. @param {Layer[]} layers the lowest first
 * @returns {Row[]} */
export function rowsOf(layers) {
  return [...layers].reverse().map((layer) => ({ layer, group: layer.group }));
}

/** Return the rows of a layer: itself and, of a group, its members.
 * @param {Row[]} rows @param {number} id */
const blockOf = (rows, id) => rows.filter(({ layer }) => layer.id === id || layer.group === id);

/** Move a layer before a row. @param {Layer[]} layers @param {number} id
 * @param {number | null} before id of that row; null for the end @param {number | null} group that it
 * is in from then on @returns {ChangeLayers} */
export function movedLayer(layers, id, before, group) {
  const rows = rowsOf(layers);
  const block = blockOf(rows, id);
  const rest = rows.filter((row) => !block.includes(row));
  const place = rest.findIndex(({ layer }) => layer.id === before);
  rest.splice(place < 0 ? rest.length : place, 0, ...block);
  const moved = block[0]?.layer;
  const isOther = moved && moved.group !== group && moved.kind !== 'group';
  return {
    layers: isOther ? [{ ...moved, group }] : [],
    order: rest.map(({ layer }) => layer.id).reverse(),
    label: t('order of layers'),
  };
}

/** Move a layer by one row, into a group or out of it. @param {Layer[]} layers @param {number} id
 * @param {number} way −1 for up @returns {ChangeLayers | null} null at the end */
export function steppedLayer(layers, id, way) {
  const rows = rowsOf(layers);
  const block = blockOf(rows, id);
  const at = rows.indexOf(block[0]);
  const { layer } = block[0];
  const next = rows[way < 0 ? at - 1 : at + block.length];
  const after = (/** @type {number} */ k) => rows[k]?.layer.id ?? null;
  const end = at + block.length;
  if (layer.group !== null && (!next || next.layer.group !== layer.group)) {
    // Out of its group: above its head, or below its last member.
    return movedLayer(layers, id, way < 0 ? layer.group : after(end), null);
  }
  if (!next) return null;
  const isGroup = layer.kind === 'group';
  if (way < 0) {
    if (isGroup && next.layer.group !== null) return movedLayer(layers, id, next.layer.group, null);
    if (layer.group === null && next.layer.group !== null)
      return movedLayer(layers, id, after(end), next.layer.group);
    if (layer.group === null && next.layer.kind === 'group' && !isGroup)
      return movedLayer(layers, id, after(end), next.layer.id);
    return movedLayer(layers, id, next.layer.id, layer.group);
  }
  if (next.layer.kind !== 'group') return movedLayer(layers, id, after(end + 1), layer.group);
  if (isGroup)
    return movedLayer(layers, id, after(end + blockOf(rows, next.layer.id).length), null);
  return movedLayer(layers, id, after(end + 1), next.layer.id);
}

/** Return the change that deletes layers, and the members of groups among them.
 * @param {Layer[]} layers @param {number[]} ids @returns {ChangeLayers} */
export function withoutLayers(layers, ids) {
  const stay = layers.filter(({ id, group }) => !ids.includes(id) && !ids.includes(group ?? -1));
  return {
    order: stay.map(({ id }) => id),
    label: ids.length > 1 ? t('delete layers') : t('delete layer'),
  };
}

/** Return the change that puts layers into a new group, at the place of the topmost.
 * @param {Layer[]} layers @param {number[]} ids @param {number} next id of the group
 * @returns {ChangeLayers | null} null if there is nothing to group */
export function groupedLayers(layers, ids, next) {
  const members = layers.filter(({ id, kind }) => ids.includes(id) && kind !== 'group');
  if (!members.length) return null;
  const top = members[members.length - 1];
  const head = top.group ?? top.id;
  const rest = layers.filter((layer) => !members.includes(layer) || layer.id === head);
  const order = rest.flatMap(({ id }) => {
    if (id !== head) return [id];
    const own = [...members.map((layer) => layer.id), next];
    return id === top.id ? own : [id, ...own];
  });
  /** @type {Layer} */
  const group = {
    ...top,
    id: next,
    kind: 'group',
    name: t('Group'),
    group: null,
    is_visible: true,
  };
  const plain = {
    strength: 1,
    importance: 1,
    gain: 1,
    times: 1,
    tint: /** @type {const} */ ([1, 1, 1]),
  };
  return {
    layers: [
      { ...group, ...plain, tint: [1, 1, 1] },
      ...members.map((layer) => ({ ...layer, group: next })),
    ],
    order,
    label: t('group layers'),
  };
}

/** Return the change that dissolves a group. @param {Layer[]} layers @param {number} id
 * @returns {ChangeLayers} */
export function ungroupedLayers(layers, id) {
  return {
    layers: layers.filter(({ group }) => group === id).map((layer) => ({ ...layer, group: null })),
    order: layers.map((layer) => layer.id).filter((one) => one !== id),
    label: t('ungroup layers'),
  };
}

/** Return the change that copies a layer, or a group with its members, above itself.
 * @param {Layer[]} layers @param {number} id @param {number} next id of the first copy
 * @returns {ChangeLayers} */
export function copiedLayers(layers, id, next) {
  const block = layers.filter((layer) => layer.id === id || layer.group === id);
  const ids = new Map(block.map((layer, k) => [layer.id, next + k]));
  const made = block.map((layer) => ({
    ...layer,
    id: /** @type {number} */ (ids.get(layer.id)),
    // A painting that is always there is copied as paint like any other layer of pixels.
    group: layer.group === null ? null : (ids.get(layer.group) ?? layer.group),
    name: layer.id === id ? t('{name} copy', { name: layer.name }) : layer.name,
  }));
  const order = layers.flatMap((layer) =>
    layer.id === id ? [id, ...made.map((one) => one.id)] : [layer.id],
  );
  const pixels = block.filter(({ kind }) => kind !== 'group');
  const copies = Object.fromEntries(pixels.map((layer) => [ids.get(layer.id), layer.id]));
  return { layers: made, order, copies, label: t('copy layer') };
}
