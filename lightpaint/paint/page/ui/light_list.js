/** The list of lights: search, sorting, groups that fold, and a row for each light. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { luminance } from './paint_colour.js';
import { Button, Select, TruncatedText } from './controls.js';
import { constraintsOf, lockedLights, findTie } from './tied_lights.js';
import { countText, percentText } from './format.js';
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
const MAX_ROWS_WITH_SLIDERS = 16;

/** @param {{ui: Ui, app: App}} props */
export function LightList({ ui, app }) {
  const { store } = app;
  const indices = sortLights(ui, searchLights(ui));
  const groups = groupLights(ui, indices);
  const isMany = ui.lights.length > MAX_ROWS_WITH_SLIDERS;
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
    ${ui.ready && !indices.length && html`<p class="faint">No light has this name.</p>`}
    ${groups.map(({ name, members }) =>
      name === null
        ? members.map((k) => renderRow(ui, app, k, isMany))
        : html`<${Group} key=${`group ${name}`} name=${name} ui=${ui} app=${app}
          members=${members} isMany=${isMany} />`,
    )}
  </div>`;
}

/** A note beside the title, where it moves no row: that lights are hidden, which of two looks they
 * belong to, or that several are locked. @param {{ui: Ui, app: App}} props */
export function LightListActions({ ui, app }) {
  const hasHidden = ui.solo.length > 0 || ui.mute.length > 0;
  if (ui.mix && !hasHidden) {
    const look = comparedAnswer(ui)?.name ?? 'the answer (not shown)';
    return html`<${TruncatedText} class="whose" text=${`of ${look}`} maxLength=${20} />`;
  }
  const lockedCount = lockedLights(ui).length;
  if (!hasHidden && lockedCount < 2) return null;
  if (!hasHidden) {
    return html`<${Button} label="Unlock all" class="of-all" act=${() => app.session.unlockAll()}
      tip=${`${lockedCount} lights are locked or off. Let the solve set them again.`} />`;
  }
  return html`<${Button} label="Show all" class="of-all"
    tip="Solo or mute hides some lights. The answer has them all."
    act=${() => app.store.set({ solo: [], mute: [] })} />`;
}

/** @param {Ui} ui @param {App} app @param {number} k @param {boolean} isMany */
function renderRow(ui, app, k, isMany) {
  const light = ui.lights[k];
  const isOpen = ui.openLights.includes(k);
  return html`<${LightRow} key=${light.name} k=${k} light=${light} app=${app}
    rgb=${ui.weights[k] ?? light.present} answer=${ui.lightAnswers[k]} constraints=${constraintsOf(ui, k)} tie=${findTie(ui, k)}
    isLive=${ui.isLive} isSolo=${ui.solo.includes(k)} isMute=${ui.mute.includes(k)} isOpen=${isOpen}
    pointerShare=${ui.probe?.shares[k]} hasSlider=${isOpen || !isMany}
    picture=${nameInView(`thumb/${k}`, ui.view)} thumb=${ui.resources[nameInView(`thumb/${k}`, ui.view)]}
    allLights=${isOpen ? ui.lights : undefined} ui=${isOpen ? ui : undefined} />`;
}

/** @param {{name: string, ui: Ui, app: App, members: number[], isMany: boolean}} props */
function Group({ name, ui, app, members, isMany }) {
  const { store } = app;
  const key = `group ${name}`;
  const open = ui.open[key] ?? true;
  const share = members.reduce((sum, k) => sum + (ui.lightAnswers[k]?.share ?? 0), 0);
  const isSolo = members.every((k) => ui.solo.includes(k));
  const solo = ui.solo.filter((k) => !members.includes(k));
  return html`<div class="light-group" role="group" aria-label=${name}>
    <div class="group-head">
      <button type="button" class="group-name" aria-expanded=${String(open)} data-tip=${name}
        onClick=${() => store.set({ open: { ...ui.open, [key]: !open } })}>
        <${Icon} name="fold" /><strong>${name}</strong>
        <span class="faint">${countText(members.length, 'light')} · ${percentText(share)}</span></button>
      <${Button} label="S" class="letter" pressed=${isSolo} tip=${`Show ${name} alone`}
        act=${() => store.set({ solo: isSolo ? solo : [...solo, ...members] })} />
    </div>
    ${open && members.map((k) => renderRow(ui, app, k, isMany))}
  </div>`;
}

/** @param {Ui} ui @returns {number[]} */
function searchLights(ui) {
  const words = ui.search.toLowerCase().split(/\s+/).filter(Boolean);
  return ui.lights
    .map((_, k) => k)
    .filter((k) => {
      const { name, label, group, members } = ui.lights[k];
      const text = [name, label, group, ...members].join(' ').toLowerCase();
      return words.every((word) => text.includes(word));
    });
}

/** @param {Ui} ui @param {number[]} indices @returns {number[]} */
function sortLights(ui, indices) {
  const name = (/** @type {number} */ k) => ui.lights[k].label;
  const share = (/** @type {number} */ k) => ui.lightAnswers[k]?.share ?? 0;
  const change = (/** @type {number} */ k) => {
    const [a, b] = [
      luminance(ui.lightAnswers[k]?.emission ?? ui.lights[k].present),
      luminance(ui.lights[k].present),
    ];
    return Math.abs(Math.log2((a + 1e-9) / (b + 1e-9)));
  };
  const sortedIndices = [...indices];
  if (ui.sort === 'name') {
    sortedIndices.sort((a, b) => name(a).localeCompare(name(b), undefined, { numeric: true }));
  }
  if (ui.sort === 'share') sortedIndices.sort((a, b) => share(b) - share(a));
  if (ui.sort === 'change') sortedIndices.sort((a, b) => change(b) - change(a));
  return sortedIndices;
}

/** Group lights that belong together under one name, at the place of the first.
 * @param {Ui} ui @param {number[]} indices @returns {{name: string | null, members: number[]}[]} */
function groupLights(ui, indices) {
  const names = ui.lights.map((_, k) => groupOf(ui, k));
  /** @type {{name: string | null, members: number[]}[]} */
  const groups = [];
  for (const k of indices) {
    const count = names.filter((other) => other === names[k]).length;
    const name = count >= (isPrefixGroup(ui, k) ? MIN_PREFIX_GROUP : 2) ? names[k] : null;
    const existingGroup = name === null ? undefined : groups.find((group) => group.name === name);
    if (existingGroup) existingGroup.members.push(k);
    else groups.push({ name, members: [k] });
  }
  return groups;
}

/** Smallest number of lights with a common prefix that are folded together. */
const MIN_PREFIX_GROUP = 3;

/** Return the group of a light: its dimmer, its group or, with many lights, its name's prefix.
 * @param {Ui} ui @param {number} k @returns {string | null} */
function groupOf(ui, k) {
  const { name, group } = ui.lights[k];
  const tie = findTie(ui, k);
  const otherNames = tie && (tie.length === 2 ? tie[1] : `${tie.length - 1} more`);
  if (tie) return `${tie[0]} and ${otherNames}, tied`;
  return group ?? (ui.lights.length > MAX_ROWS_WITH_SLIDERS ? namePrefix(name) : null);
}

/** @param {Ui} ui @param {number} k */
function isPrefixGroup(ui, k) {
  return !ui.lights[k].group && !findTie(ui, k);
}

/** `window` of `window_12`, `cyc` of `cyc left`. @param {string} name @returns {string | null} */
function namePrefix(name) {
  return /^[^\s_.:/\-\d]+/.exec(name)?.[0] ?? null;
}
