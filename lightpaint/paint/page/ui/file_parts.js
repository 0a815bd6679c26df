/** Files that go to the session in parts: no side of an array in a message may be long. */

import { t } from '../language/language.js';

/** @import { App } from './ui_state.js' */

/** Bytes of a row of a part, and rows of a part. */
const [ROW_BYTES, PART_ROWS] = [2 ** 16, 16];

/** Send a file. @param {App} app @param {File} file @param {"import_layers" | "add_reference"} kind
 * @param {any} fields further ones of each request
 * @returns {Promise<boolean>} whether all of it has arrived */
export async function sendFile({ session }, file, kind, fields) {
  try {
    const bytes = new Uint8Array(await file.arrayBuffer());
    for (let start = 0; start < bytes.length; ) {
      const rows = Math.min(PART_ROWS, Math.floor((bytes.length - start) / ROW_BYTES));
      const count = rows ? rows * ROW_BYTES : bytes.length - start;
      const data = bytes.slice(start, start + count);
      const part = { data, shape: rows ? [rows, ROW_BYTES] : [count] };
      const about = { name: file.name, size: bytes.length, start, ...fields };
      const reply = await session.host.send(kind, about, { part });
      session.receive(reply);
      if (reply.kind !== 'started') return false;
      start += count;
    }
    if (!bytes.length) session.toast(t('{name} is empty.', { name: file.name }), 'warn');
    return bytes.length > 0;
  } catch (error) {
    session.toast(error instanceof Error ? error.message : String(error), 'warn');
    return false;
  }
}
