/** What a person has chosen for the page itself, on this browser: its theme, its keys, the order of
 * its panels, and that the tour has been seen. */

import { validBindings } from './key_bindings.js';
import { validOrder } from './panels/panel_order.js';
import { THEMES } from './theme.js';

/** @import { KeyBindings } from './key_bindings.js' */
/** @import { Theme } from './theme.js' */

export const DEFAULT_PREFERENCES = {
  theme: /** @type {Theme} */ ('system'),
  keyBindings: /** @type {KeyBindings} */ ({}), // keys that differ from the default
  hasSeenTour: false,
  // Names of panels from top to bottom; empty: as the page has them.
  panelOrder: /** @type {string[]} */ ([]),
};

/** @typedef {typeof DEFAULT_PREFERENCES} Preferences */

export const PREFERENCE_FIELDS = /** @type {(keyof Preferences)[]} */ (Object.keys(DEFAULT_PREFERENCES));

/** Return what is valid of stored preferences. @param {Record<string, any>} stored
 * @returns {Partial<Preferences>} */
export const validPreferences = ({ theme, keyBindings, hasSeenTour, panelOrder }) => ({
  ...(THEMES.includes(theme) ? { theme } : {}),
  keyBindings: validBindings(keyBindings),
  hasSeenTour: hasSeenTour === true,
  panelOrder: validOrder(panelOrder),
});
