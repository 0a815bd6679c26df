/** Keys of the commands: those that the painter comes with, or others that a person has set. */

import { t } from '../language/language.js';

/** Name of the Ctrl key on this system. */
const MOD = /mac/i.test(navigator.platform) ? '⌘' : t('Ctrl');

/** @type {Record<string, string>} */
const NAMES = {
  Ctrl: MOD,
  Control: MOD,
  Shift: t('Shift'),
  Alt: t('Alt'),
  Esc: t('Esc'),
  Escape: t('Esc'),
  Enter: t('Enter'),
  Space: t('Space'),
  Tab: t('Tab'),
  Delete: t('Delete', { context: 'key' }),
};

/** Steps (x, y) of the arrow keys. @type {Record<string, [number, number]>} */
export const ARROW_STEPS = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** Return the name of a key. @param {string} key */
export const keyName = (key) => NAMES[key] ?? key;

/** Return keys that are pressed together, or one after another, as a tip shows them.
 * @param {string} keys as `aria-keyshortcuts` has them */
export const keysText = (keys) =>
  keys
    .split(/[+ ](?=.)/)
    .map(keyName)
    .join(' ');

/** The browser's name of each key, after mod (Ctrl or ⌘) and shift. */
export const DEFAULT_KEYS = {
  brush: 'b',
  eraser: 'e',
  weight: 'w',
  pick: 'i',
  neutral: 'u',
  fill: 'g',
  line: 'l',
  adjust: 'a',
  gradient: 'r',
  select: 'm',
  saveLook: 'mod+s',
  panels: 'p',
  lights: 'd',
  shortcuts: '?',
  smaller: '[',
  larger: ']',
  softer: '{',
  harder: '}',
  swap: 'x',
  undo: 'mod+z',
  redo: 'mod+shift+z',
  selectAll: 'mod+a',
  selectNone: 'mod+d',
  invert: 'mod+shift+i',
  zoomIn: '+',
  zoomOut: '-',
  fit: 'f',
  pixels: 'shift+f',
  layout: 'v',
  nextView: 'n',
  blink: 'k',
  previous: 'q',
  original: 'y',
  lowerExposure: ',',
  raiseExposure: '.',
  denoise: 'c',
  overlay: 'o',
};

/** @typedef {keyof typeof DEFAULT_KEYS} Command */
/** Keys that differ from the default, by command; empty: none.
 * @typedef {Partial<Record<Command, string>>} KeyBindings */
/** @typedef {{keyBindings: KeyBindings}} Bound */

export const COMMANDS = /** @type {Command[]} */ (Object.keys(DEFAULT_KEYS));

/** Keys that browsers keep for themselves, and those that have a meaning wherever the focus is. */
const RESERVED = /^(mod\+(shift\+)?[wtnq]|(mod\+)?(shift\+)?( |enter|tab|arrow.*|[0-9]))$/;

/** Return what is valid of stored bindings. @param {unknown} stored @returns {KeyBindings} */
export function validBindings(stored) {
  const values = /** @type {Record<string, unknown>} */ (stored ?? {});
  const valid = COMMANDS.filter((command) => typeof values[command] === 'string');
  return Object.fromEntries(valid.map((command) => [command, values[command]]));
}

/** @param {KeyboardEvent} event Some keyboards have [ and ] behind AltGraph, which is Ctrl and Alt
 * on some systems. */
export const hasModifier = (event) =>
  (event.ctrlKey || event.metaKey) && !event.getModifierState('AltGraph');

/** Return the name of a pressed key as commands have it, and the one that counts if no command has
 * that: a letter means the same with Shift.
 * @param {KeyboardEvent} event @returns {string[]} */
export function pressedKeys(event) {
  const key = event.key.toLowerCase();
  const shift = event.shiftKey ? 'shift+' : '';
  if (hasModifier(event)) return [`mod+${shift}${key}`];
  if (key.length === 1 && key !== event.key.toUpperCase())
    return shift ? [`shift+${key}`, key] : [key];
  return [key === '=' ? '+' : key];
}

/** Return whether a key may be set for a command. @param {string} keys */
export const isAllowed = (keys) =>
  /^(mod\+)?(shift\+)?(.|f\d+)$/.test(keys) && !RESERVED.test(keys);

/** Return the key of a command; empty for none. @param {Bound} ui @param {Command} command */
export const keysOf = ({ keyBindings }, command) => keyBindings[command] ?? DEFAULT_KEYS[command];

/** Return the command of a key. @param {Bound} ui @param {string} keys */
export const commandOf = (ui, keys) => COMMANDS.find((command) => keysOf(ui, command) === keys);

/** Give a key to a command, and take it from another that has it. @param {Bound} ui
 * @param {Command} command @param {string} keys empty for none @returns {Bound} */
export function withKeys(ui, command, keys) {
  const other = keys && commandOf(ui, keys);
  const changed = { ...ui.keyBindings, ...(other ? { [other]: '' } : {}), [command]: keys };
  const kept = COMMANDS.filter((one) => (changed[one] ?? DEFAULT_KEYS[one]) !== DEFAULT_KEYS[one]);
  return { keyBindings: Object.fromEntries(kept.map((one) => [one, changed[one]])) };
}

/** Signs that are on keyboards with Shift, as they are shown. @type {Record<string, string[]>} */
const SHIFTED = { '{': ['Shift', '['], '}': ['Shift', ']'], '-': ['−'] };

/** Return the parts of a key in the browser's names: "mod+shift+z" as Control, Shift, Z.
 * @param {string} keys */
function partsOf(keys) {
  const [, mod, shift, key] = /^(mod\+)?(shift\+)?(.*)$/.exec(keys) ?? [];
  if (!key) return [];
  const last = SHIFTED[key] ?? [key.toUpperCase()];
  return [...(mod ? ['Control'] : []), ...(shift ? ['Shift'] : []), ...last];
}

/** Return the key of a command as it is shown, in parts. @param {string} keys */
export const keySymbols = (keys) => partsOf(keys).map(keyName);

/** Return the keys of commands as `aria-keyshortcuts` has them; none if they have none.
 * @param {Bound} ui @param {Command[]} commands */
export const shortcutsOf = (ui, ...commands) =>
  commands
    .map((command) => partsOf(keysOf(ui, command)).join('+'))
    .filter(Boolean)
    .join(' ') || undefined;

/** Return the key of a command within a sentence. @param {Bound} ui @param {Command} command */
export const keyText = (ui, command) => keySymbols(keysOf(ui, command)).join(' ');
