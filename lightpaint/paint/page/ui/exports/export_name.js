/** The name of an export, which its folder has, too. */

import { html } from '../../vendor/preact.js';
import { currentLook } from '../look_actions.js';
import { t } from '../../language/language.js';

/** @typedef {import("../ui_state.js").Ui} Ui */

/** Characters of the longest name of an export. */
const MAX_LENGTH = 80;

/** Return a name for an export of the answer: the name of the look which equals it, or of the scene.
 * @param {Ui} ui @returns {string} */
export function suggestedName(ui) {
  const current = currentLook(ui);
  const look = ui.looks.find(({ id }) => id === current);
  return look?.name ?? ui.state?.scene ?? '';
}

/** @param {{name: string, change: (name: string) => void}} props */
export function ExportName({ name, change }) {
  return html`<label class="field export-name" data-tip=${t('Of a new folder in exports/. Earlier exports stay: a number follows a name that is taken.')}>
    <span class="name">${t('Name')}</span>
    <input type="text" value=${name} maxlength=${MAX_LENGTH} autocomplete="off" spellcheck="false"
      onInput=${(/** @type {any} */ event) => change(event.currentTarget.value)} />
  </label>`;
}
