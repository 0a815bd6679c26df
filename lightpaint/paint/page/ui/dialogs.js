/** Dialogs over the painter: keyboard shortcuts and export. */

import { html, useState } from '../vendor/preact.js';
import { ProgressBar } from './progress_bar.js';
import { Button, Checkbox, Dialog } from './controls.js';
import { percentText, progressText, relativePath } from './format.js';
import { LooksDialog } from './looks_dialog.js';
import { PresetsDialog } from './presets_dialog.js';
import { SHORTCUTS, MOD } from './shortcuts.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {{ui: Ui, app: App}} props */
export function Dialogs({ ui, app }) {
  const close = () => app.store.set({ dialog: null });
  if (ui.dialog === 'keys') return html`<${ShortcutsDialog} close=${close} />`;
  if (ui.dialog === 'export') return html`<${ExportDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'looks') return html`<${LooksDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'presets')
    return html`<${PresetsDialog} ui=${ui} app=${app} close=${close} />`;
  return null;
}

/** @param {{close: () => void}} props */
function ShortcutsDialog({ close }) {
  const symbolOf = (/** @type {string} */ key) => (key === 'Ctrl' ? MOD : key);
  return html`<${Dialog} title="Keyboard shortcuts" close=${close} class="keys">
    ${SHORTCUTS.map(
      ({ title, keys }) => html`<section key=${title}><h3>${title}</h3><dl>
      ${keys.map(
        ({ symbols, description }) => html`<div key=${description}>
        <dt>${symbols.map((key, k) => html`<kbd key=${k}>${symbolOf(key)}</kbd>`)}</dt>
        <dd>${description}</dd></div>`,
      )}
    </dl></section>`,
    )}
    <p class="faint">On a tablet, one finger paints; two fingers pan and zoom. Pen pressure controls the flow.</p>
  </${Dialog}>`;
}

/** @type {{key: import("../engine/messages.js").Export["outputs"][number], label: string,
 *   description: string}[]} */
const EXPORTS = [
  { key: 'target', label: 'Painting', description: 'painting.exr, for lightpaint solve' },
  {
    key: 'layers',
    label: 'Layers',
    description: 'layers.exr and layers.ora, for Krita and others',
  },
  { key: 'picture', label: 'Picture', description: 'answer.png: the answer as a picture' },
  {
    key: 'lighting',
    label: 'Lighting',
    description: 'lighting.json: level and colour of every light',
  },
  { key: 'relit', label: 'Scene', description: 'relit.xml: the scene with this lighting' },
  { key: 'report', label: 'Report', description: 'report.html: painting, answer and analysis' },
];

/** Exports that are not ticked at first: few people need them. @type {string[]} */
const UNTICKED = ['layers'];

const UNPAINTED_TEXT = 'Nothing is painted yet, so no painting, layers or report were exported.';

/** @param {{ui: Ui, app: App, close: () => void}} props */
function ExportDialog({ ui, app, close }) {
  const available = EXPORTS.filter(
    ({ key }) =>
      (key !== 'relit' || ui.state?.can_render) &&
      (key !== 'report' || ui.state?.can_report !== false),
  );
  const [outputs, setOutputs] = useState(
    available.map(({ key }) => key).filter((key) => !UNTICKED.includes(key)),
  );
  const isBusy = ui.isExporting;
  const { exportResult } = ui;
  const folder = ui.state?.folder ?? '';
  return html`<${Dialog} title="Export" close=${close} class="export">
    ${available.map(
      ({ key, label, description }) => html`<div class="export-row" key=${key}>
      <${Checkbox} label=${label} checked=${outputs.includes(key)} change=${(
        /** @type {boolean} */ on,
      ) => setOutputs(on ? [...outputs, key] : outputs.filter((output) => output !== key))} />
      <span class="faint">${description}</span></div>`,
    )}
    ${
      ui.master !== 1 &&
      html`<p>The master is at ${percentText(ui.master)}: picture, lighting and relit scene are dimmed;
        painting, report and the command are not.</p>`
    }
    <div class="row"><span class="faint folder">to ${folder}</span>
      <${CopyButton} text=${folder} tip="Copy the folder's path" app=${app} />
      <${Button} label=${isBusy ? 'Exporting …' : 'Export'} primary disabled=${isBusy || !outputs.length}
        act=${() => app.session.exportFiles(outputs)} /></div>
    ${
      isBusy &&
      html`<div class="row"><span class="faint folder">You can close this window.</span>
        <${ProgressBar} progress=${ui.exportProgress ?? { done: 0, total: 0 }} label="Exporting" />
        <span class="faint">${ui.exportProgress && progressText(ui.exportProgress)}</span>
        <${Button} label="Stop" icon="close" act=${() => app.session.exportFiles([])}
          tip="Files that are written already stay" /></div>`
    }
    ${
      exportResult &&
      html`<div class="exported" role="status">
      <h3>${exportResult.is_stopped ? 'Stopped. Written already:' : 'Exported'}</h3>
      <ul>${exportResult.files.map((file) => html`<li key=${file}><code>${relativePath(file, folder)}</code></li>`)}</ul>
      ${exportResult.is_unpainted && html`<p>${UNPAINTED_TEXT}</p>`}
      ${
        exportResult.command &&
        html`<h3>The same from the command line</h3>
        <${CommandLine} text=${exportResult.command} app=${app} />`
      }
    </div>`
    }
  </${Dialog}>`;
}

/** @param {{text: string, app: App}} props */
function CommandLine({ text, app }) {
  return html`<div class="command"><code tabindex="0">${text}</code>
    <${CopyButton} text=${text} label="Copy" app=${app} />
  </div>`;
}

/** A button that copies, and confirms it in its label.
 * @param {{text: string, app: App, label?: string, tip?: string}} props */
function CopyButton({ text, app, label, tip }) {
  const [isCopied, setCopied] = useState(false);
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      setCopied(true);
    } catch {
      // Browsers allow copying only to pages from this machine or over https.
      app.session.toast('This browser does not let the page copy. Select the text instead.');
    }
  };
  return html`<${Button} label=${label && (isCopied ? 'Copied' : label)} tip=${isCopied && tip ? 'Copied' : tip}
    icon=${isCopied ? 'check' : 'copy'} act=${copy} />`;
}
