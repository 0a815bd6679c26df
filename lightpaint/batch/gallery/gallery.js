/**
 * The gallery of a batch: a self-contained page that opens from a disk.
 *
 * It has cards that can be filtered and ordered, a comparison of any two of them, the table of all
 * lights, and a mixer for each basis, which can start from any of its looks.
 */
import { elementOf, inputOf, looks, titleOf } from './gallery_data.js';
import { createCards } from './look_cards.js';
import { LookComparison } from './look_comparison.js';
import { LightsTable } from './look_lights.js';
import { LookMixers } from './look_mixers.js';

/** @import { Look } from './gallery_data.js' */

/** Sorts 10 after 9. */
const NUMERIC = { numeric: true };

/** The filtered looks, in their order. @type {Look[]} */
let filteredLooks = [];

const comparison = new LookComparison(() => filteredLooks);
const table = new LightsTable();
const mixers = new LookMixers();
const cards = createCards({
  enlarge: (look) => comparison.enlarge(look),
  choose: (side, look) => comparison.toggle(side, look),
  mixerOf: (look) => (mixers.canMix(look) ? () => mix(look) : null),
});
comparison.cards = cards;

// ------------------------------------------------------------------------- filter and order

/** The texts of each look that the filter searches. */
const searchTexts = new Map(
  looks.map((look) => [
    look,
    [look.look, look.target, look.sensor, look.scene, look.variation, look.why]
      .join(' ')
      .toLowerCase(),
  ]),
);

/** Show the filtered cards, in the chosen order. */
function arrange() {
  const words = inputOf('filter').value.toLowerCase().split(/\s+/).filter(Boolean);
  const state = inputOf('state').value;
  filteredLooks = looks.filter((look) => {
    const text = searchTexts.get(look) ?? '';
    return (!state || look.state === state) && words.every((word) => text.includes(word));
  });
  const order = inputOf('order').value;
  if (order === 'look')
    filteredLooks.sort((a, b) => titleOf(a).localeCompare(titleOf(b), 'en', NUMERIC));
  if (order === 'delta_e') filteredLooks.sort((a, b) => (b.delta_e ?? -1) - (a.delta_e ?? -1));
  elementOf('cards').replaceChildren(...filteredLooks.map((look) => cards.get(look) ?? ''));
  elementOf('count').textContent = `${filteredLooks.length} of ${looks.length}`;
  elementOf('none').hidden = filteredLooks.length > 0;
  if (!elementOf('lights-panel').hidden) table.fill(filteredLooks);
}
for (const id of ['filter', 'state', 'order']) elementOf(id).addEventListener('input', arrange);
elementOf('large').addEventListener('input', () =>
  document.body.style.setProperty('--card', inputOf('large').checked ? '420px' : '250px'),
);
elementOf('unit').addEventListener('input', () => {
  table.clear();
  table.fill(filteredLooks);
});

// -------------------------------------------------------------------------------------- mixer

/** Show the mixer, starting from a look. @param {Look} look */
function mix(look) {
  if (!mixers.canMix(look)) return;
  mixers.begin(look);
  select('mixer');
}
elementOf('from').addEventListener('input', () => mix(looks[Number(inputOf('from').value)]));

// --------------------------------------------------------------------------------------- tabs

const tabs = [...document.querySelectorAll('[role=tab]')].map(
  (tab) => /** @type {HTMLElement} */ (tab),
);

/** Show the panel of a tab. @param {string} name */
function select(name) {
  for (const tab of tabs) {
    const isSelected = tab.id === `${name}-tab`;
    tab.setAttribute('aria-selected', String(isSelected));
    tab.tabIndex = isSelected ? 0 : -1;
    elementOf(tab.getAttribute('aria-controls') ?? '').hidden = !isSelected;
  }
  elementOf('filters').style.visibility = name === 'mixer' ? 'hidden' : '';
  elementOf('size').hidden = name !== 'looks';
  comparison.showTray();
  if (name === 'lights') table.fill(filteredLooks);
  if (name === 'mixer' && !mixers.requests && mixers.looks.length) mixers.begin(mixers.looks[0]);
}
tabs.forEach((tab, k) => {
  tab.addEventListener('click', () => select(tab.id.replace('-tab', '')));
  tab.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!step) return;
    const visible = tabs.filter((tab) => !tab.hidden);
    const next = visible[(visible.indexOf(tab) + step + visible.length) % visible.length];
    next.focus();
    next.click();
  });
  if (k === 2) tab.hidden = !mixers.looks.length;
});

arrange();
