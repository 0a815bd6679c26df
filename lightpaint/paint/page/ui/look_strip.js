/**
 * The strip of saved looks, to load, compare and crossfade. Its height never changes, so that the
 * pictures above it stay where they are.
 */

import { inView } from '../engine/message_frames.js';
import { html, useEffect, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Select, Slider } from './controls.js';
import { currentLook, loadLook } from './look_actions.js';
import { MOD } from './shortcuts.js';
import { mixName, mixedWeights, withoutMix } from './ui_state.js';
import { Thumbnail } from './thumbnail.js';
import { updateShow } from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").Look} Look */
/** @typedef {import("./shortcuts.js").App} App */

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
  const current = currentLook(ui);
  const kind = !looks.length ? 'is-empty' : ui.mix ? 'is-comparing' : '';
  return html`<section class=${`looks ${kind}`} aria-label="Looks"><div class="looks-row">
    ${
      looks.length > 0 &&
      html`<ul ref=${list}>${looks.map(
        (one) => html`<${LookItem} key=${one.id} one=${one} isCurrent=${one.id === current}
          ui=${ui} app=${app} />`,
      )}</ul>`
    }
    ${
      !looks.length &&
      ui.ready &&
      html`<p class="faint">No looks yet: <kbd>${MOD} S</kbd> saves painting and answer as a look.</p>`
    }
    ${looks.length > 1 && html`<${LookCrossfade} ui=${ui} app=${app} />`}
  </div></section>`;
}

/** @param {{one: Look, isCurrent: boolean, ui: Ui, app: App}} props */
function LookItem({ one, isCurrent, ui, app }) {
  const { session } = app;
  const [isNaming, setNaming] = useState(false);
  const [isSure, setSure] = useState(false);
  const drop = () => (isSure ? session.send('drop_look', { look: one.id }) : setSure(true));
  const its = inView(one.thumbnail, ui.view);
  const picture = its in ui.resources ? its : one.thumbnail;
  const tip = isCurrent ? 'Painting and answer equal this look' : 'Load this look. Undo goes back.';
  return html`<li class=${`look ${isCurrent ? 'is-current' : ''}`}
    onPointerLeave=${() => setSure(false)}>
    <button type="button" class="look-picture" aria-label=${`Load ${one.name}`}
      aria-current=${isCurrent ? 'true' : undefined} data-tip=${tip}
      onClick=${() => loadLook(app, one.id)}>
      <${Thumbnail} name=${picture} generation=${ui.resources[picture] ?? 0} app=${app} />
    </button>
    ${
      isNaming
        ? html`<${LookNameField} one=${one} app=${app} done=${() => setNaming(false)} />`
        : html`<button type="button" class="look-name" data-tip=${`Rename ${one.name}`}
          onClick=${() => setNaming(true)}>${one.name}</button>`
    }
    <span class="look-tools">
      <${Button} icon="copy" tip=${`Duplicate ${one.name}`}
        act=${() => session.send('copy_look', { look: one.id })} />
      <${Button} icon=${isSure ? 'check' : 'trash'} class=${isSure ? 'is-sure' : ''}
        tip=${isSure ? `Delete ${one.name}: press again to confirm` : `Delete ${one.name}`} act=${drop} />
    </span>
  </li>`;
}

/** @param {{one: Look, app: App, done: () => void}} props */
function LookNameField({ one, app, done }) {
  const ref = useRef(/** @type {HTMLInputElement | null} */ (null));
  useEffect(() => ref.current?.select(), []);
  const take = () => {
    const name = ref.current?.value.trim();
    if (name && name !== one.name) app.session.send('rename_look', { look: one.id, name });
    done();
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === 'Enter') take();
    if (event.key === 'Escape') done();
  };
  return html`<input class="naming" ref=${ref} type="text" aria-label=${`Name of ${one.name}`}
    defaultValue=${one.name} value=${one.name} maxlength="60" onBlur=${take} onKeyDown=${press} />`;
}

/** Return the current look, or else the newest, and the one before it.
 * @param {Ui} ui */
function pairOf(ui) {
  const ids = ui.looks.map((one) => one.id);
  const b = currentLook(ui) ?? Math.max(...ids);
  const at = ids.indexOf(b);
  return { a: ids[at > 0 ? at - 1 : 1], b };
}

/** Two looks side by side, and a slider to mix them. @param {{ui: Ui, app: App}} props */
function LookCrossfade({ ui, app }) {
  const { store } = app;
  const now = ui.mix ?? { ...pairOf(ui), share: 1 };
  const choices = ui.looks.map((one) => ({ value: String(one.id), label: one.name }));
  const nameOf = (/** @type {number} */ id) => ui.looks.find((one) => one.id === id)?.name ?? '';
  const set = (/** @type {{a?: number, b?: number, share?: number}} */ changed) => {
    const mix = { ...now, ...changed };
    store.set({ mix });
    updateShow(store, {
      left: 'solution',
      right: 'other',
      instead: mixedWeights(ui, { ...mix, share: 0 }),
    });
  };
  const keep = () =>
    app.session.send('mix_looks', {
      first: now.a,
      second: now.b,
      part: now.share,
      name: mixName(ui.looks, now),
    });
  return html`<div class="mix" role="group" aria-label="Compare two looks">
    ${
      ui.mix &&
      html`<${Select} label="First look" hidden value=${String(now.a)} choices=${choices}
        tip=${`From ${nameOf(now.a)}`}
        change=${(/** @type {string} */ id) => set({ a: Number(id) })} />
      <${Slider} label="Crossfade" value=${100 * now.share} least=${0} most=${100} unit="%"
        tip=${`Crossfade from ${nameOf(now.a)} to ${nameOf(now.b)}`}
        change=${(/** @type {number} */ share) => set({ share: share / 100 })} />
      <${Select} label="Second look" hidden value=${String(now.b)} choices=${choices}
        tip=${`To ${nameOf(now.b)}`}
        change=${(/** @type {string} */ id) => set({ b: Number(id) })} />
      <${Button} icon="plus" label="Save as look" class="keep" act=${keep}
        tip=${`Save ${mixName(ui.looks, now)}`} />`
    }
    <${Button} icon="side" label=${ui.mix ? 'Back to the painting' : 'Compare looks'} class="compare"
      tip=${ui.mix ? 'Show painting and answer again' : 'Two looks side by side, and a crossfade between them'}
      on=${Boolean(ui.mix)} act=${() => (ui.mix ? store.set(withoutMix) : set({}))} />
  </div>`;
}
