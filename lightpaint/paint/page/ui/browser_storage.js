/** Interface state that the browser stores between visits: open panels, tool settings, preferences. */

import { PREFERENCE_FIELDS, validPreferences } from './preferences.js';
import { MIN_BRUSH_SIZE, MAX_BRUSH_SIZE, distinctPaints } from './tools.js';

/** @import { RGB, Ui, UiStore } from './ui_state.js' */
/** @import { Paint } from './tools.js' */

/** Storage key. Values of an older page, or of other code, are validated before use. */
const [FOLDS_KEY, TOOL_KEY, PREFERENCES_KEY] = [
  'lightpaint.open',
  'lightpaint.hand',
  'lightpaint.preferences',
];

/** @param {string} key @returns {Record<string, unknown>} */
function read(key) {
  try {
    const value = JSON.parse(localStorage.getItem(key) ?? '{}');
    return value && typeof value === 'object' ? value : {};
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

/** Return the valid preferences of the last time. */
export const storedPreferences = () => validPreferences(read(PREFERENCES_KEY));

/** Return the valid tool settings of the last time.
 * @returns {Partial<Ui>} the size as it is kept: as a part of the picture's height, in `share` */
export function storedTool() {
  const storedValues = read(TOOL_KEY);
  const paint = validPaint(storedValues);
  const second = validPaint(storedValues.second);
  const shares = { flow: 0.01, fillFlow: 0.01, hardness: 0 };
  const validEntries = Object.entries(shares).filter(([key, min]) =>
    isWithin(storedValues[key], min, 1),
  );
  return {
    ...Object.fromEntries(validEntries.map(([key]) => [key, storedValues[key]])),
    ...paint,
    ...(second ? { second } : {}),
    recent: recentPaints(storedValues),
  };
}

/** Return the recent colours. @param {Record<string, unknown>} kept @returns {Paint[]} */
function recentPaints({ recent }) {
  const paints = Array.isArray(recent) ? recent.map(validPaint) : [];
  return distinctPaints(/** @type {Paint[]} */ (paints.filter((paint) => paint !== null)));
}

/** Return the brush size for a picture of a height: scaled from the last one, else a seventh.
 * @param {number} height in pixels */
export function storedBrushSize(height) {
  const { share } = read(TOOL_KEY);
  const size = isWithin(share, 0, 10) ? Number(share) * height : Math.max(4, 0.14 * height);
  return Math.round(Math.min(MAX_BRUSH_SIZE, Math.max(MIN_BRUSH_SIZE, size)));
}

/** @param {any} value @returns {Paint | null} */
function validPaint(value) {
  const { colour, stops } = value ?? {};
  const isColour =
    Array.isArray(colour) && colour.length === 3 && colour.every((x) => isWithin(x, 0, 1));
  return isColour && isWithin(stops, -32, 32)
    ? { colour: /** @type {RGB} */ (colour), stops }
    : null;
}

/** @param {unknown} x @param {number} min @param {number} max */
const isWithin = (x, min, max) => typeof x === 'number' && x >= min && x <= max;

/** Store the state from now on. @param {UiStore} store @returns {() => void} what ends it */
export function storeChanges(store) {
  let latest = store.value;
  return store.listen(() => {
    const previous = latest;
    latest = store.value;
    if (latest.open !== previous.open) write(FOLDS_KEY, latest.open);
    if (PREFERENCE_FIELDS.some((key) => latest[key] !== previous[key]))
      write(
        PREFERENCES_KEY,
        Object.fromEntries(PREFERENCE_FIELDS.map((key) => [key, latest[key]])),
      );
    // A page starts with the tool that was read, maybe long before the scene is loaded.
    if (!latest.state || !previous.state) return;
    if (STORED_FIELDS.some((key) => latest[key] !== previous[key]))
      write(TOOL_KEY, storedFields(latest));
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

/** Store the tool settings and the recent colours, merged with what other open painters stored.
 * @param {Ui} ui */
function storedFields({
  colour,
  stops,
  second,
  recent: ownRecent,
  flow,
  fillFlow,
  hardness,
  size,
  state,
}) {
  const share = size / state.size[0];
  const recent = distinctPaints([...ownRecent, ...recentPaints(read(TOOL_KEY))]);
  return { colour, stops, second, recent, flow, fillFlow, hardness, share };
}
