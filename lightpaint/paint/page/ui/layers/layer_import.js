/** Layers from a file that somebody drops on the painter or chooses: sent to the session in parts. */

import { html, useEffect, useRef, useState } from '../../vendor/preact.js';
import { Button, Dialog } from '../controls.js';
import { fill, words } from '../../language/language.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */

/** Bytes of a part of a file, in rows: no side of an array in a message may be longer. */
const [ROW_BYTES, PART_ROWS] = [2 ** 16, 16];

/** Files that may hold layers, by how their names end. */
const ENDINGS = ['.ora', '.exr'];

/** Take a file: import it, or ask what becomes of the layers that are there.
 * @param {App} app @param {File | undefined} file */
export function takeLayerFile({ store, session, engine }, file) {
  if (!file) return;
  if (!ENDINGS.some((ending) => file.name.toLowerCase().endsWith(ending))) {
    session.toast(fill(words.layerImport.hasNoLayersDropAnOra, { name: file.name }), 'warn');
    return;
  }
  const { layers, isPaintingEmpty, views } = store.value;
  const isEmpty = layers.length === 1 && isPaintingEmpty;
  if (views.length > 1) void sendLayerFile({ store, session, engine }, file, false);
  else if (isEmpty) void sendLayerFile({ store, session, engine }, file, true);
  else store.set({ layerFile: file });
}

/** Send a file to the session. @param {App} app @param {File} file @param {boolean} replaces */
async function sendLayerFile({ store, session }, file, replaces) {
  store.set({ layerFile: null });
  session.toast(fill(words.layerImport.importing, { name: file.name }));
  const { view } = store.value;
  try {
    const bytes = new Uint8Array(await file.arrayBuffer());
    for (let start = 0; start < bytes.length;) {
      const rows = Math.min(PART_ROWS, Math.floor((bytes.length - start) / ROW_BYTES));
      const count = rows ? rows * ROW_BYTES : bytes.length - start;
      const data = bytes.slice(start, start + count);
      const fields = { name: file.name, size: bytes.length, start, view, replaces };
      const part = { data, shape: rows ? [rows, ROW_BYTES] : [count] };
      const reply = await session.host.send('import_layers', fields, { part });
      session.receive(reply);
      if (reply.kind !== 'started') return;
      start += count;
    }
  } catch (error) {
    session.toast(error instanceof Error ? error.message : String(error), 'warn');
  }
}

/** The button that opens a file dialog. @param {{app: App}} props */
export function LayerImportButton({ app }) {
  const ref = useRef(/** @type {HTMLInputElement | null} */ (null));
  const take = (/** @type {any} */ { currentTarget }) => {
    takeLayerFile(app, currentTarget.files[0]);
    currentTarget.value = ''; // so that the same file can be chosen again
  };
  return html`<div class="layer-import">
    <${Button} label=${words.layerImport.importLayers} tip=${words.layerImport.fromAnOraFileOfAny}
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
  return html`<${Dialog} title=${words.layerImport.importLayers2} close=${close} class="layer-import-dialog">
    <p>${words.layerImport.whereDoTheLayersOf} <strong>${file.name}</strong> ${words.layerImport.go}</p>
    <div class="row">
      <${Button} label=${words.layerImport.putThemOnTop} primary act=${() => sendLayerFile(app, file, false)} />
      <${Button} label=${words.layerImport.replaceAllLayers} act=${() => sendLayerFile(app, file, true)} />
      <${Button} label=${words.layerImport.cancel} act=${close} />
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
      takeLayerFile(app, event.dataTransfer?.files[0]);
    };
    root().addEventListener('dragover', over, { signal });
    root().addEventListener('dragleave', leave, { signal });
    root().addEventListener('drop', drop, { signal });
    return () => ends.abort();
  }, []);
  return (
    isOver &&
    html`<div class="layer-drop" aria-hidden="true"><span>${words.layerImport.dropToImportLayers}</span></div>`
  );
}
