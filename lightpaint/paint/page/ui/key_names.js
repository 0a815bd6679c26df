/** Names of keys, as the shortcuts dialog and tips show them. */

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

/** Return the name of a key. @param {string} key */
export const keyName = (key) => NAMES[key] ?? key;

/** Return keys that are pressed together, or one after another, as a tip shows them.
 * @param {string} keys as `aria-keyshortcuts` has them */
export const keysText = (keys) =>
  keys
    .split(/[+ ](?=.)/)
    .map(keyName)
    .join(' ');
