/** The lights as the list shows them: found, sorted, and in groups. */

import { imageOf, meanOf } from '../images/light_images.js';
import { luminance } from '../../../../viewer/drawing/colour.js';
import { findTie } from '../tied_lights.js';
import { t } from '../../language/language.js';

/** @import { Ui } from '../ui_state.js' */

/** Lights that the list shows together: one row of its own, a group by name, or an image.
 * @typedef {{name: string | null, members: number[],
 *   image?: import("../images/light_images.js").LightImage}} ListedGroup */

/** Number of lights above which names that begin alike make groups, and only unfolded rows have a
 * slider. */
export const MAX_ROWS_WITH_SLIDERS = 16;

/** Number of rows above which groups are folded at first, and only rows in view exist. */
const MAX_EXISTING_ROWS = 96;

/** Return the lights that the search finds: by words in their names, or by patterns as in a lights
 * file (`spot_*`). A comma separates alternatives. @param {Ui} ui @returns {number[]} */
export function searchLights({ search, lights }) {
  const alternatives = search
    .toLowerCase()
    .split(',')
    .map((part) => part.trim())
    .filter(Boolean);
  const indices = lights.map((_, k) => k);
  if (!alternatives.length) return indices;
  return indices.filter((k) => alternatives.some((text) => isFound(lights[k], text)));
}

/** Return whether a light is found by a pattern of its whole name, or by words and patterns that
 * all occur. @param {Ui["lights"][number]} light @param {string} text */
function isFound({ name, label, group, members }, text) {
  const names = [name, label, group ?? '', ...members].map((one) => one.toLowerCase());
  const allNames = names.join(' ');
  const matches = (/** @type {string} */ word) =>
    /[*?[]/.test(word) ? names.some((one) => patternOf(word).test(one)) : allNames.includes(word);
  return matches(text) || text.split(/\s+/).every(matches);
}

/** Return a pattern of a lights file, with * for any text, ? for a character and [] for one of a
 * set, as a regular expression. One that is half typed matches nothing. @param {string} pattern */
function patternOf(pattern) {
  const parts = pattern.match(/\[!?[^\]]+\]|[\s\S]/g) ?? [];
  const source = parts.map((part) => {
    if (part === '*') return '.*';
    if (part === '?') return '.';
    const set = part.length > 1 ? part.slice(1, -1).replace(/[\\^]/g, '\\$&') : null;
    if (set) return set.startsWith('!') ? `[^${set.slice(1)}]` : `[${set}]`;
    return part.replace(/[.+^${}()|[\]\\/]/, '\\$&');
  });
  try {
    return new RegExp(`^${source.join('')}$`);
  } catch {
    return /$^/; // such as the range [z-a]
  }
}

/** Return the lights in the order of the list, without those in folded groups. @param {Ui} ui */
export function listedLights(ui) {
  return groupLights(ui, sortLights(ui, searchLights(ui))).flatMap(({ name, members }) =>
    name === null || isGroupOpen(ui, name, members) ? members : [],
  );
}

/** Return whether a group is unfolded. In a long list groups come first, and each is folded until
 * somebody unfolds it or one of its lights, or searches.
 * @param {Ui} ui @param {string} name @param {number[]} members */
export function isGroupOpen(ui, name, members) {
  const isWanted = () => ui.search.trim() !== '' || members.some((k) => ui.openLights.includes(k));
  return ui.open[groupKey(name)] ?? (!isLongList(ui) || isWanted());
}

/** Return whether a list has too many rows for all of them to exist. @param {Ui} ui */
export const isLongList = (ui) => countRows(ui) > MAX_EXISTING_ROWS;

/** Key of a group among what is unfolded. @param {string} name */
export const groupKey = (name) => `group ${name}`;

/** @param {Ui} ui @param {number[]} indices @returns {number[]} */
export function sortLights(ui, indices) {
  if (ui.sort === 'scene') return indices;
  const ownShare = (/** @type {number} */ k) => ui.lightAnswers[k]?.share ?? 0;
  const answer = (/** @type {number} */ k) => ui.lightAnswers[k]?.emission ?? ui.lights[k].present;
  const present = (/** @type {number} */ k) => ui.lights[k].present;
  const changeOf = (/** @type {number[]} */ before, /** @type {number[]} */ after) =>
    Math.abs(Math.log2((luminance(after) + 1e-9) / (luminance(before) + 1e-9)));
  const values = new Map(
    indices.map((k) => [
      k,
      { name: ui.lights[k].label, share: ownShare(k), change: changeOf(present(k), answer(k)) },
    ]),
  );
  for (const image of ui.images) {
    const share = image.lights.reduce((sum, k) => sum + ownShare(k), 0);
    const change = changeOf(meanOf(image, present), meanOf(image, answer));
    for (const k of image.lights) values.set(k, { name: image.name, share, change });
  }
  const name = (/** @type {number} */ k) => values.get(k)?.name ?? '';
  const share = (/** @type {number} */ k) => values.get(k)?.share ?? 0;
  const change = (/** @type {number} */ k) => values.get(k)?.change ?? 0;
  const sortedIndices = [...indices];
  if (ui.sort === 'name') {
    sortedIndices.sort((a, b) => name(a).localeCompare(name(b), undefined, { numeric: true }));
  }
  if (ui.sort === 'share') sortedIndices.sort((a, b) => share(b) - share(a));
  if (ui.sort === 'change') sortedIndices.sort((a, b) => change(b) - change(a));
  return sortedIndices;
}

/** Group lights that belong together under one name, at the place of the first.
 * @param {Ui} ui @param {number[]} indices @returns {ListedGroup[]} */
export function groupLights(ui, indices) {
  const names = ui.lights.map((_, k) => groupOf(ui, k));
  /** @type {Map<string | null, number>} */
  const counts = new Map();
  for (const name of names) counts.set(name, (counts.get(name) ?? 0) + 1);
  /** @type {Map<unknown, ListedGroup>} */
  const groups = new Map();
  for (const k of indices) {
    const image = imageOf(ui.images, k);
    const minCount = isPrefixGroup(ui, k) ? MIN_PREFIX_GROUP : 2;
    const name = image || (counts.get(names[k]) ?? 0) < minCount ? null : names[k];
    const key = image ?? name ?? k;
    const group = groups.get(key);
    if (group) group.members.push(k);
    else groups.set(key, { name, members: [k], image });
  }
  return [...groups.values()];
}

/** Return the number of lights, with each image as one. @param {Ui} ui */
export const countRows = ({ lights, images }) =>
  images.reduce((count, image) => count + 1 - image.lights.length, lights.length);

/** Smallest number of lights with a common prefix that are folded together. */
const MIN_PREFIX_GROUP = 3;

/** Return the group of a light: its dimmer, its group, the lamp of which it is an emitter or, with many
 * lights, its name's prefix.
 * @param {Ui} ui @param {number} k @returns {string | null} */
function groupOf(ui, k) {
  const { name, group, lamp } = ui.lights[k];
  const image = imageOf(ui.images, k);
  if (image) return image.name;
  const tie = findTie(ui, k);
  const others = tie && (tie.length === 2 ? tie[1] : t('{count} more', { count: tie.length - 1 }));
  if (tie) return t('{name} and {others}, tied', { name: tie[0], others });
  return group ?? (lamp || null) ?? (countRows(ui) > MAX_ROWS_WITH_SLIDERS ? namePrefix(name) : null);
}

/** @param {Ui} ui @param {number} k */
function isPrefixGroup(ui, k) {
  return !ui.lights[k].group && !ui.lights[k].lamp && !findTie(ui, k);
}

/** `window` of `window_12`, `cyc` of `cyc left`. @param {string} name @returns {string | null} */
function namePrefix(name) {
  return /^[^\s_.:/\-\d]+/.exec(name)?.[0] ?? null;
}
