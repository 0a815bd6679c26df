/** Interface state that the browser stores between visits: open panels and tool settings. */

import { MIN_BRUSH_SIZE, MAX_BRUSH_SIZE, distinctPaints } from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {import("./tools.js").Paint} Paint */
/** @typedef {import("./engine_interface.js").RGB} RGB */

/** Storage key. Values of an older page, or of other code, are validated before use. */
const [FOLDS_KEY, TOOL_KEY] = ['lightpaint.open', 'lightpaint.hand'];

/** @param {string} key @returns {Record<string, unknown>} */
function read(key) {
  try {
    const found = JSON.parse(localStorage.getItem(key) ?? '{}');
    return found && typeof found === 'object' ? found : {};
  } catch {
    return {};
  }
}

/** @param {string} key @param {object} value */
function write(key, value) {
  try {
    localStorage.setItem(key, JSON.stringify(value));
  } catch {
    // Private windows and frames of some notebooks store nothing.
  }
}

/** Return the panels that were open last time. @returns {Record<string, boolean>} */
export function storedFolds() {
  const folds = Object.entries(read(FOLDS_KEY)).filter(([, value]) => typeof value === 'boolean');
  return /** @type {Record<string, boolean>} */ (Object.fromEntries(folds));
}

/** Return the valid tool settings of the last time.
 * @returns {Partial<Ui>} the size as it is kept: as a part of the picture's height, in `share` */
export function storedTool() {
  const stored = read(TOOL_KEY);
  const paint = validPaint(stored);
  const second = validPaint(stored.second);
  const shares = { flow: 0.01, fillFlow: 0.01, hardness: 0 };
  const found = Object.entries(shares).filter(([key, least]) => isWithin(stored[key], least, 1));
  return {
    ...Object.fromEntries(found.map(([key]) => [key, stored[key]])),
    ...paint,
    ...(second ? { second } : {}),
    recent: recentPaints(stored),
  };
}

/** Return the recent colours. @param {Record<string, unknown>} kept @returns {Paint[]} */
function recentPaints({ recent }) {
  const all = Array.isArray(recent) ? recent.map(validPaint) : [];
  return distinctPaints(/** @type {Paint[]} */ (all.filter((one) => one !== null)));
}

/** Return the brush size for a picture of a height: scaled from the last one, else a seventh.
 * @param {number} height in pixels */
export function storedBrushSize(height) {
  const { share } = read(TOOL_KEY);
  const size = isWithin(share, 0, 10) ? Number(share) * height : Math.max(4, 0.14 * height);
  return Math.round(Math.min(MAX_BRUSH_SIZE, Math.max(MIN_BRUSH_SIZE, size)));
}

/** @param {any} kept @returns {Paint | null} */
function validPaint(kept) {
  const { colour, stops } = kept ?? {};
  const isColour =
    Array.isArray(colour) && colour.length === 3 && colour.every((x) => isWithin(x, 0, 1));
  return isColour && isWithin(stops, -32, 32)
    ? { colour: /** @type {RGB} */ (colour), stops }
    : null;
}

/** @param {unknown} x @param {number} least @param {number} most */
const isWithin = (x, least, most) => typeof x === 'number' && x >= least && x <= most;

/** Store the state from now on. @param {UiStore} store @returns {() => void} what ends it */
export function storeChanges(store) {
  let last = store.value;
  return store.listen(() => {
    const before = last;
    last = store.value;
    if (last.open !== before.open) write(FOLDS_KEY, last.open);
    // A page starts with the tool that was read, maybe long before the scene is loaded.
    if (!last.state || !before.state) return;
    if (STORED_FIELDS.some((key) => last[key] !== before[key])) write(TOOL_KEY, storedFields(last));
  });
}

/** Tool settings that are stored. @type {(keyof Ui)[]} */
const STORED_FIELDS = [
  'colour',
  'stops',
  'second',
  'recent',
  'flow',
  'fillFlow',
  'hardness',
  'size',
];

/** Store the tool settings and the recent colours, merged with those of other open painters.
 * @param {Ui} ui */
function storedFields({
  colour,
  stops,
  second,
  recent: own,
  flow,
  fillFlow,
  hardness,
  size,
  state,
}) {
  const share = size / state.size[0];
  const recent = distinctPaints([...own, ...recentPaints(read(TOOL_KEY))]);
  return { colour, stops, second, recent, flow, fillFlow, hardness, share };
}
