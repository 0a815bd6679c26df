/** Dialogs over the painter: keyboard shortcuts and export. */

import { html, useState } from '../vendor/preact.js';
import { ProgressBar } from './progress_bar.js';
import { Button, Checkbox, Dialog } from './controls.js';
import { ExportKind } from './exports/export_kind.js';
import { ExportName, suggestedName } from './exports/export_name.js';
import { FinalRenderDialog } from './exports/final_render.js';
import { percentText, progressText, relativePath } from './format.js';
import { LooksDialog } from './looks_dialog.js';
import { PresetsDialog } from './presets_dialog.js';
import { MoveDialog } from './searches/move_dialog.js';
import { ShortcutsDialog } from './shortcuts_dialog.js';
import { fill, words } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {{ui: Ui, app: App}} props */
export function Dialogs({ ui, app }) {
  const close = () => app.store.set({ dialog: null });
  if (ui.dialog === 'keys') return html`<${ShortcutsDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'export') return html`<${ExportDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'render')
    return html`<${FinalRenderDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'move') return html`<${MoveDialog} app=${app} close=${close} />`;
  if (ui.dialog === 'looks') return html`<${LooksDialog} ui=${ui} app=${app} close=${close} />`;
  if (ui.dialog === 'presets') return html`<${PresetsDialog} ui=${ui} app=${app} close=${close} />`;
  return null;
}

/** @type {{key: import("../engine/messages.js").Export["outputs"][number], label: string,
 *   description: string}[]} */
const EXPORTS = [
  {
    key: 'target',
    label: words.dialogs.painting,
    description: words.dialogs.paintingExrForLightpaintSolve,
  },
  {
    key: 'layers',
    label: words.dialogs.layers,
    description: words.dialogs.layersExrAndLayersOraFor,
  },
  {
    key: 'picture',
    label: words.dialogs.picture,
    description: words.dialogs.answerPngTheAnswerAsA,
  },
  {
    key: 'lighting',
    label: words.dialogs.lighting,
    description: words.dialogs.lightingJsonLevelAndColourOf,
  },
  { key: 'relit', label: words.dialogs.scene, description: words.dialogs.relitXmlTheSceneWithThis },
  {
    key: 'report',
    label: words.dialogs.report,
    description: words.dialogs.reportHtmlPaintingAnswerAnd,
  },
];

/** Exports that are not ticked at first: few people need them. @type {string[]} */
const UNTICKED = ['layers'];

const UNPAINTED_TEXT = words.dialogs.nothingIsPaintedYetSoNo;

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
  const [name, setName] = useState(() => suggestedName(ui));
  const isBusy = ui.isExporting;
  const { exportResult } = ui;
  const folder = ui.state?.folder ?? '';
  return html`<${Dialog} title=${words.dialogs.export} close=${close} class="export">
    <${ExportKind} value="export" app=${app} />
    <${ExportName} name=${name} change=${setName} />
    ${available.map(
      ({ key, label, description }) => html`<div class="export-row" key=${key}>
      <${Checkbox} label=${label} checked=${outputs.includes(key)} change=${(
        /** @type {boolean} */ on,
      ) => setOutputs(on ? [...outputs, key] : outputs.filter((output) => output !== key))} />
      <span class="faint">${description}</span></div>`,
    )}
    ${
      ui.master !== 1 &&
      html`<p>${fill(words.dialogs.theMasterIsAtPictureLighting, { percent: percentText(ui.master) })}</p>`
    }
    <div class="row"><span class="faint folder">${fill(words.dialogs.to, { folder: `${folder}/exports` })}</span>
      <${CopyButton} text=${`${folder}/exports`} tip=${words.dialogs.copyTheFoldersPath} app=${app} />
      <${Button} label=${isBusy ? words.dialogs.exporting : words.dialogs.export} primary disabled=${isBusy || !outputs.length || !name.trim()}
        act=${() => app.session.exportFiles(outputs, name.trim())} /></div>
    ${
      isBusy &&
      html`<div class="row"><span class="faint folder">${words.dialogs.youCanCloseThisWindow}</span>
        <${ProgressBar} progress=${ui.exportProgress ?? { done: 0, total: 0 }} label=${words.dialogs.exportProgress} />
        <span class="faint">${ui.exportProgress && progressText(ui.exportProgress)}</span>
        <${Button} label=${words.dialogs.stop} icon="close" act=${() => app.session.exportFiles([])}
          tip=${words.dialogs.filesThatAreWrittenAlreadyStay} /></div>`
    }
    ${
      exportResult &&
      html`<div class="exported" role="status">
      <h3>${exportResult.is_stopped ? words.dialogs.stoppedWrittenAlready : words.dialogs.exported}</h3>
      <ul>${exportResult.files.map((file) => html`<li key=${file}><code>${relativePath(file, folder)}</code></li>`)}</ul>
      ${exportResult.is_unpainted && html`<p>${UNPAINTED_TEXT}</p>`}
      ${
        exportResult.command &&
        html`<h3>${words.dialogs.theSameFromTheCommandLine}</h3>
        <${CommandLine} text=${exportResult.command} app=${app} />`
      }
    </div>`
    }
  </${Dialog}>`;
}

/** @param {{text: string, app: App}} props */
function CommandLine({ text, app }) {
  return html`<div class="command"><code tabindex="0">${text}</code>
    <${CopyButton} text=${text} label=${words.dialogs.copy} app=${app} />
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
      app.session.toast(words.dialogs.thisBrowserDoesNotLetThe);
    }
  };
  return html`<${Button} label=${label && (isCopied ? words.dialogs.copied : label)} tip=${isCopied && tip ? words.dialogs.copied : tip}
    icon=${isCopied ? 'check' : 'copy'} act=${copy} />`;
}
