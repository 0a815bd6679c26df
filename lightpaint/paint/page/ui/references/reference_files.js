/** Reference pictures from files and from the clipboard. */

import { useEffect } from '../../vendor/preact.js';
import { sendFile } from '../file_parts.js';
import { isTyping } from '../keyboard.js';

/** @import { App } from '../ui_state.js' */

/** Files that are pictures, by how their names end. */
export const PICTURE_ENDINGS = [
  ...['.png', '.jpg', '.jpeg', '.webp', '.exr', '.hdr'],
  ...['.tif', '.tiff', '.psd'],
];

/** @param {File} file */
export const isPicture = (file) =>
  file.type.startsWith('image/') ||
  PICTURE_ENDINGS.some((ending) => file.name.toLowerCase().endsWith(ending));

/** Send a picture to the session, where it becomes a reference. @param {App} app
 * @param {File | null | undefined} file */
export async function addReference(app, file) {
  if (!file) return;
  app.store.set({ isReferenceOpen: true, isReferenceComing: true });
  if (!(await sendFile(app, file, 'add_reference', {}))) app.store.set({ isReferenceComing: false });
}

/** Take pictures from the clipboard. @param {{app: App, root: () => HTMLElement}} props */
export function ReferencePaste({ app, root }) {
  useEffect(() => {
    const paste = (/** @type {ClipboardEvent} */ event) => {
      const isHere =
        event.composedPath().includes(root()) ||
        (event.target === document.body && Boolean(root().dataset.isWholePage));
      const file = [...(event.clipboardData?.files ?? [])].find(isPicture);
      if (!isHere || !file || isTyping(/** @type {any} */ (event)) || app.store.value.dialog) return;
      event.preventDefault();
      void addReference(app, file);
    };
    document.addEventListener('paste', paste);
    return () => document.removeEventListener('paste', paste);
  }, []);
  return null;
}
