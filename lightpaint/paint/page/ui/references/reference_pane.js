/** Reference pictures beside the canvas, and *Look like this*, which asks for their light. */

import { t } from '../../language/language.js';
import { html, useRef, useState } from '../../vendor/preact.js';
import { Button, Checkbox, Choice, option } from '../controls.js';
import { Thumbnail } from '../thumbnail.js';
import { PICTURE_ENDINGS, addReference } from './reference_files.js';
import { ReferencePicture } from './reference_picture.js';
import { shownPairs, shownReference } from './reference_state.js';

/** @import { App, Ui } from '../ui_state.js' */
/** @import { ComparedAreas } from './reference_state.js' */

/** @type {{value: ComparedAreas, label: string, tip?: string}[]} */
const AREAS = [
  option('whole', t('Whole'), t('The colour of all of it, of its lit parts and its shadows')),
  option('regions', t('Regions'), t('Also its top, as ceiling or sky, its middle and its bottom')),
  option('parts', t('Same view'), t('For a picture of this scene from here: each part, softly')),
  option('pairs', t('Places'), t('Places that you press, in the reference and in the picture')),
];

/** @param {{ui: Ui, app: App}} props */
export function ReferencePane({ ui, app }) {
  const { store } = app;
  const input = useRef(/** @type {HTMLInputElement | null} */ (null));
  const [isOver, setOver] = useState(false);
  if (!ui.isReferenceOpen || !ui.ready) return null;
  const shown = shownReference(ui);
  const take = (/** @type {any} */ { currentTarget }) => {
    void addReference(app, currentTarget.files[0]);
    currentTarget.value = ''; // so that the same file can be chosen again
  };
  const drop = (/** @type {DragEvent} */ event) => {
    if (!event.dataTransfer?.types.includes('Files')) return;
    event.preventDefault();
    event.stopPropagation();
    setOver(false);
    const root = /** @type {HTMLElement} */ (event.currentTarget).closest('.lightpaint');
    root?.dispatchEvent(new DragEvent('dragleave')); // the frame that all drops have
    void addReference(app, event.dataTransfer.files[0]);
  };
  const choose = () => input.current?.click();
  return html`<aside class=${`reference-pane ${isOver ? 'is-over' : ''}`} aria-label=${t('References')}
    onDragEnter=${() => setOver(true)} onDragLeave=${() => setOver(false)} onDrop=${drop}>
    <div class="reference-head"><h2>${t('Reference')}</h2><span class="spring"></span>
      <${Button} icon="plus" tip=${t('Add a picture. You can also drop one, or paste it with Ctrl V.')} act=${choose} />
      <${Button} icon="close" tip=${t('Close the references')}
        act=${() => store.set({ isReferenceOpen: false, clickAction: null })} />
    </div>
    <input type="file" accept=${[...PICTURE_ENDINGS, 'image/*'].join()} hidden ref=${input} onChange=${take}
      aria-hidden="true" tabindex="-1" />
    ${
      shown
        ? html`<${ReferencePicture} key=${shown.id} reference=${shown} ui=${ui} app=${app} />
          <${ReferenceList} ui=${ui} app=${app} shown=${shown.id} />
          <${LookLikeFields} ui=${ui} app=${app} shown=${shown.id} />`
        : html`<div class="reference-none"><p>${t('A picture whose light you want here.')}</p>
          <p class="faint">${t('Drop it, paste it, or choose a file.')}</p>
          <${Button} label=${t('Choose a file …')} act=${choose} /></div>`
    }
    ${ui.isReferenceComing && html`<p class="faint" role="status">${t('Reading the picture …')}</p>`}
  </aside>`;
}

/** The pictures of all references, and the name of the shown one.
 * @param {{ui: Ui, app: App, shown: number}} props */
function ReferenceList({ ui, app, shown }) {
  const name = ui.references.find(({ id }) => id === shown)?.name ?? '';
  return html`<div class="reference-name"><span class="spring" data-tip=${name}>${name}</span>
      <${Button} icon="trash" tip=${t('Remove {name}. Layers made of it stay.', { name })}
        act=${() => app.session.send('drop_reference', { reference: shown })} /></div>
    ${
      ui.references.length > 1 &&
      html`<ul class="reference-list" aria-label=${t('All references')}>${ui.references.map(
        ({ id, name: other }) => html`<li key=${id}><button type="button" data-tip=${other}
          aria-label=${t('Show {name}', { name: other })} aria-current=${id === shown ? 'true' : undefined}
          onClick=${() => app.store.set({ reference: id, clickAction: null })}>
          <${Thumbnail} name=${`reference/${id}`} generation=${0} app=${app} /></button></li>`,
      )}</ul>`
    }`;
}

/** What is compared, and the button. @param {{ui: Ui, app: App, shown: number}} props */
function LookLikeFields({ ui, app, shown }) {
  const { store, session, engine } = app;
  const [isBusy, setBusy] = useState(false);
  const pairs = shownPairs(ui);
  const arePairs = ui.comparedAreas === 'pairs';
  const ask = async () => {
    engine.cancel();
    const before = new Set(store.value.layers.map(({ id }) => id));
    store.set((state) => ({ open: { ...state.open, layers: true }, hint: false }));
    setBusy(true); // large pictures take seconds
    await session.send('look_like', {
      reference: shown,
      areas: ui.comparedAreas,
      pairs: pairs.map(({ reference, picture }) => ({ reference, picture })),
      view: ui.view,
      matches_brightness: ui.matchesBrightness,
    });
    setBusy(false);
    // Its strength is what people change next, and its many layers hardly ever.
    const group = store.value.layers.find(({ id, kind }) => kind === 'group' && !before.has(id));
    if (group)
      store.set(({ open }) => ({ openLayer: group.id, open: { ...open, [`layer ${group.id}`]: false } }));
  };
  return html`<div class="look-like">
    <${Choice} label=${t('What is compared')} value=${ui.comparedAreas} choices=${AREAS}
      change=${(/** @type {ComparedAreas} */ comparedAreas) => store.set({ comparedAreas, clickAction: null })} />
    ${arePairs && html`<${PairList} ui=${ui} app=${app} />`}
    <${Checkbox} label=${t('As bright as it')} checked=${ui.matchesBrightness}
      tip=${t('Otherwise only the differences within it count, since its exposure is unknown')}
      change=${(/** @type {boolean} */ matchesBrightness) => store.set({ matchesBrightness })} />
    <${Button} label=${t('Look like this')} primary disabled=${isBusy || (arePairs && !pairs.length)} act=${() => void ask()}
      tip=${t('Asks for its light in layers. Undo takes them back.')} />
  </div>`;
}

/** The pairs of places, each with a button that removes it. @param {{ui: Ui, app: App}} props */
function PairList({ ui, app }) {
  const pairs = shownPairs(ui);
  const remove = (/** @type {Ui["placePairs"][number]} */ pair) =>
    app.store.set(({ placePairs }) => ({ placePairs: placePairs.filter((other) => other !== pair) }));
  return html`<p class="faint">${
    ui.clickAction?.mode === 'pair'
      ? t('Now press the place in the picture that should look like it.')
      : t('Press a place in the reference, then one in the picture.')
  }</p>
  <ul class="pair-list" aria-label=${t('Pairs of places')}>${pairs.map(
    (pair, k) => html`<li key=${k}><span class="pair-number">${k + 1}</span>
      <${Button} icon="close" tip=${t('Remove pair {number}', { number: k + 1 })} act=${() => remove(pair)} /></li>`,
  )}</ul>`;
}
