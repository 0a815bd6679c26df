/** The list of lights: search, sorting, groups that fold, and a row for each light. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { Button, Select, TruncatedText, Slider } from './controls.js';
import { toggleLights } from './lamps/light_selection.js';
import {
  MAX_ROWS_WITH_SLIDERS,
  countRows,
  groupKey,
  groupLights,
  isGroupOpen,
  isLongList,
  searchLights,
  sortLights,
} from './lamps/listed_lights.js';
import { ConsoleRow } from './lamps/console_row.js';
import { StartLamps } from './lamps/start_lamps.js';
import { VirtualRows } from './lamps/virtual_rows.js';
import { GroupDimmer, SelectionPanel, levelsText } from './lamps/selection_panel.js';
import { constraintsOf, lockedLights, findTie } from './tied_lights.js';
import { lightCountText, percentText, stopsText } from './format.js';
import { Icon } from './icons.js';
import { comparedAnswer, isAnswerHidden } from './look_actions.js';
import { ImageRow } from './images/image_row.js';
import { LightRow, RENDERING_TIP } from './light_row.js';
import { t } from '../language/language.js';

/** @import { App, Ui } from './ui_state.js' */

const SORTS = [
  { value: 'scene', label: t('Scene') },
  { value: 'name', label: t('Name') },
  { value: 'share', label: t('Share') },
  { value: 'change', label: t('Change') },
];

/** @param {{ui: Ui, app: App}} props */
export function LightList({ ui, app }) {
  const { store } = app;
  const indices = sortLights(ui, searchLights(ui));
  const areSelected = indices.length > 0 && indices.every((k) => ui.selectedLights.includes(k));
  const groups = groupLights(ui, indices);
  const isMany = countRows(ui) > MAX_ROWS_WITH_SLIDERS;
  const selectFound = (/** @type {any} */ { key }) =>
    key === 'Enter' && indices.length && store.set({ selectedLights: indices });
  return html`<div class=${`lights ${isAnswerHidden(ui) ? 'is-unseen' : ''}`}>
    ${ui.lights.length > 1 && html`<${MasterDimmer} ui=${ui} app=${app} />`}
    <${ConsoleRow} ui=${ui} app=${app} />
    ${ui.isStarted && html`<${StartLamps} ui=${ui} app=${app} />`}
    ${
      ui.lights.length > 1 &&
      html`<div class="lights-tools">
      <label class="field search"><span class="only-read">${t('Search lights')}</span>
        <${Icon} name="search" /><input type="search" value=${ui.search} placeholder=${t('Search')}
          data-tip=${t('Words, or patterns such as spot_*; Enter selects what is found')} onKeyDown=${selectFound}
          onInput=${(/** @type {any} */ event) =>
            store.set({ search: event.currentTarget.value })} /></label>
      <${Select} label=${t('Sort by')} hidden value=${ui.sort} choices=${SORTS} tip=${t('Sort by')}
        change=${(/** @type {any} */ sort) => store.set({ sort })} />
      <${Button} icon="select" pressed=${areSelected} tip=${selectionTip(ui, indices, areSelected)}
        act=${() => toggleLights(store, indices)} />
      ${ui.state?.can_render && html`<${LassoButton} ui=${ui} app=${app} />`}
    </div>`
    }
    <${SelectionPanel} ui=${ui} app=${app} />
    ${ui.ready && !indices.length && html`<p class="faint">${t('No light has this name.')}</p>`}
    ${joinRows(groups).map(({ name, members, image }) =>
      image
        ? html`<${ImageRow} key=${`image ${image.name}`} image=${image} ui=${ui} app=${app} />`
        : name === null
        ? renderRows(ui, app, members, isMany)
        : html`<${Group} key=${`group ${name}`} name=${name} ui=${ui} app=${app}
          members=${members} isMany=${isMany} />`,
    )}
    ${!ui.isStarted && html`<${StartLamps} ui=${ui} app=${app} />`}
  </div>`;
}

/** @param {Ui} ui @param {number[]} indices that the list shows @param {boolean} areSelected */
function selectionTip({ search }, indices, areSelected) {
  if (!search.trim()) return areSelected ? t('Deselect all') : t('Select all');
  const count = indices.length;
  return areSelected
    ? t('Deselect the {count} found', { count })
    : t('Select the {count} found', { count });
}

/** @param {{ui: Ui, app: App}} props */
function LassoButton({ ui, app }) {
  const { isLassoing, areLampsMarked } = ui;
  const toggle = () => {
    if (!isLassoing && !areLampsMarked) app.session.toggleLamps();
    app.store.set({ isLassoing: !isLassoing, clickAction: null });
  };
  return html`<${Button} icon="lasso" pressed=${isLassoing} act=${toggle}
    tip=${t('Lasso: select lights by drawing around their marks; with Shift also those')} />`;
}

/** A note beside the title, where it moves no row: that lights are hidden, which of two looks they
 * belong to, or that several are locked. @param {{ui: Ui, app: App}} props */
export function LightListActions({ ui, app }) {
  const hasHidden = ui.solo.length > 0 || ui.mute.length > 0;
  if (ui.mix && !hasHidden) {
    const look = comparedAnswer(ui)?.name ?? t('the answer (not shown)');
    return html`<${TruncatedText} class="whose" text=${t('of {look}', { look })} maxLength=${20} />`;
  }
  const lockedCount = lockedLights(ui).length;
  if (!hasHidden && lockedCount < 2) return null;
  if (!hasHidden) {
    return html`<${Button} label=${t('Unlock all')} class="of-all" act=${() => app.session.unlockAll()}
      tip=${t('{count} lights are locked or off. Let the solve set them again.', { count: lockedCount })} />`;
  }
  return html`<${Button} label=${t('Show all')} class="of-all"
    tip=${t('Solo or mute hides some lights. The answer has them all.')}
    act=${() => app.store.set({ solo: [], mute: [] })} />`;
}

/** Return groups with rows that follow each other, and belong to none, as one.
 * @param {import("./lamps/listed_lights.js").ListedGroup[]} groups */
function joinRows(groups) {
  /** @type {typeof groups} */
  const joined = [];
  for (const group of groups) {
    const last = joined[joined.length - 1];
    const isRow = group.name === null && !group.image;
    if (isRow && last && last.name === null && !last.image)
      joined[joined.length - 1] = { ...last, members: [...last.members, ...group.members] };
    else joined.push(group);
  }
  return joined;
}

/** Render rows; of a long list those in view.
 * @param {Ui} ui @param {App} app @param {number[]} rows @param {boolean} isMany
 * @param {string} [label] of the group */
function renderRows(ui, app, rows, isMany, label = t('Lights')) {
  const render = (/** @type {number} */ k) => renderRow(ui, app, k, isMany);
  if (!isLongList(ui)) return rows.map(render);
  return html`<${VirtualRows} rows=${rows} render=${render} label=${label}
    nameOf=${(/** @type {number} */ k) => ui.lights[k].name}
    isOpen=${(/** @type {number} */ k) => ui.openLights.includes(k)} />`;
}

/** @param {Ui} ui @param {App} app @param {number} k @param {boolean} isMany */
function renderRow(ui, app, k, isMany) {
  const light = ui.lights[k];
  const isOpen = ui.openLights.includes(k);
  return html`<${LightRow} key=${light.name} k=${k} light=${light} app=${app}
    rgb=${ui.weights[k] ?? light.present} answer=${ui.lightAnswers[k]} isKept=${ui.kept.includes(light.name)} constraints=${constraintsOf(ui, k)} tie=${findTie(ui, k)}
    isSelected=${ui.selectedLights.includes(k)} isLive=${ui.isLive} isSolo=${ui.solo.includes(k)} isMute=${ui.mute.includes(k)} isOpen=${isOpen}
    pointerShare=${ui.probe?.shares[k]} hasSlider=${isOpen || !isMany}
    picture=${nameInView(`thumb/${k}`, ui.view)} thumb=${ui.resources[nameInView(`thumb/${k}`, ui.view)]}
    allLights=${isOpen ? ui.lights : undefined} ui=${isOpen ? ui : undefined} />`;
}

/** @param {{name: string, ui: Ui, app: App, members: number[], isMany: boolean}} props */
function Group({ name, ui, app, members, isMany }) {
  const { store } = app;
  const open = isGroupOpen(ui, name, members);
  const areSelected = members.every((k) => ui.selectedLights.includes(k));
  const share = members.reduce((sum, k) => sum + (ui.lightAnswers[k]?.share ?? 0), 0);
  const isSolo = members.every((k) => ui.solo.includes(k));
  const solo = ui.solo.filter((k) => !members.includes(k));
  // Emitters of a lamp, which share one light.
  const rendering = ui.lights[members[0]].lamp && ui.lightAnswers[members[0]]?.rendering;
  return html`<div class="light-group" role="group" aria-label=${name}>
    <div class="group-head">
      <button type="button" class="group-name" aria-expanded=${String(open)} data-tip=${name}
        onClick=${() => store.set({ open: { ...ui.open, [groupKey(name)]: !open } })}>
        <${Icon} name="fold" /><strong>${name}</strong>
        <span class="faint">${lightCountText(members.length)} · ${percentText(share)}</span></button>
      <${Button} icon="select" class="letter" pressed=${areSelected} tip=${t('Select {name}', { name })}
        act=${() => toggleLights(store, members)} />
      <${Button} label=${t('S')} class="letter" pressed=${isSolo} tip=${t('Show {name} alone', { name })}
        act=${() => store.set({ solo: isSolo ? solo : [...solo, ...members] })} />
    </div>
    <div class="group-dimmer">
      <${GroupDimmer} app=${app} lights=${members} label=${t('{name}, dim', { name })} isPlain />
      <span class="stops">${levelsText(ui, members)}</span>
    </div>
    ${rendering && html`<span class="rendering faint" data-tip=${RENDERING_TIP}>${rendering}</span>`}
    ${open && renderRows(ui, app, members, isMany, name)}
  </div>`;
}

const TIP = t(
  'Dims what is shown and exported. The painting, the solve and the levels below stay as they are.',
);

/** @param {{ui: Ui, app: App}} props */
function MasterDimmer({ ui, app }) {
  const { master } = ui;
  const isFull = master === 1;
  const stops = master > 0 ? stopsText(Math.log2(master)) : t('off');
  const set = (/** @type {number} */ percent, /** @type {boolean} */ isFinal) =>
    void app.session.setMaster(percent / 100, isFinal);
  return html`<div class=${`master ${isFull ? '' : 'is-set'}`} role="group" aria-label=${t('Master dimmer')}>
    <${Slider} label=${t('Master')} value=${100 * master} min=${0} max=${200} step=${1} unit="%"
      resetValue=${100} tip=${TIP} text=${`${percentText(master)}, ${stops}`} change=${set} />
    <span class="stops" aria-hidden="true">${isFull ? '' : stops}</span>
    ${!isFull && html`<${Button} icon="undo" tip=${t('Master to 100 %')} act=${() => set(100, true)} />`}
  </div>`;
}
