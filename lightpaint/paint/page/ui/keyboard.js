/** Keyboard input: finds the shortcut of a key, and keeps keys from the notebook around the painter. */

import { SHORTCUTS } from './shortcuts.js';
import { setFlow } from './tools.js';

/** @typedef {import("./shortcuts.js").App} App */

const BY_KEY = new Map(
  SHORTCUTS.flatMap(({ keys }) => keys)
    .filter((one) => one.act)
    .map((one) => [one.keys, one]),
);

/** Some keyboards have [ and ] behind AltGr, which is Ctrl and Alt on some systems.
 * @param {KeyboardEvent} event */
const isMod = (event) => (event.ctrlKey || event.metaKey) && !event.getModifierState('AltGraph');

/** @param {KeyboardEvent} event @returns {string} */
function shortcutOf(event) {
  const key = event.key.toLowerCase();
  if (isMod(event)) return `mod+${event.shiftKey ? 'shift+' : ''}${key}`;
  if (key === 'f' && event.shiftKey) return 'shift+f';
  return key === '=' ? '+' : key;
}

/** @param {KeyboardEvent} event @returns {boolean} whether it belongs to what is typed in */
export function isTyping(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  const { tagName } = element;
  if (tagName === 'INPUT')
    return !['range', 'checkbox', 'radio'].includes(/** @type {HTMLInputElement} */ (element).type);
  return ['TEXTAREA', 'SELECT'].includes(tagName) || element.isContentEditable;
}

/** Whether a key is pressed among numbers that are being put in: on a button between them, too, it
 * is none of the pictures'. @param {KeyboardEvent} event */
function isAmongNumbers(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  return event.key.length === 1 && !isMod(event) && Boolean(element.closest?.('[data-numbers]'));
}

/** What takes back steps of the session, also from a field in which nothing is typed any more. */
const HISTORY_KEYS = ['mod+z', 'mod+shift+z'];

/** Whether a field has taken what was typed in it: there is no text to take back, but what that has
 * changed. @param {KeyboardEvent} event in that field */
function isTaken(event) {
  const field = /** @type {HTMLElement} */ (event.composedPath()[0]);
  return field.dataset?.typed === 'no';
}

/** Have what is typed in a field taken, before something is done with it.
 * @param {KeyboardEvent} event in that field */
function commit(event) {
  const field = /** @type {HTMLElement} */ (event.composedPath()[0]);
  field.blur();
  field.focus({ preventScroll: true });
}

/**
 * What a key does, if it does anything here.
 * @param {KeyboardEvent} event @param {App} app
 */
export function handleKey(event, app) {
  const isAlt = event.altKey && !event.getModifierState('AltGraph');
  if (event.defaultPrevented || isAlt) return;
  const name = shortcutOf(event);
  const isIn = isTyping(event) || isAmongNumbers(event);
  // A page is no file that anybody keeps, and nothing of it but fields has text to be marked.
  if (name === 'mod+s' || (name === 'mod+a' && !isIn)) event.preventDefault();
  if (app.store.value.dialog) return;
  if (name === 'mod+s' && isIn) commit(event);
  else if (isIn && !(HISTORY_KEYS.includes(name) && isTaken(event))) return;
  const digit = /^[0-9]$/.test(event.key) && !event.ctrlKey && !event.metaKey;
  const found = BY_KEY.get(name);
  if (digit) setFlow(app.store, (Number(event.key) || 10) / 10);
  else if (found && !(found.isOnce && event.repeat)) found.act?.(app);
  else if (!found) return;
  if (name !== 'escape') event.preventDefault();
}

/** With Ctrl or ⌘, what changes the cells of a notebook: cut, paste, redo, run. */
const CELL_KEYS = ['x', 'v', 'y', 'enter'];

/**
 * Whether a key is the painter's alone, where it is one thing among others. By a letter or by
 * Delete a notebook makes and deletes cells; what opens something around the painter, function keys
 * and most of what has Ctrl or ⌘, does so from here, too.
 * @param {KeyboardEvent} event that `press` has seen
 */
function belongsToPainter(event) {
  if (event.defaultPrevented) return true;
  if (isMod(event)) return !isTyping(event) && CELL_KEYS.includes(event.key.toLowerCase());
  return !/^F\d+$/.test(event.key);
}

/**
 * The keys of a painter that is one thing among others: nobody else hears them.
 * @param {HTMLElement} root @param {App} app @param {AbortSignal} signal ends it
 */
export function listenWithin(root, app, signal) {
  const handle = (/** @type {KeyboardEvent} */ event) => {
    handleKey(event, app);
    if (belongsToPainter(event)) event.stopPropagation();
  };
  root.tabIndex = -1; // wherever in it somebody clicks
  root.addEventListener('keydown', handle, { signal });
  // What had the focus may be gone, a window or a button with nothing left to do; then nothing has.
  let isHere = false;
  const noteFocus = (/** @type {Event} */ event) => {
    isHere = event.composedPath().includes(root);
  };
  const early = { signal, capture: true };
  window.addEventListener('pointerdown', noteFocus, early);
  window.addEventListener('focusin', noteFocus, early);
  window.addEventListener(
    'keydown',
    (event) => isHere && event.target === document.body && handle(event),
    early,
  );
}
