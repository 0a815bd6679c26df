/** What the dialogs of files and of final renders share: the choice between them, and a name. */

import { html } from '../../vendor/preact.js';
import { currentLook } from '../look_actions.js';
import { t } from '../../language/language.js';
import { Choice } from '../controls.js';

/** @import { App, Ui } from '../ui_state.js' */

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

/** The two dialogs of the export button. */
const KINDS = [
  { value: 'export', label: t('Files') },
  { value: 'render', label: t('Final render') },
];

/** @param {{value: "export" | "render", app: App}} props */
export function ExportKind({ value, app }) {
  const change = (/** @type {"export" | "render"} */ dialog) => app.store.set({ dialog });
  return html`<${Choice} label=${t('What to export')} value=${value} choices=${KINDS} change=${change} />`;
}

/** Save a file where the browser saves files. @param {Blob} blob @param {string} name */
export function saveFile(blob, name) {
  const link = Object.assign(document.createElement('a'), { download: name });
  link.href = URL.createObjectURL(blob);
  link.click();
  URL.revokeObjectURL(link.href);
}
