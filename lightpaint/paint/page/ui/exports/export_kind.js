/** The choice between the two dialogs of the export button: files, and a final render. */

import { html } from '../../vendor/preact.js';
import { Choice } from '../controls.js';
import { t } from '../../language/language.js';

/** @typedef {import("../shortcuts.js").App} App */

const KINDS = [
  { value: 'export', label: t('Files') },
  { value: 'render', label: t('Final render') },
];

/** @param {{value: "export" | "render", app: App}} props */
export function ExportKind({ value, app }) {
  const change = (/** @type {"export" | "render"} */ dialog) => app.store.set({ dialog });
  return html`<${Choice} label=${t('What to export')} value=${value} choices=${KINDS} change=${change} />`;
}
