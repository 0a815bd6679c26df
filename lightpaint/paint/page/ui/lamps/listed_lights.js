/** The lights as the list shows them: found, sorted, and in groups. */

import { luminance } from '../paint_colour.js';
import { findTie } from '../tied_lights.js';
import { fill, words } from '../../language/language.js';

/** @typedef {import("../ui_state.js").Ui} Ui */

/** Number of lights above which names that begin alike make groups, and only unfolded rows have a
 * slider. */
export const MAX_ROWS_WITH_SLIDERS = 16;

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
    name === null || isGroupOpen(ui, name) ? members : [],
  );
}

/** @param {Ui} ui @param {string} name */
export const isGroupOpen = (ui, name) => ui.open[groupKey(name)] ?? true;

/** Key of a group among what is unfolded. @param {string} name */
export const groupKey = (name) => `group ${name}`;

/** @param {Ui} ui @param {number[]} indices @returns {number[]} */
export function sortLights(ui, indices) {
  const name = (/** @type {number} */ k) => ui.lights[k].label;
  const share = (/** @type {number} */ k) => ui.lightAnswers[k]?.share ?? 0;
  const change = (/** @type {number} */ k) => {
    const [a, b] = [
      luminance(ui.lightAnswers[k]?.emission ?? ui.lights[k].present),
      luminance(ui.lights[k].present),
    ];
    return Math.abs(Math.log2((a + 1e-9) / (b + 1e-9)));
  };
  const sortedIndices = [...indices];
  if (ui.sort === 'name') {
    sortedIndices.sort((a, b) => name(a).localeCompare(name(b), undefined, { numeric: true }));
  }
  if (ui.sort === 'share') sortedIndices.sort((a, b) => share(b) - share(a));
  if (ui.sort === 'change') sortedIndices.sort((a, b) => change(b) - change(a));
  return sortedIndices;
}

/** Group lights that belong together under one name, at the place of the first.
 * @param {Ui} ui @param {number[]} indices @returns {{name: string | null, members: number[]}[]} */
export function groupLights(ui, indices) {
  const names = ui.lights.map((_, k) => groupOf(ui, k));
  /** @type {{name: string | null, members: number[]}[]} */
  const groups = [];
  for (const k of indices) {
    const count = names.filter((other) => other === names[k]).length;
    const name = count >= (isPrefixGroup(ui, k) ? MIN_PREFIX_GROUP : 2) ? names[k] : null;
    const existingGroup = name === null ? undefined : groups.find((group) => group.name === name);
    if (existingGroup) existingGroup.members.push(k);
    else groups.push({ name, members: [k] });
  }
  return groups;
}

/** Smallest number of lights with a common prefix that are folded together. */
const MIN_PREFIX_GROUP = 3;

/** Return the group of a light: its dimmer, its group or, with many lights, its name's prefix.
 * @param {Ui} ui @param {number} k @returns {string | null} */
function groupOf(ui, k) {
  const { name, group } = ui.lights[k];
  const tie = findTie(ui, k);
  const otherNames =
    tie && (tie.length === 2 ? tie[1] : fill(words.listedLights.more, { count: tie.length - 1 }));
  if (tie) return fill(words.listedLights.andTied, { value: tie[0], otherNames });
  return group ?? (ui.lights.length > MAX_ROWS_WITH_SLIDERS ? namePrefix(name) : null);
}

/** @param {Ui} ui @param {number} k */
function isPrefixGroup(ui, k) {
  return !ui.lights[k].group && !findTie(ui, k);
}

/** `window` of `window_12`, `cyc` of `cyc left`. @param {string} name @returns {string | null} */
function namePrefix(name) {
  return /^[^\s_.:/\-\d]+/.exec(name)?.[0] ?? null;
}
