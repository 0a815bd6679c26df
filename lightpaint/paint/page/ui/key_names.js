/** Names of keys, as the shortcuts dialog and tips show them. */

import { words } from '../language/language.js';

/** Name of the Ctrl key on this system. */
export const MOD = /mac/i.test(navigator.platform) ? '⌘' : words.keys.Ctrl;

/** @type {Record<string, string>} */
const NAMES = { ...words.keys, Ctrl: MOD, Control: MOD, Escape: words.keys.Esc };

/** Return the name of a key. @param {string} key */
export const keyName = (key) => NAMES[key] ?? key;

/** Return keys that are pressed together, or one after another, as a tip shows them.
 * @param {string} keys as `aria-keyshortcuts` has them */
export const keysText = (keys) =>
  keys
    .split(/[+ ](?=.)/)
    .map(keyName)
    .join(' ');
