/** A search for places of lights in the history: it is not a step, but says what was tried. */

import { html, useState } from '../../vendor/preact.js';
import { clockText, durationText } from '../format.js';
import { Icon } from '../icons.js';
import { t } from '../../language/language.js';

/** @typedef {import("../../engine/messages.js").SearchInfo} Search */

/** @param {{search: Search}} props */
export function SearchRow({ search }) {
  const [isOpen, setOpen] = useState(false);
  const { title, text, tried, stamp, seconds } = search;
  const name = title.charAt(0).toUpperCase() + title.slice(1);
  return html`<li class="search-note"><button type="button" aria-expanded=${String(isOpen)}
      onClick=${() => setOpen(!isOpen)}><${Icon} name="search" />
      <span class="step-label"><strong>${name}</strong><span>${text}</span></span>
      <span class="faint">${clockText(stamp)}</span></button>
    ${
      isOpen &&
      html`<div class="search-tried"><p>${t('Took {time}. Tried:', { time: durationText(seconds) })}</p>
      ${tried.map((sentence) => html`<p key=${sentence}>${sentence}</p>`)}</div>`
    }
  </li>`;
}
