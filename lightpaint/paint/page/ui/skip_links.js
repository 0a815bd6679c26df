/** Skip links for the keyboard: the first stops of Tab, visible only when focused. */

import { html } from '../vendor/preact.js';
import { Button, reveal } from './controls.js';
import { words } from '../language/language.js';

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
  return html`<nav class="skips" aria-label=${words.skipLinks.skipLinks}>
    <${Button} label=${words.skipLinks.skipToThePictures} act=${(/** @type {MouseEvent} */ event) =>
      reveal(buttonOf(event), '.stage', true)} />
    <${Button} label=${words.skipLinks.skipToTheLights} act=${skipToLights} />
  </nav>`;
}
