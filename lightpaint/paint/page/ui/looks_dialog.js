/** All looks at once: a contact sheet of their pictures, and the lamps of one against another's. */

import { nameInView } from '../engine/message_frames.js';
import { html, useRef, useState } from '../vendor/preact.js';
import { COMPARED_COUNT } from '../engine/picture_slots.js';
import { Button, Checkbox, Choice, Dialog, Select } from './controls.js';
import { saveFile } from './exports/export_fields.js';
import { LampTable } from './lamp_table.js';
import { currentLook, loadLook } from './look_actions.js';
import { showWall } from './look_wall.js';
import { sheetStyle, Thumbnail } from './thumbnail.js';
import { toggled } from './ui_store.js';
import { t } from '../language/language.js';

/** @import { App, Look, Ui } from './ui_state.js' */

const PARTS = [{ value: 'pictures', label: t('Pictures') }, { value: 'lamps', label: t('Lamps') }];

/** @param {{ui: Ui, app: App, close: () => void}} props */
export function LooksDialog({ ui, app, close }) {
  const [part, setPart] = useState('pictures');
  return html`<${Dialog} title=${t('Looks')} close=${close} class="looks-dialog">
    <${Choice} label=${t('What to show of the looks')} value=${part} choices=${PARTS} change=${setPart} />
    ${
      part === 'pictures'
        ? html`<${ContactSheet} ui=${ui} app=${app} close=${close} />`
        : html`<${LampComparison} ui=${ui} />`
    }
  </${Dialog}>`;
}

/** The pictures of all looks, in the view that is shown. @param {{ui: Ui, app: App, close: () => void}} props */
function ContactSheet({ ui, app, close }) {
  const sheet = useRef(/** @type {HTMLElement | null} */ (null));
  const current = currentLook(ui);
  const [marked, setMarked] = useState(/** @type {number[]} */ ([]));
  const load = (/** @type {number} */ id) => {
    close();
    void loadLook(app, id);
  };
  const pictureOf = (/** @type {Look} */ { thumbnail }) => {
    const inView = nameInView(thumbnail, ui.view);
    return inView in ui.resources ? inView : thumbnail;
  };
  return html`<ul class="sheet" style=${sheetStyle(ui)} ref=${sheet}>
      ${ui.looks.map((look) => {
        const picture = pictureOf(look);
        return html`<li key=${look.id}><button type="button" onClick=${() => load(look.id)}
          aria-current=${look.id === current ? 'true' : undefined} aria-label=${t('Load {name}', { name: look.name })}>
          <${Thumbnail} name=${picture} generation=${ui.resources[picture] ?? 0} app=${app} />
          <span>${look.name}</span></button>
          <${Checkbox} label=${t('Compare {name}', { name: look.name })} hidden
            checked=${marked.includes(look.id)} change=${() => setMarked(toggled(marked, look.id))}
            disabled=${marked.length >= COMPARED_COUNT && !marked.includes(look.id)} /></li>`;
      })}
    </ul>
    <div class="row"><${Button} icon="side" label=${t('Side by side')} primary
        tip=${t('The marked looks at full size, two to four')} disabled=${marked.length < 2} act=${() => showWall(app, marked)} />
      <span class="spring"></span>
      <${Button} icon="export" label=${t('Save as a picture')}
        act=${() => sheet.current && saveSheet(sheet.current, ui.looks)} /></div>`;
}

/** Space between the pictures of a saved sheet, and height of the names below them, in pixels. */
const [GAP, NAME_HEIGHT] = [16, 28];

/** Save the contact sheet as a PNG file. @param {HTMLElement} sheet @param {Look[]} looks */
function saveSheet(sheet, looks) {
  const pictures = [...sheet.querySelectorAll('canvas')];
  const width = Math.max(...pictures.map((picture) => picture.width));
  const height = Math.max(...pictures.map((picture) => picture.height));
  const columns = Math.ceil(Math.sqrt(looks.length));
  const canvas = document.createElement('canvas');
  canvas.width = GAP + columns * (width + GAP);
  canvas.height = GAP + Math.ceil(looks.length / columns) * (height + NAME_HEIGHT + GAP);
  const context = canvas.getContext('2d');
  if (!context) return;
  context.fillStyle = '#18181a';
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = '#eee';
  context.font = '14px system-ui, sans-serif';
  looks.forEach(({ name }, k) => {
    const x = GAP + (k % columns) * (width + GAP);
    const y = GAP + Math.floor(k / columns) * (height + NAME_HEIGHT + GAP);
    context.drawImage(pictures[k], x, y);
    context.fillText(name, x, y + height + 20, width);
  });
  canvas.toBlob((blob) => blob && saveFile(blob, 'looks.png'));
}

/** @param {{ui: Ui}} props */
function LampComparison({ ui }) {
  const { looks } = ui;
  const [ids, setIds] = useState([looks[looks.length - 2]?.id, looks[looks.length - 1]?.id]);
  const [first, second] = ids.map((id) => looks.find((look) => look.id === id));
  const choices = looks.map(({ id, name }) => ({ value: String(id), label: name }));
  const choose = (/** @type {number} */ which) => (/** @type {string} */ id) =>
    setIds(ids.map((other, k) => (k === which ? Number(id) : other)));
  if (!first || !second)
    return html`<p class="faint">${t('Save two looks to compare their lamps.')}</p>`;
  return html`<div class="row compared">
      <${Select} label=${t('Lamps of')} value=${String(first.id)} choices=${choices} change=${choose(0)} />
      <${Select} label=${t('against')} value=${String(second.id)} choices=${choices} change=${choose(1)} />
    </div>
    <${LampTable} ui=${ui} first=${first} second=${second} />`;
}
