/** The order and properties of layers, the lowest first; the twin of paint/layers/layer_stack.py. */

import { t } from '../../language/language.js';

/** @import { Layer } from '../messages.js' */
/** @import { ShownLayer } from './layer_composition.js' */

/** Id of the painting that is always there. */
export const PAINTING_ID = 0;

/** Largest strength, and largest importance. */
const [MAX_STRENGTH, MAX_FACTOR] = [2, 1e4];

/** Characters of a name. */
const MAX_NAME_LENGTH = 80;

/** Return a new layer. @param {number} id @param {Layer["kind"]} kind
 * @param {Partial<Layer>} [properties] @returns {Layer} */
export function newLayer(id, kind, properties = {}) {
  return {
    id,
    kind,
    name: '',
    is_visible: true,
    strength: 1,
    importance: 1,
    group: null,
    gain: 1,
    tint: [1, 1, 1],
    times: 1,
    gradient: null,
    ...properties,
  };
}

/** The painting of a session without other layers. @type {Layer} */
export const PAINTING = newLayer(PAINTING_ID, 'pixels', { name: t('Painting') });

/** Return the properties of a layer alone, as requests have them. @param {Layer} layer
 * @returns {Layer} */
export function plainLayer(layer) {
  const { id, kind, is_visible, strength, importance, group, gain, tint, times, gradient } = layer;
  const name = layer.name.slice(0, MAX_NAME_LENGTH);
  return { id, kind, name, is_visible, strength, importance, group, gain, tint, times, gradient };
}

/** Put the layers of each group directly below it, and the painting below all if it is missing.
 * @param {Layer[]} listed @returns {Layer[]} */
function ordered(listed) {
  const all = listed.some(({ id }) => id === PAINTING_ID) ? listed : [PAINTING, ...listed];
  const made = [];
  for (const layer of all) {
    if (layer.kind === 'group') made.push(...all.filter(({ group }) => group === layer.id));
    if (layer.group === null) made.push(layer);
  }
  return made;
}

/** Return the list with other layers of these ids; new ones lie on top.
 * @param {Layer[]} list @param {Layer[]} changed @param {number[] | null} [order] ids of all that
 * stay @returns {Layer[]} */
export function withLayers(list, changed, order = null) {
  const byId = new Map([...list, ...changed].map((layer) => [layer.id, layer]));
  const ids = order ?? [...byId.keys()];
  return ordered(ids.flatMap((id) => byId.get(id) ?? []));
}

/** Return the visible layers, with the strength and importance of their groups included.
 * @param {Layer[]} list @param {Map<number, number>} accents by id @returns {ShownLayer[]} */
export function shownLayers(list, accents) {
  const byId = new Map(list.map((layer) => [layer.id, layer]));
  return list.flatMap((layer) => {
    const group = layer.group === null ? undefined : byId.get(layer.group);
    if (layer.kind === 'group' || !layer.is_visible || group?.is_visible === false) return [];
    const strength = group
      ? Math.min(MAX_STRENGTH, layer.strength * group.strength)
      : layer.strength;
    const importance = group
      ? Math.min(MAX_FACTOR, layer.importance * group.importance)
      : layer.importance;
    const accent = accents.get(layer.id) ?? 1;
    return strength > 0 ? [{ ...layer, name: '', group: null, strength, importance, accent }] : [];
  });
}

/** Return whether the painting alone shows, as it is. @param {ShownLayer[]} shown
 * @param {Layer[]} list */
export function isPlain([first, ...others], list) {
  if (list.length > 1 || others.length || !first) return false;
  return first.strength === 1 && first.importance === 1 && first.accent === 1;
}

/** Return the layers that differ between two lists, or lie elsewhere.
 * @param {ShownLayer[]} before @param {ShownLayer[]} after @returns {number[]} their ids */
export function changedLayers(before, after) {
  const [one, other] = [before, after].map((list) => list.map((layer) => JSON.stringify(layer)));
  let start = 0;
  while (start < Math.min(one.length, other.length) && one[start] === other[start]) start += 1;
  let end = 0;
  const left = Math.min(one.length, other.length) - start;
  while (end < left && one[one.length - 1 - end] === other[other.length - 1 - end]) end += 1;
  const middle = [
    ...before.slice(start, before.length - end),
    ...after.slice(start, after.length - end),
  ];
  return [...new Set(middle.map(({ id }) => id))];
}
