/** The dialog for final renders: at any size, in the background, with the files that they became. */

import { html, useState } from '../../vendor/preact.js';
import { Button, Checkbox, Dialog, NumberField, ProgressBar } from '../controls.js';
import { percentText, progressText, relativePath } from '../format.js';
import { Thumbnail } from '../thumbnail.js';
import { ExportName, suggestedName, ExportKind, saveFile } from './export_fields.js';
import { runningRender } from './render_state.js';
import { toggled } from '../ui_store.js';
import { t } from '../../language/language.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { RenderInfo as Render } from '../../engine/messages.js' */

/** @typedef {import("../../engine/messages.js").Requests["render_final"]} Request */

/** Widths that are one press away, in pixels. */
const WIDTHS = [
  { width: 1280, label: t('HD') },
  { width: 1920, label: t('Full HD') },
  { width: 3840, label: t('4K') },
];

/** Least and largest width, as the session takes it, and samples per pixel. */
const [MIN_WIDTH, MAX_WIDTH, MAX_SPP] = [16, 2 ** 14, 2 ** 16];

/** What a render has at first; later what the last one had while the page was open.
 * @type {{width: number, spp: number, formats: Request["formats"]}} */
let lastSettings = { width: 1920, spp: 256, formats: ['exr', 'png'] };

/** @type {[format: "exr" | "png", label: string, description: string][]} */
const FORMATS = [
  ['exr', t('EXR'), t('render.exr: linear light as rendered, its noise, and a denoised layer')],
  ['png', t('PNG, 16 bits'), t('render.png: denoised, through the view and exposure of the scene')],
];

/** @param {{ui: Ui, app: App, close: () => void}} props */
export function FinalRenderDialog({ ui, app, close }) {
  const canRender = Boolean(ui.state?.can_render);
  return html`<${Dialog} title=${t('Export')} close=${close} class="export">
    <${ExportKind} value="render" app=${app} />
    ${
      !canRender &&
      html`<p>${t('There is no scene to render: this session was opened from a saved basis, or from light groups of another renderer. Export the lighting, and render with it there.')}</p>`
    }
    <${RenderSettings} ui=${ui} app=${app} disabled=${!canRender} />
    ${ui.renders.length > 0 && html`<${RenderList} ui=${ui} app=${app} />`}
  </${Dialog}>`;
}

/** @param {{ui: Ui, app: App, disabled: boolean}} props */
function RenderSettings({ ui, app, disabled }) {
  const [name, setName] = useState(() => suggestedName(ui));
  const [settings, setSettings] = useState(lastSettings);
  const { width, spp } = settings;
  const formats = settings.formats ?? [];
  const set = (/** @type {Partial<typeof lastSettings>} */ changes) => {
    lastSettings = { ...settings, ...changes };
    setSettings(lastSettings);
  };
  const [rows, columns] = /** @type {[number, number]} */ (ui.state?.size ?? [9, 16]);
  const height = Math.max(1, Math.round((width * rows) / columns));
  const begin = () =>
    app.session.send('render_final', { name: name.trim(), width, spp, formats, view: ui.view });
  const folder = ui.state?.folder ?? '';
  return html`<fieldset class="render-settings" disabled=${disabled}>
    <${ExportName} name=${name} change=${setName} />
    <div class="row"><${NumberField} label=${t('Width')} value=${width} min=${MIN_WIDTH} max=${MAX_WIDTH} digits=${0}
        disabled=${disabled} change=${(/** @type {number} */ value) => set({ width: value })} />
      <span>${t('× {height} pixels', { height })}</span>
      ${WIDTHS.map(
        (choice) => html`<${Button} key=${choice.width} label=${choice.label} pressed=${choice.width === width}
          disabled=${disabled} act=${() => set({ width: choice.width })} />`,
      )}</div>
    <div class="row"><${NumberField} label=${t('Samples')} value=${spp} min=${2} max=${MAX_SPP} digits=${0} step=${64}
        disabled=${disabled} change=${(/** @type {number} */ value) => set({ spp: value })}
        tip=${t('Twice as many take twice the time and leave 0.7 times the noise')} /><span class="faint">${t('per pixel')}</span></div>
    ${FORMATS.map(
      ([format, label, description]) => html`<div class="export-row" key=${format}>
        <${Checkbox} label=${label} checked=${formats.includes(format)} disabled=${disabled}
          change=${() => set({ formats: toggled(formats, format) })} />
        <span class="faint">${description}</span></div>`,
    )}
    ${ui.views.length > 1 && html`<p>${t('Of the view that is shown, {view}.', { view: ui.views[ui.view].name })}</p>`}
    ${ui.master !== 1 && html`<p>${t('The master is at {percent}: the render is dimmed.', { percent: percentText(ui.master) })}</p>`}
    <div class="row"><span class="faint folder">${t('to {folder}', { folder: `${folder}/renders` })}</span>
      <${Button} icon="camera" label=${t('Render', { context: 'verb' })} primary act=${begin}
        disabled=${disabled || !name.trim() || !formats.length} /></div>
    <p class="faint">${t('You can go on painting, and close this window or the page: the render is of the answer as it is now. It ends with the painter.')}</p>
  </fieldset>`;
}

/** The renders since the painter was started, the newest on top. @param {{ui: Ui, app: App}} props */
function RenderList({ ui, app }) {
  const latestFirst = [...ui.renders].reverse();
  return html`<ul class="renders" aria-label=${t('Final renders, the newest on top')}>${latestFirst.map(
    (render) => html`<${RenderRow} key=${render.id} render=${render} ui=${ui} app=${app} />`,
  )}</ul>`;
}

/** @param {{render: Render, ui: Ui, app: App}} props */
function RenderRow({ render, ui, app }) {
  const { id, name, width, height, spp, state } = render;
  const isDone = state === 'done';
  const isOpen = state === 'waiting' || state === 'rendering';
  const size = height ? t('{width} × {height}', { width, height }) : t('{width} wide', { width });
  return html`<li class=${`render is-${state}`}>
    ${isDone && html`<${Thumbnail} name=${`render/${id}`} generation=${id} app=${app} />`}
    <div>
      <div class="row"><strong>${name}</strong><span class="faint">${size}, ${t('{spp} samples', { spp })}</span>
        <span class="spring"></span>
        ${
          isOpen
            ? html`<${Button} icon="close" label=${t('Stop')} tip=${t('Stop this render, which writes no file then')}
              act=${() => app.session.send('stop_render', { render: id })} />`
            : html`<${Button} icon="trash" tip=${t('Take {name} off this list; its files stay', { name })}
              act=${() => app.session.send('drop_render', { render: id })} />`
        }</div>
      <${RenderStatus} render=${render} ui=${ui} app=${app} />
    </div>
  </li>`;
}

/** @param {{render: Render, ui: Ui, app: App}} props */
function RenderStatus({ render, ui, app }) {
  const { id, state, text, files } = render;
  if (state === 'rendering') {
    const progress = ui.renderProgress ?? { done: 0, total: 0 };
    const isDenoising = progress.total > 0 && progress.done >= progress.total;
    return html`<div class="row" role="status"><${ProgressBar} progress=${progress} label=${t('Final render')} />
      <span class="faint">${isDenoising ? t('denoising') : progressText(progress)}</span></div>`;
  }
  if (state === 'failed') return html`<p>${text}</p>`;
  if (state === 'waiting')
    return html`<p class="faint">${runningRender(ui)?.id === id ? t('Finding the exact answer') : t('Waits for the render before it')}</p>`;
  if (state === 'stopped') return html`<p class="faint">${t('Stopped; no file was written')}</p>`;
  const folder = ui.state?.folder ?? '';
  return html`<ul class="render-files">${files.map((file) => {
    const path = relativePath(file, folder);
    const fileName = path.split(/[/\\]/).at(-1) ?? path;
    return html`<li key=${file}><code>${path}</code>
      <${Button} icon="export" tip=${t('Download {name}', { name: fileName })}
        act=${() => void download(app, `render_file/${id}/${fileName}`, `${render.name} ${fileName}`)} /></li>`;
  })}</ul>`;
}

/** Save a file of a render where the browser saves files. @param {App} app @param {string} name of it
 * in the session @param {string} fileName */
async function download({ session }, name, fileName) {
  try {
    const { data } = await session.host.fetch(name);
    saveFile(new Blob([/** @type {any} */ (data)]), fileName);
  } catch (error) {
    session.toast(error instanceof Error ? error.message : String(error), 'warn');
  }
}
