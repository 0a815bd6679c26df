/** Reference pictures beside the canvas, and *Look like this*, which asks for their light. */

import { fill, words } from '../../language/language.js';
import { html, useRef, useState } from '../../vendor/preact.js';
import { Button, Checkbox, Choice } from '../controls.js';
import { Thumbnail } from '../thumbnail.js';
import { PICTURE_ENDINGS, addReference } from './reference_files.js';
import { ReferencePicture } from './reference_picture.js';
import { shownPairs, shownReference } from './reference_state.js';

/** @typedef {import("../ui_state.js").Ui} Ui */
/** @typedef {import("../shortcuts.js").App} App */
/** @typedef {import("./reference_state.js").ComparedAreas} ComparedAreas */

/** @type {{value: ComparedAreas, label: string, tip: string}[]} */
const AREAS = [
  { value: 'whole', label: words.references.whole, tip: words.references.wholeTip },
  { value: 'regions', label: words.references.regions, tip: words.references.regionsTip },
  { value: 'parts', label: words.references.sameView, tip: words.references.sameViewTip },
  { value: 'pairs', label: words.references.places, tip: words.references.placesTip },
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
  return html`<aside class=${`reference-pane ${isOver ? 'is-over' : ''}`} aria-label=${words.references.references}
    onDragEnter=${() => setOver(true)} onDragLeave=${() => setOver(false)} onDrop=${drop}>
    <div class="reference-head"><h2>${words.references.reference}</h2><span class="spring"></span>
      <${Button} icon="plus" tip=${words.references.addAPicture} act=${choose} />
      <${Button} icon="close" tip=${words.references.close}
        act=${() => store.set({ isReferenceOpen: false, clickAction: null })} />
    </div>
    <input type="file" accept=${[...PICTURE_ENDINGS, 'image/*'].join()} hidden ref=${input} onChange=${take}
      aria-hidden="true" tabindex="-1" />
    ${
      shown
        ? html`<${ReferencePicture} key=${shown.id} reference=${shown} ui=${ui} app=${app} />
          <${ReferenceList} ui=${ui} app=${app} shown=${shown.id} />
          <${LookLikeFields} ui=${ui} app=${app} shown=${shown.id} />`
        : html`<div class="reference-none"><p>${words.references.aPictureWhoseLight}</p>
          <p class="faint">${words.references.dropPasteOrChoose}</p>
          <${Button} label=${words.references.chooseAFile} act=${choose} /></div>`
    }
    ${ui.isReferenceComing && html`<p class="faint" role="status">${words.references.readingThePicture}</p>`}
  </aside>`;
}

/** The pictures of all references, and the name of the shown one.
 * @param {{ui: Ui, app: App, shown: number}} props */
function ReferenceList({ ui, app, shown }) {
  const name = ui.references.find(({ id }) => id === shown)?.name ?? '';
  return html`<div class="reference-name"><span class="spring" data-tip=${name}>${name}</span>
      <${Button} icon="trash" tip=${fill(words.references.remove, { name })}
        act=${() => app.session.send('drop_reference', { reference: shown })} /></div>
    ${
      ui.references.length > 1 &&
      html`<ul class="reference-list" aria-label=${words.references.all}>${ui.references.map(
        ({ id, name: other }) => html`<li key=${id}><button type="button" data-tip=${other}
          aria-label=${fill(words.references.show, { name: other })} aria-current=${id === shown ? 'true' : undefined}
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
    <${Choice} label=${words.references.whatIsCompared} value=${ui.comparedAreas} choices=${AREAS}
      change=${(/** @type {ComparedAreas} */ comparedAreas) => store.set({ comparedAreas, clickAction: null })} />
    ${arePairs && html`<${PairList} ui=${ui} app=${app} />`}
    <${Checkbox} label=${words.references.asBrightAsIt} checked=${ui.matchesBrightness}
      tip=${words.references.asBrightAsItTip}
      change=${(/** @type {boolean} */ matchesBrightness) => store.set({ matchesBrightness })} />
    <${Button} label=${words.references.lookLikeThis} primary disabled=${isBusy || (arePairs && !pairs.length)} act=${() => void ask()}
      tip=${words.references.lookLikeThisTip} />
  </div>`;
}

/** The pairs of places, each with a button that removes it. @param {{ui: Ui, app: App}} props */
function PairList({ ui, app }) {
  const pairs = shownPairs(ui);
  const remove = (/** @type {Ui["placePairs"][number]} */ pair) =>
    app.store.set(({ placePairs }) => ({ placePairs: placePairs.filter((other) => other !== pair) }));
  return html`<p class="faint">${
    ui.clickAction?.mode === 'pair'
      ? words.references.pressItsPlace
      : words.references.pressAPair
  }</p>
  <ul class="pair-list" aria-label=${words.references.pairs}>${pairs.map(
    (pair, k) => html`<li key=${k}><span class="pair-number">${k + 1}</span>
      <${Button} icon="close" tip=${fill(words.references.removePair, { number: k + 1 })} act=${() => remove(pair)} /></li>`,
  )}</ul>`;
}
