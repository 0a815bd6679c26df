/** Layers from a file that somebody drops on the painter or chooses: sent to the session in parts. */

import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { Button, Dialog } from '../controls.js';
import { t } from '../../language/language.js';
import { sendFile } from '../file_parts.js';
import { addReference, isPicture } from '../references/reference_files.js';

/** @import { App, Ui } from '../ui_state.js' */

/** Files that may hold layers, by how their names end. */
const ENDINGS = ['.ora', '.exr'];

/** Names of EXRs that surely are of layers: the painter writes such ones. */
const LAYER_NAME = /layers/i;

/** Take a file that was dropped: of layers or, for a picture, as a reference.
 * @param {App} app @param {File | undefined} file */
function takeDroppedFile(app, file) {
  if (!file) return;
  const isExr = file.name.toLowerCase().endsWith('.exr');
  if (isExr && !LAYER_NAME.test(file.name)) app.store.set({ layerFile: file });
  else if (!isExr && isPicture(file)) void addReference(app, file);
  else takeLayerFile(app, file);
}

/** Take a file: import it, or ask what becomes of the layers that are there.
 * @param {App} app @param {File | undefined} file */
function takeLayerFile({ store, session, engine }, file) {
  if (!file) return;
  if (!ENDINGS.some((ending) => file.name.toLowerCase().endsWith(ending))) {
    session.toast(
      t('{name} has no layers: choose an .ora file, or layers.exr.', { name: file.name }),
      'warn',
    );
    return;
  }
  const { layers, isPaintingEmpty, views } = store.value;
  const isEmpty = layers.length === 1 && isPaintingEmpty;
  if (views.length > 1) void sendLayerFile({ store, session, engine }, file, false);
  else if (isEmpty) void sendLayerFile({ store, session, engine }, file, true);
  else store.set({ layerFile: file });
}

/** Send a file to the session. @param {App} app @param {File} file @param {boolean} replaces */
async function sendLayerFile(app, file, replaces) {
  app.store.set({ layerFile: null });
  app.session.toast(t('Importing {name} …', { name: file.name }));
  await sendFile(app, file, 'import_layers', { view: app.store.value.view, replaces });
}

/** The button that opens a file dialog. @param {{app: App}} props */
export function LayerImportButton({ app }) {
  const ref = useRef(/** @type {HTMLInputElement | null} */ (null));
  const take = (/** @type {any} */ { currentTarget }) => {
    takeLayerFile(app, currentTarget.files[0]);
    currentTarget.value = ''; // so that the same file can be chosen again
  };
  return html`<div class="layer-import">
    <${Button} label=${t('Import layers …')} tip=${t('From an .ora file of any program, or layers.exr. You can also drop the file here.')}
      act=${() => ref.current?.click()} />
    <input type="file" accept=${ENDINGS.join()} hidden ref=${ref} onChange=${take}
      aria-hidden="true" tabindex="-1" />
  </div>`;
}

/** What becomes of the layers that are there, for a file that has been dropped or chosen.
 * @param {{ui: Ui, app: App}} props */
export function LayerImportDialog({ ui, app }) {
  const file = ui.layerFile;
  if (!file) return null;
  const close = () => app.store.set({ layerFile: null });
  const isReference = isPicture(file);
  const use = () => {
    close();
    void addReference(app, file);
  };
  const title = isReference ? t('Use a picture') : t('Import layers');
  return html`<${Dialog} title=${title} close=${close} class="layer-import-dialog">
    <p>${t('Where do the layers of')} <strong>${file.name}</strong> ${t('go?')}
      ${isReference && ` ${t('Or is it a picture to look at?')}`}</p>
    <div class="row">
      ${isReference && html`<${Button} label=${t('Use it as a reference')} primary act=${use} />`}
      <${Button} label=${t('Put them on top')} primary=${!isReference}
        act=${() => sendLayerFile(app, file, false)} />
      ${
        ui.views.length < 2 &&
        html`<${Button} label=${t('Replace all layers')}
          act=${() => sendLayerFile(app, file, true)} />`
      }
      <${Button} label=${t('Cancel')} act=${close} />
    </div>
  </${Dialog}>`;
}

/** The frame that shows, while a file is dragged over the painter, that it can be dropped.
 * @param {{app: App, root: () => HTMLElement}} props */
export function LayerDropFrame({ app, root }) {
  const [isOver, setOver] = useState(false);
  useEffect(() => {
    const ends = new AbortController();
    const { signal } = ends;
    const hasFile = (/** @type {DragEvent} */ event) =>
      event.dataTransfer?.types.includes('Files') ?? false;
    const over = (/** @type {DragEvent} */ event) => {
      if (!hasFile(event)) return;
      event.preventDefault(); // or the browser opens the file in place of the painter
      setOver(true);
    };
    const leave = (/** @type {DragEvent} */ event) => {
      if (!root().contains(/** @type {Node | null} */ (event.relatedTarget))) setOver(false);
    };
    const drop = (/** @type {DragEvent} */ event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      setOver(false);
      takeDroppedFile(app, event.dataTransfer?.files[0]);
    };
    root().addEventListener('dragover', over, { signal });
    root().addEventListener('dragleave', leave, { signal });
    root().addEventListener('drop', drop, { signal });
    return () => ends.abort();
  }, []);
  return (
    isOver &&
    html`<div class="layer-drop" aria-hidden="true"><span>${t('Drop a reference picture, or layers')}</span></div>`
  );
}
