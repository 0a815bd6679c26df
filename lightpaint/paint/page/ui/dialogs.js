/** Dialogs over the painter: keyboard shortcuts and export. */

import { html, useState, useEffect } from '../vendor/preact.js';
import { Button, Checkbox, Dialog, ProgressBar } from './controls.js';
import { ExportName, suggestedName, ExportKind } from './exports/export_fields.js';
import { FinalRenderDialog } from './exports/final_render.js';
import { percentText, progressText, relativePath, durationText } from './format.js';
import { LooksDialog } from './looks_dialog.js';
import { PresetsDialog } from './presets_dialog.js';
import { ShortcutsDialog } from './shortcuts_dialog.js';
import { toggled } from './ui_store.js';
import { t } from '../language/language.js';

/** @import { App, Ui } from './ui_state.js' */

/** @param {{ui: Ui, app: App}} props */
export function Dialogs({ ui, app }) {
  const close = () => app.store.set({ dialog: null });
  const Shown = ui.dialog && DIALOGS[ui.dialog];
  return Shown && html`<${Shown} ui=${ui} app=${app} close=${close} />`;
}

/** @type {[key: import("../engine/messages.js").Export["outputs"][number], label: string,
 *   description: string][]} */
const EXPORTS = [
  ['target', t('Painting'), t('painting.exr, for lightpaint solve')],
  ['layers', t('Layers'), t('layers.exr and layers.ora, for Krita and others')],
  ['picture', t('Picture'), t('answer.png: the answer as a picture')],
  ['lighting', t('Lighting'), t('lighting.json: level and colour of every light')],
  ['relit', t('Scene'), t('relit.xml: the scene with this lighting')],
  ['report', t('Report'), t('answer/report.html: painting, answer and analysis')],
];

/** Exports that are not ticked at first: few people need them. @type {string[]} */
const UNTICKED = ['layers'];

const UNPAINTED_TEXT = t('Nothing is painted yet, so no painting, layers or report were exported.');

/** @param {{ui: Ui, app: App, close: () => void}} props */
function ExportDialog({ ui, app, close }) {
  const available = EXPORTS.filter(
    ([key]) =>
      (key !== 'relit' || ui.state?.can_render) &&
      (key !== 'report' || ui.state?.can_report !== false),
  );
  const [outputs, setOutputs] = useState(
    available.map(([key]) => key).filter((key) => !UNTICKED.includes(key)),
  );
  const [name, setName] = useState(() => suggestedName(ui));
  const isBusy = ui.isExporting;
  const { exportResult } = ui;
  const folder = ui.state?.folder ?? '';
  return html`<${Dialog} title=${t('Export')} close=${close} class="export">
    <${ExportKind} value="export" app=${app} />
    <${ExportName} name=${name} change=${setName} />
    ${available.map(
      ([key, label, description]) => html`<div class="export-row" key=${key}>
      <${Checkbox} label=${label} checked=${outputs.includes(key)} 
        change=${() => setOutputs(toggled(outputs, key))} />
      <span class="faint">${description}</span></div>`,
    )}
    ${
      ui.master !== 1 &&
      html`<p>${t(
        'The master is at {percent}: picture, lighting and relit scene are dimmed; painting, report and the command are not.',
        { percent: percentText(ui.master) },
      )}</p>`
    }
    <div class="row"><span class="faint folder">${t('to {folder}', { folder: `${folder}/exports` })}</span>
      <${CopyButton} text=${`${folder}/exports`} tip=${t("Copy the folder's path")} app=${app} />
      <${Button} label=${isBusy ? t('Exporting …') : t('Export')} primary disabled=${isBusy || !outputs.length || !name.trim()}
        act=${() => app.session.exportFiles(outputs, name.trim())} /></div>
    ${
      isBusy &&
      html`<div class="row"><span class="faint folder">${t('You can close this window.')}</span>
        <${ProgressBar} progress=${ui.exportProgress ?? { done: 0, total: 0 }} label=${t('Exporting')} />
        <span class="faint">${ui.exportProgress && progressText(ui.exportProgress)}</span>
        <${Button} label=${t('Stop')} icon="close" act=${() => app.session.exportFiles([])}
          tip=${t('Files that are written already stay')} /></div>`
    }
    ${
      exportResult &&
      html`<div class="exported" role="status">
      <h3>${exportResult.is_stopped ? t('Stopped. Written already:') : t('Exported')}</h3>
      <ul>${exportResult.files.map((file) => html`<li key=${file}><code>${relativePath(file, folder)}</code></li>`)}</ul>
      ${exportResult.is_unpainted && html`<p>${UNPAINTED_TEXT}</p>`}
      ${
        exportResult.command &&
        html`<h3>${t('The same from the command line')}</h3>
        <${CommandLine} text=${exportResult.command} app=${app} />`
      }
    </div>`
    }
  </${Dialog}>`;
}

/** @param {{text: string, app: App}} props */
function CommandLine({ text, app }) {
  return html`<div class="command"><code tabindex="0">${text}</code>
    <${CopyButton} text=${text} label=${t('Copy')} app=${app} />
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
      app.session.toast(t('This browser does not let the page copy. Select the text instead.'));
    }
  };
  return html`<${Button} label=${label && (isCopied ? t('Copied') : label)} tip=${isCopied && tip ? t('Copied') : tip}
    icon=${isCopied ? 'check' : 'copy'} act=${copy} />`;
}

/** @typedef {import("../engine/messages.js").Events["place_estimate"]} Estimate */

/** @param {{app: App, close: () => void}} props */
function MoveDialog({ app, close }) {
  const { session } = app;
  const [estimate, setEstimate] = useState(/** @type {Estimate | null} */ (null));
  useEffect(() => {
    let isClosed = false;
    void session.send('estimate_place').then((reply) => {
      if (isClosed) return;
      if (reply?.kind === 'place_estimate') setEstimate(/** @type {any} */ (reply));
      else close(); // a toast says why
    });
    return () => {
      isClosed = true;
    };
  }, []);
  const begin = () => {
    close();
    void session.placeLights();
  };
  return html`<${Dialog} title=${t('Let lights move')} close=${close} class="move">
    <p role="status">${estimate ? estimate.text : t('Estimating the time …')}</p>
    ${estimate && html`<p><strong>${timeText(estimate)}</strong></p>`}
    <p class="faint">${t('You can go on looking and painting meanwhile, and stop at any time: with the best so far, or with every light where it is.')}</p>
    <div class="row"><${Button} label=${t('Cancel')} act=${close} />
      <${Button} icon="search" label=${t('Begin')} primary disabled=${!estimate} act=${begin} /></div>
  </${Dialog}>`;
}

/** @param {Estimate} estimate */
function timeText({ seconds, is_measured: isMeasured }) {
  const [low, high] = seconds.map(durationText);
  const time = low === high ? low : t('{low} to {high}', { low, high });
  return isMeasured
    ? t('About {time}, as an earlier search here.', { time })
    : t('About {time}.', { time });
}

/** The dialogs by what opens them. */
const DIALOGS = {
  keys: ShortcutsDialog,
  export: ExportDialog,
  render: FinalRenderDialog,
  move: MoveDialog,
  looks: LooksDialog,
  presets: PresetsDialog,
};
