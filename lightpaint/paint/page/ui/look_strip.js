/**
 * The strip of saved looks, to load, compare and crossfade. Its height never changes, so that the
 * pictures above it stay where they are.
 */

import { nameInView } from '../engine/message_frames.js';
import { html, useEffect, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Select, Slider } from './controls.js';
import { COMPARED_COUNT } from '../engine/picture_slots.js';
import { currentLook, loadLook } from './look_actions.js';
import { keyText } from './key_bindings.js';
import {
  looksElsewhere,
  mixName,
  placesText,
  resetMix,
  whyNotSaved,
  withoutLooks,
} from './look_comparison.js';
import { showWall } from './look_wall.js';
import { Thumbnail } from './thumbnail.js';
import { updateDisplay } from './tools.js';
import { toggled } from './ui_store.js';
import { t } from '../language/language.js';

/** @import { App, Look, Ui } from './ui_state.js' */

/** @param {{ui: Ui, app: App}} props */
export function LookStrip({ ui, app }) {
  const { looks } = ui;
  const list = useRef(/** @type {HTMLElement | null} */ (null));
  const count = useRef(Infinity);
  // Scroll to the look that was just saved, at the end.
  useLayoutEffect(() => {
    if (looks.length > count.current) list.current?.scrollTo({ left: list.current.scrollWidth });
    count.current = ui.ready ? looks.length : Infinity;
  }, [looks.length, ui.ready]);
  const [marks, setMarks] = useState(/** @type {number[]} */ ([]));
  const marked = marks.filter((id) => looks.some((look) => look.id === id));
  const current = currentLook(ui);
  const kind = !looks.length ? 'is-empty' : ui.mix ? 'is-comparing' : '';
  return html`<section class=${`looks ${kind}`} aria-label=${t('Looks')}><div class="looks-row">
    ${
      looks.length > 0 &&
      html`<ul ref=${list}>${looks.map(
        (look) => html`<${LookItem} key=${look.id} look=${look} isCurrent=${look.id === current}
          isMarked=${marked.includes(look.id)} canMark=${looks.length > 1 && marked.length < COMPARED_COUNT}
          mark=${() => setMarks(toggled(marked, look.id))} ui=${ui} app=${app} />`,
      )}</ul>`
    }
    ${
      !looks.length &&
      ui.ready &&
      html`<p class="faint">${t('No looks yet:')} <kbd>${keyText(ui, 'saveLook')}</kbd> ${t('saves painting and answer as a look.')}</p>`
    }
    ${
      marked.length > 1 &&
      !ui.mix &&
      html`<${Button} icon="side" label=${t('Side by side')} primary
        tip=${t('The marked looks at full size, two to four')} act=${() => showWall(app, marked)} />`
    }
    ${
      looks.length > 1 &&
      html`<${Button} icon="sheet" class="all-looks" tip=${t('All looks: pictures and lamps')}
        act=${() => app.store.set({ dialog: 'looks' })} />`
    }
    ${looks.length > 1 && html`<${LookCrossfade} ui=${ui} app=${app} />`}
  </div></section>`;
}

/** @param {{look: Look, isCurrent: boolean, isMarked: boolean, canMark: boolean, mark: () => void,
 *   ui: Ui, app: App}} props */
function LookItem({ look, isCurrent, isMarked, canMark, mark, ui, app }) {
  const { session } = app;
  const [isNaming, setNaming] = useState(false);
  const [isConfirming, setConfirming] = useState(false);
  const drop = () =>
    isConfirming ? session.send('drop_look', { look: look.id }) : setConfirming(true);
  const viewPicture = nameInView(look.thumbnail, ui.view);
  const picture = viewPicture in ui.resources ? viewPicture : look.thumbnail;
  const tip = isCurrent
    ? t('Painting and answer equal this look')
    : t('Load this look. Undo goes back.');
  return html`<li class=${`look ${isCurrent ? 'is-current' : ''}`}
    onPointerLeave=${() => setConfirming(false)}>
    <button type="button" class="look-picture" aria-label=${t('Load {name}', { name: look.name })}
      aria-current=${isCurrent ? 'true' : undefined} data-tip=${tip}
      onClick=${() => loadLook(app, look.id)}>
      <${Thumbnail} name=${picture} generation=${ui.resources[picture] ?? 0} app=${app} />
    </button>
    ${
      isNaming
        ? html`<${LookNameField} look=${look} app=${app} done=${() => setNaming(false)} />`
        : html`<button type="button" class="look-name" data-tip=${t('Rename {name}', { name: look.name })}
          onClick=${() => setNaming(true)}>${look.name}</button>`
    }
    <span class="look-tools">
      ${
        (canMark || isMarked) &&
        html`<${Button} icon="side" tip=${t('Compare {name}', { name: look.name })} pressed=${isMarked} act=${mark} />`
      }
      <${Button} icon="copy" tip=${t('Duplicate {name}', { name: look.name })}
        act=${() => session.send('copy_look', { look: look.id })} />
      <${Button} icon=${isConfirming ? 'check' : 'trash'} class=${isConfirming ? 'is-sure' : ''}
        tip=${isConfirming ? t('Delete {name}: press again to confirm', { name: look.name }) : t('Delete {name}', { name: look.name })} act=${drop} />
    </span>
  </li>`;
}

/** @param {{look: Look, app: App, done: () => void}} props */
function LookNameField({ look, app, done }) {
  const ref = useRef(/** @type {HTMLInputElement | null} */ (null));
  useEffect(() => ref.current?.select(), []);
  const commit = () => {
    const name = ref.current?.value.trim();
    if (name && name !== look.name) app.session.send('rename_look', { look: look.id, name });
    done();
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === 'Enter') commit();
    if (event.key === 'Escape') done();
  };
  return html`<input class="naming" ref=${ref} type="text" aria-label=${t('Name of {name}', { name: look.name })}
    defaultValue=${look.name} value=${look.name} maxlength="60" onBlur=${commit} onKeyDown=${press} />`;
}

/** Return the current look, or else the newest, and the one before it.
 * @param {Ui} ui */
function pairOf(ui) {
  const ids = ui.looks.map((look) => look.id);
  const b = currentLook(ui) ?? Math.max(...ids);
  const index = ids.indexOf(b);
  return { a: ids[index > 0 ? index - 1 : 1], b };
}

/** Have the session make pictures of compared looks whose lights hang elsewhere.
 * @param {Ui} ui @param {App} app */
function usePicturesElsewhere(ui, { session, store }) {
  const ids = looksElsewhere(ui).map(({ id }) => id);
  const hasRequested = useRef(false);
  useEffect(() => {
    if (!ids.length && !hasRequested.current) return;
    store.set(({ resources }) => ({ resources: withoutLooks(resources, ids) }));
    void session.send('compare_looks', { looks: ids });
    hasRequested.current = ids.length > 0;
  }, [ids.join(' '), ui.looks]);
}

/** Two looks side by side, and a slider to mix them. @param {{ui: Ui, app: App}} props */
function LookCrossfade({ ui, app }) {
  const { store } = app;
  const comparison = ui.mix ?? { ...pairOf(ui), share: 1 };
  const choices = ui.looks.map((look) => ({ value: String(look.id), label: look.name }));
  const nameOf = (/** @type {number} */ id) => ui.looks.find((look) => look.id === id)?.name ?? '';
  const describe = (/** @type {number} */ id) => {
    const look = ui.looks.find((one) => one.id === id);
    return look ? placesText(ui, look) : '';
  };
  const set = (/** @type {{a?: number, b?: number, share?: number}} */ changes) => {
    const mix = { ...comparison, ...changes };
    store.set({ mix });
    updateDisplay(store, { left: 'solution', right: 'other' });
  };
  usePicturesElsewhere(ui, app);
  const refusal = ui.mix && whyNotSaved(ui, ui.mix);
  const keep = () =>
    app.session.send('mix_looks', {
      first: comparison.a,
      second: comparison.b,
      part: comparison.share,
      name: mixName(ui.looks, comparison),
    });
  return html`<div class="mix" role="group" aria-label=${t('Compare two looks')}>
    ${
      ui.mix &&
      !ui.mix.more &&
      html`<${Select} label=${t('First look')} hidden value=${String(comparison.a)} choices=${choices}
        tip=${t('From {a}', { a: describe(comparison.a) })}
        change=${(/** @type {string} */ id) => set({ a: Number(id) })} />
      <${Slider} label=${t('Crossfade')} value=${100 * comparison.share} min=${0} max=${100} unit="%"
        tip=${t('Crossfade from {a} to {b}', { a: nameOf(comparison.a), b: nameOf(comparison.b) })}
        change=${(/** @type {number} */ share) => set({ share: share / 100 })} />
      <${Select} label=${t('Second look')} hidden value=${String(comparison.b)} choices=${choices}
        tip=${t('To {b}', { b: describe(comparison.b) })}
        change=${(/** @type {string} */ id) => set({ b: Number(id) })} />
      ${
        refusal
          ? html`<span class="faint keep" tabindex="0" data-tip=${refusal}>${t('Places differ')}</span>`
          : html`<${Button} icon="plus" label=${t('Save as look')} class="keep" act=${keep}
        tip=${t('Save {looks}', { looks: mixName(ui.looks, comparison) })} />`
      }`
    }
    <${Button} icon="side" label=${ui.mix ? t('Back to the painting') : t('Compare looks')} class="compare"
      tip=${ui.mix ? t('Show painting and answer again') : t('Two looks side by side, and a crossfade between them')}
      pressed=${Boolean(ui.mix)} act=${() => (ui.mix ? store.set(resetMix) : set({}))} />
  </div>`;
}
