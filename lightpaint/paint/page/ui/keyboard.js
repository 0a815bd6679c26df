/** Keyboard input: finds the shortcut of a key, and keeps keys from the notebook around the painter. */

import { commandOf, hasModifier, pressedKeys } from './key_bindings.js';
import { SHORTCUTS, escape } from './shortcuts.js';
import { setFlow } from './tools.js';

/** @import { App } from './ui_state.js' */
/** @import { CommandKey } from './shortcuts.js' */

const COMMAND_KEYS = new Map(
  SHORTCUTS.flatMap(({ keys }) => keys).flatMap((key) =>
    'command' in key ? [[key.command, key]] : [],
  ),
);

/** Return the command of a key, if it has one. @param {KeyboardEvent} event @param {App} app
 * @returns {CommandKey | undefined} */
function commandKeyOf(event, { store }) {
  const commands = pressedKeys(event).map((keys) => commandOf(store.value, keys));
  const command = commands.find((one) => one !== undefined);
  return command && COMMAND_KEYS.get(command);
}

/** @param {KeyboardEvent} event @returns {boolean} whether it belongs to what is typed in */
export function isTyping(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  const { tagName } = element;
  if (tagName === 'INPUT')
    return !['range', 'checkbox', 'radio'].includes(/** @type {HTMLInputElement} */ (element).type);
  return ['TEXTAREA', 'SELECT'].includes(tagName) || element.isContentEditable;
}

/** Return whether a key is pressed in a group of number fields; there, even a button between them,
 * it is not a shortcut of the pictures. @param {KeyboardEvent} event */
function isAmongNumbers(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  return (
    event.key.length === 1 && !hasModifier(event) && Boolean(element.closest?.('[data-numbers]'))
  );
}

/** Return whether a field's text is committed. Then undo applies to the session, not to the text.
 * @param {KeyboardEvent} event in that field */
function isCommitted(event) {
  const field = /** @type {HTMLElement} */ (event.composedPath()[0]);
  return field.dataset?.typed === 'no';
}

/** Commit the text of the focused field before an action uses it.
 * @param {KeyboardEvent} event in that field */
function commit(event) {
  const field = /** @type {HTMLElement} */ (event.composedPath()[0]);
  field.blur();
  field.focus({ preventScroll: true });
}

/** Return the shortcut of a key, if there is one here.
 * @param {KeyboardEvent} event @param {App} app */
export function handleKey(event, app) {
  const isAlt = event.altKey && !event.getModifierState('AltGraph');
  if (event.defaultPrevented || isAlt) return;
  const [name] = pressedKeys(event);
  const isInField = isTyping(event) || isAmongNumbers(event);
  // Suppress saving the page and selecting all, except in text fields.
  if (name === 'mod+s' || (name === 'mod+a' && !isInField)) event.preventDefault();
  if (app.store.value.dialog) return;
  const shortcut = commandKeyOf(event, app);
  if (isInField && !worksInField(event, shortcut)) return;
  if (name === 'escape') return escape(app);
  const isDigit = /^[0-9]$/.test(event.key) && !event.ctrlKey && !event.metaKey;
  if (isDigit) setFlow(app.store, (Number(event.key) || 10) / 10);
  else if (shortcut && !(shortcut.isOnce && event.repeat)) shortcut.act(app);
  else if (!shortcut) return;
  event.preventDefault();
}

/** Return whether a key that is pressed in a field belongs to a command. Saving a look commits the
 * text first; undo and redo work without uncommitted text.
 * @param {KeyboardEvent} event @param {CommandKey | undefined} shortcut */
function worksInField(event, shortcut) {
  if (!shortcut || !hasModifier(event)) return false;
  if (shortcut.command === 'saveLook') {
    commit(event);
    return true;
  }
  return ['undo', 'redo'].includes(shortcut.command) && isCommitted(event);
}

/** Keys that change a notebook's cells with Ctrl or ⌘: cut, paste, redo, run. */
const CELL_KEYS = ['x', 'v', 'y', 'enter'];

/** Return whether to keep a key from the notebook. Letters and Delete would create and delete cells.
 * Function keys and most keys with Ctrl or ⌘ pass through.
 * @param {KeyboardEvent} event that `press` has seen */
function belongsToPainter(event) {
  if (event.defaultPrevented) return true;
  if (hasModifier(event)) return !isTyping(event) && CELL_KEYS.includes(event.key.toLowerCase());
  return !/^F\d+$/.test(event.key);
}

/** Handle the keys of a painter in a notebook, and keep them from the notebook.
 * @param {HTMLElement} root @param {App} app @param {AbortSignal} signal ends it */
export function listenWithin(root, app, signal) {
  const handle = (/** @type {KeyboardEvent} */ event) => {
    handleKey(event, app);
    if (belongsToPainter(event)) event.stopPropagation();
  };
  root.tabIndex = -1; // after a click anywhere in it
  root.addEventListener('keydown', handle, { signal });
  // If the focused element disappears (a dialog, a disabled button), nothing has the focus.
  let hasFocus = false;
  const noteFocus = (/** @type {Event} */ event) => {
    hasFocus = event.composedPath().includes(root);
  };
  const captureOptions = { signal, capture: true };
  window.addEventListener('pointerdown', noteFocus, captureOptions);
  window.addEventListener('focusin', noteFocus, captureOptions);
  window.addEventListener(
    'keydown',
    (event) => hasFocus && event.target === document.body && handle(event),
    captureOptions,
  );
}
