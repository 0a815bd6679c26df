/** What a person has chosen for the page itself, on this browser: its theme. */

import { THEMES } from './theme.js';

/** @typedef {import("./theme.js").Theme} Theme */

/**
 * @typedef {object} Preferences
 * @property {Theme} theme
 */

/** @type {Preferences} */
export const DEFAULT_PREFERENCES = {
  theme: 'system',
};

/** @type {(keyof Preferences)[]} */
export const PREFERENCE_FIELDS = ['theme'];

/** Return what is valid of stored preferences. @param {Record<string, any>} stored
 * @returns {Partial<Preferences>} */
export function validPreferences({ theme }) {
  return THEMES.includes(theme) ? { theme } : {};
}
