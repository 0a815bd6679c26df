/** Skip links for the keyboard: the first stops of Tab, visible only when focused. */

import { html } from '../vendor/preact.js';
import { Button, reveal } from './controls.js';
import { t } from '../language/language.js';

/** @typedef {import("./shortcuts.js").App} App */

/** @param {{app: App}} props */
export function SkipLinks({ app: { store } }) {
  const buttonOf = (/** @type {MouseEvent} */ event) =>
    /** @type {HTMLElement} */ (event.currentTarget);
  const skipToLights = (/** @type {MouseEvent} */ event) => {
    const button = buttonOf(event);
    store.set(({ open }) => ({ side: true, panel: null, open: { ...open, lights: true } }));
    reveal(button, '.lights :is(.group-name, .light-name)', true);
  };
  return html`<nav class="skips" aria-label=${t('Skip links')}>
    <${Button} label=${t('Skip to the pictures')} act=${(/** @type {MouseEvent} */ event) =>
      reveal(buttonOf(event), '.stage', true)} />
    <${Button} label=${t('Skip to the lights')} act=${skipToLights} />
  </nav>`;
}
