/** What a person has chosen for the page itself, on this browser: its theme, its keys, and that the
 * tour has been seen. */

import { validBindings } from './key_bindings.js';
import { THEMES } from './theme.js';

/**
 * @typedef {object} Preferences
 * @property {import("./theme.js").Theme} theme
 * @property {import("./key_bindings.js").KeyBindings} keyBindings keys that differ from the default
 * @property {boolean} hasSeenTour
 */

/** @type {Preferences} */
export const DEFAULT_PREFERENCES = {
  theme: 'system',
  keyBindings: {},
  hasSeenTour: false,
};

/** @type {(keyof Preferences)[]} */
export const PREFERENCE_FIELDS = ['theme', 'keyBindings', 'hasSeenTour'];

/** Return what is valid of stored preferences. @param {Record<string, any>} stored
 * @returns {Partial<Preferences>} */
export const validPreferences = ({ theme, keyBindings, hasSeenTour }) => ({
  ...(THEMES.includes(theme) ? { theme } : {}),
  keyBindings: validBindings(keyBindings),
  hasSeenTour: hasSeenTour === true,
});
