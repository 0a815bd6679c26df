/** What a person has chosen for the page itself, on this browser: its theme and its keys. */

import { validBindings } from './key_bindings.js';
import { THEMES } from './theme.js';

/**
 * @typedef {object} Preferences
 * @property {import("./theme.js").Theme} theme
 * @property {import("./key_bindings.js").KeyBindings} keyBindings keys that differ from the default
 */

/** @type {Preferences} */
export const DEFAULT_PREFERENCES = {
  theme: 'system',
  keyBindings: {},
};

/** @type {(keyof Preferences)[]} */
export const PREFERENCE_FIELDS = ['theme', 'keyBindings'];

/** Return what is valid of stored preferences. @param {Record<string, any>} stored
 * @returns {Partial<Preferences>} */
export const validPreferences = ({ theme, keyBindings }) => ({
  ...(THEMES.includes(theme) ? { theme } : {}),
  keyBindings: validBindings(keyBindings),
});
