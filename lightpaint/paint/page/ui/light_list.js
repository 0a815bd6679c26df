/** The list of lights: search, sorting, groups that fold, and a row for each light. */

import { inView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { luminance } from './paint_colour.js';
import { Button, Select, TruncatedText } from './controls.js';
import { constraintsOf, lockedLights, findTie } from './tied_lights.js';
import { counted, percent } from './format.js';
import { Icon } from './icons.js';
import { comparedAnswer, isAnswerHidden } from './look_actions.js';
import { LightRow } from './light_row.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {import("./shortcuts.js").App} App */

const SORTS = [
  { value: 'scene', label: 'Scene order' },
  { value: 'name', label: 'Name' },
  { value: 'share', label: 'Largest share' },
  { value: 'change', label: 'Most changed' },
];

/** Number of lights above which only unfolded rows have a slider. */
const MANY = 16;

/** @param {{ui: Ui, app: App}} props */
export function LightList({ ui, app }) {
  const { store } = app;
  const found = sorted(ui, matching(ui));
  const groups = grouped(ui, found);
  const isMany = ui.lights.length > MANY;
  return html`<div class=${`lights ${isAnswerHidden(ui) ? 'is-unseen' : ''}`}>
    ${
      ui.lights.length > 5 &&
      html`<div class="lights-tools">
      <label class="field search"><span class="only-read">Search lights</span>
        <${Icon} name="search" /><input type="search" value=${ui.search} placeholder="Search"
          onInput=${(/** @type {any} */ event) =>
            store.set({ search: event.currentTarget.value })} /></label>
      <${Select} label="Sort by" hidden value=${ui.sort} choices=${SORTS} tip="Sort by"
        change=${(/** @type {any} */ sort) => store.set({ sort })} />
    </div>`
    }
    ${ui.ready && !found.length && html`<p class="faint">No light has this name.</p>`}
    ${groups.map(({ name, members }) =>
      name === null
        ? members.map((k) => row(ui, app, k, isMany))
        : html`<${Group} key=${`group ${name}`} name=${name} ui=${ui} app=${app}
          members=${members} isMany=${isMany} />`,
    )}
  </div>`;
}

/** A note beside the title, where it moves no row: that lights are hidden, which of two looks they
 * belong to, or that several are locked. @param {{ui: Ui, app: App}} props */
export function LightListActions({ ui, app }) {
  const isPart = ui.solo.length > 0 || ui.mute.length > 0;
  if (ui.mix && !isPart) {
    const look = comparedAnswer(ui)?.name ?? 'the answer (not shown)';
    return html`<${TruncatedText} class="whose" text=${`of ${look}`} most=${20} />`;
  }
  const locked = lockedLights(ui).length;
  if (!isPart && locked < 2) return null;
  if (!isPart) {
    return html`<${Button} label="Unlock all" class="of-all" act=${() => app.session.unlockAll()}
      tip=${`${locked} lights are locked or off. Let the solve set them again.`} />`;
  }
  return html`<${Button} label="Show all" class="of-all"
    tip="Solo or mute hides some lights. The answer has them all."
    act=${() => app.store.set({ solo: [], mute: [] })} />`;
}

/** @param {Ui} ui @param {App} app @param {number} k @param {boolean} isMany */
function row(ui, app, k, isMany) {
  const light = ui.lights[k];
  const isOpen = ui.unfolded.includes(k);
  return html`<${LightRow} key=${light.name} k=${k} light=${light} app=${app}
    rgb=${ui.weights[k] ?? light.present} lit=${ui.lit[k]} constraints=${constraintsOf(ui, k)} tied=${findTie(ui, k)}
    isLive=${ui.isLive} isSolo=${ui.solo.includes(k)} isMute=${ui.mute.includes(k)} isOpen=${isOpen}
    here=${ui.pointed?.shares[k]} hasSlider=${isOpen || !isMany}
    picture=${inView(`thumb/${k}`, ui.view)} thumb=${ui.resources[inView(`thumb/${k}`, ui.view)]}
    others=${isOpen ? ui.lights : undefined} ui=${isOpen ? ui : undefined} />`;
}

/** @param {{name: string, ui: Ui, app: App, members: number[], isMany: boolean}} props */
function Group({ name, ui, app, members, isMany }) {
  const { store } = app;
  const key = `group ${name}`;
  const open = ui.open[key] ?? true;
  const share = members.reduce((sum, k) => sum + (ui.lit[k]?.share ?? 0), 0);
  const isSolo = members.every((k) => ui.solo.includes(k));
  const solo = ui.solo.filter((k) => !members.includes(k));
  return html`<div class="light-group" role="group" aria-label=${name}>
    <div class="group-head">
      <button type="button" class="group-name" aria-expanded=${String(open)} data-tip=${name}
        onClick=${() => store.set({ open: { ...ui.open, [key]: !open } })}>
        <${Icon} name="fold" /><strong>${name}</strong>
        <span class="faint">${counted(members.length, 'light')} · ${percent(share)}</span></button>
      <${Button} label="S" class="letter" on=${isSolo} tip=${`Show ${name} alone`}
        act=${() => store.set({ solo: isSolo ? solo : [...solo, ...members] })} />
    </div>
    ${open && members.map((k) => row(ui, app, k, isMany))}
  </div>`;
}

/** @param {Ui} ui @returns {number[]} */
function matching(ui) {
  const words = ui.search.toLowerCase().split(/\s+/).filter(Boolean);
  return ui.lights
    .map((_, k) => k)
    .filter((k) => {
      const { name, label, group, members } = ui.lights[k];
      const text = [name, label, group, ...members].join(' ').toLowerCase();
      return words.every((word) => text.includes(word));
    });
}

/** @param {Ui} ui @param {number[]} found @returns {number[]} */
function sorted(ui, found) {
  const name = (/** @type {number} */ k) => ui.lights[k].label;
  const share = (/** @type {number} */ k) => ui.lit[k]?.share ?? 0;
  const change = (/** @type {number} */ k) => {
    const [a, b] = [
      luminance(ui.lit[k]?.emission ?? ui.lights[k].present),
      luminance(ui.lights[k].present),
    ];
    return Math.abs(Math.log2((a + 1e-9) / (b + 1e-9)));
  };
  const made = [...found];
  if (ui.sort === 'name') {
    made.sort((a, b) => name(a).localeCompare(name(b), undefined, { numeric: true }));
  }
  if (ui.sort === 'share') made.sort((a, b) => share(b) - share(a));
  if (ui.sort === 'change') made.sort((a, b) => change(b) - change(a));
  return made;
}

/** Group lights that belong together under one name, at the place of the first.
 * @param {Ui} ui @param {number[]} found @returns {{name: string | null, members: number[]}[]} */
function grouped(ui, found) {
  const names = ui.lights.map((_, k) => groupOf(ui, k));
  /** @type {{name: string | null, members: number[]}[]} */
  const made = [];
  for (const k of found) {
    const count = names.filter((one) => one === names[k]).length;
    const name = count >= (isStem(ui, k) ? FEWEST : 2) ? names[k] : null;
    const same = name === null ? undefined : made.find((one) => one.name === name);
    if (same) same.members.push(k);
    else made.push({ name, members: [k] });
  }
  return made;
}

/** Smallest number of lights with a common prefix that are folded together. */
const FEWEST = 3;

/** Return the group of a light: its dimmer, its group or, with many lights, its name's prefix.
 * @param {Ui} ui @param {number} k @returns {string | null} */
function groupOf(ui, k) {
  const { name, group } = ui.lights[k];
  const tie = findTie(ui, k);
  const others = tie && (tie.length === 2 ? tie[1] : `${tie.length - 1} more`);
  if (tie) return `${tie[0]} and ${others}, tied`;
  return group ?? (ui.lights.length > MANY ? stemOf(name) : null);
}

/** @param {Ui} ui @param {number} k */
function isStem(ui, k) {
  return !ui.lights[k].group && !findTie(ui, k);
}

/** `window` of `window_12`, `cyc` of `cyc left`. @param {string} name @returns {string | null} */
function stemOf(name) {
  return /^[^\s_.:/\-\d]+/.exec(name)?.[0] ?? null;
}
