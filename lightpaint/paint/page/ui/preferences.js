/** What a person has chosen for the page itself, on this browser: its theme, its keys, the order of
 * its panels, and that the tour has been seen. */

import { validBindings } from './key_bindings.js';
import { validOrder } from './panels/panel_order.js';
import { THEMES } from './theme.js';

/**
 * @typedef {object} Preferences
 * @property {import("./theme.js").Theme} theme
 * @property {import("./key_bindings.js").KeyBindings} keyBindings keys that differ from the default
 * @property {boolean} hasSeenTour
 * @property {string[]} panelOrder names of panels from top to bottom; empty: as the page has them
 */

/** @type {Preferences} */
export const DEFAULT_PREFERENCES = {
  theme: 'system',
  keyBindings: {},
  hasSeenTour: false,
  panelOrder: [],
};

/** @type {(keyof Preferences)[]} */
export const PREFERENCE_FIELDS = ['theme', 'keyBindings', 'hasSeenTour', 'panelOrder'];

/** Return what is valid of stored preferences. @param {Record<string, any>} stored
 * @returns {Partial<Preferences>} */
export const validPreferences = ({ theme, keyBindings, hasSeenTour, panelOrder }) => ({
  ...(THEMES.includes(theme) ? { theme } : {}),
  keyBindings: validBindings(keyBindings),
  hasSeenTour: hasSeenTour === true,
  panelOrder: validOrder(panelOrder),
});
