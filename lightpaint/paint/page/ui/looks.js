/** Looks that were kept: pictures with names, to go on from, to compare and to mix. */

import { inView } from '../engine/protocol.js';
import { html, useEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Select, Slider } from './controls.js';
import { mixOf, unmixed } from './model.js';
import { Thumb } from './thumb.js';
import { look } from './tools.js';

/** @typedef {import("./model.js").Ui} Ui */
/** @typedef {import("./model.js").Look} Look */
/** @typedef {import("./keys.js").Hands} Hands */

/** @param {{ui: Ui, hands: Hands}} props */
export function Looks({ ui, hands }) {
  if (!ui.looks.length) return null;
  return html`<section class="looks" aria-label="Looks">
    <ul>${ui.looks.map((one) => html`<${Kept} key=${one.id} one=${one} ui=${ui} hands=${hands} />`)}
    </ul>
    ${ui.looks.length > 1 && html`<${Mix} ui=${ui} hands=${hands} />`}
  </section>`;
}

/** @param {{one: Look, ui: Ui, hands: Hands}} props */
function Kept({ one, ui, hands }) {
  const { session } = hands;
  const [isNaming, setNaming] = useState(false);
  const [isSure, setSure] = useState(false);
  const drop = () => (isSure ? session.send('drop_look', { look: one.id }) : setSure(true));
  const its = inView(one.thumbnail, ui.view);
  const picture = its in ui.resources ? its : one.thumbnail;
  return html`<li class="look" onPointerLeave=${() => setSure(false)}>
    <button type="button" class="look-picture" aria-label=${`Go on from ${one.name}`}
      data-tip="Go on from this look; undo comes back"
      onClick=${() => session.send('load_look', { look: one.id })}>
      <${Thumb} name=${picture} generation=${ui.resources[picture] ?? 0} hands=${hands} />
    </button>
    ${
      isNaming
        ? html`<${Naming} one=${one} hands=${hands} done=${() => setNaming(false)} />`
        : html`<button type="button" class="look-name" data-tip="Rename"
          onClick=${() => setNaming(true)}>${one.name}</button>`
    }
    <span class="look-tools">
      <${Button} icon="copy" tip=${`Duplicate ${one.name}`}
        act=${() => session.send('copy_look', { look: one.id })} />
      <${Button} icon=${isSure ? 'check' : 'trash'} class=${isSure ? 'is-sure' : ''}
        tip=${isSure ? `Delete ${one.name}: press again` : `Delete ${one.name}`} act=${drop} />
    </span>
  </li>`;
}

/** @param {{one: Look, hands: Hands, done: () => void}} props */
function Naming({ one, hands, done }) {
  const ref = useRef(/** @type {HTMLInputElement | null} */ (null));
  useEffect(() => ref.current?.select(), []);
  const take = () => {
    const name = ref.current?.value.trim();
    if (name && name !== one.name) hands.session.send('rename_look', { look: one.id, name });
    done();
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key === 'Enter') take();
    if (event.key === 'Escape') done();
    event.stopPropagation();
  };
  return html`<input class="naming" ref=${ref} type="text" aria-label=${`Name of ${one.name}`}
    defaultValue=${one.name} value=${one.name} maxlength="60" onBlur=${take} onKeyDown=${press} />`;
}

/** Two looks beside each other, and what lies between them. @param {{ui: Ui, hands: Hands}} props */
function Mix({ ui, hands }) {
  const { store } = hands;
  const ids = ui.looks.map((one) => one.id);
  const [a, b] = [ui.mix?.a ?? ids[0], ui.mix?.b ?? ids[1]];
  const choices = ui.looks.map((one) => ({ value: String(one.id), label: one.name }));
  const set = (/** @type {{a?: number, b?: number, share?: number}} */ changed) => {
    const mix = { a, b, share: ui.mix?.share ?? 1, ...changed };
    store.set({ mix });
    look(store, { left: 'solution', right: 'other', instead: mixOf(ui, { ...mix, share: 0 }) });
  };
  const keep = () => {
    const names = [a, b].map((id) => ui.looks.find((one) => one.id === id)?.name ?? '');
    const part = ui.mix?.share ?? 1;
    const name = `${names.join(' to ')}, ${Math.round(100 * part)} %`;
    hands.session.send('mix_looks', { first: a, second: b, part, name });
  };
  return html`<div class="mix" role="group" aria-label="Compare two looks">
    <div class="row">
      <${Button} label=${ui.mix ? 'Back to the painting' : 'Compare looks'} on=${Boolean(ui.mix)}
        act=${() => (ui.mix ? store.set(unmixed) : set({}))} />
      <${Select} label="First look" hidden value=${String(a)} choices=${choices}
        change=${(/** @type {string} */ id) => set({ a: Number(id) })} />
      <${Select} label="Second look" hidden value=${String(b)} choices=${choices}
        change=${(/** @type {string} */ id) => set({ b: Number(id) })} /></div>
    ${
      ui.mix &&
      html`<div class="row"><${Slider} label="Between" value=${100 * ui.mix.share} least=${0}
          most=${100} unit="%"
          change=${(/** @type {number} */ share) => set({ share: share / 100 })} />
        <${Button} label="Keep as look" act=${keep} /></div>`
    }
  </div>`;
}
