/** Ways for the keyboard past what comes before: the first stops of Tab, seen only there. */

import { html } from '../vendor/preact.js';
import { Button, comeInto } from './controls.js';

/** @typedef {import("./shortcuts.js").Hands} Hands */

/** @param {{hands: Hands}} props */
export function Skips({ hands: { store } }) {
  const within = (/** @type {MouseEvent} */ event) =>
    /** @type {HTMLElement} */ (event.currentTarget);
  const toLights = (/** @type {MouseEvent} */ event) => {
    const button = within(event);
    store.set(({ open }) => ({ side: true, panel: null, open: { ...open, lights: true } }));
    comeInto(button, '.lights :is(.group-name, .light-name)', true);
  };
  return html`<nav class="skips" aria-label="Skip links">
    <${Button} label="Skip to the pictures" act=${(/** @type {MouseEvent} */ event) =>
      comeInto(within(event), '.stage', true)} />
    <${Button} label="Skip to the lights" act=${toLights} />
  </nav>`;
}
