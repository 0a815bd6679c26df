/** A card for each look: its picture, its numbers, its files, and buttons to compare and mix it. */
import { createElement } from '../../viewer/mixer/page_elements.js';
import { aspectOf, looks, titleOf } from './gallery_data.js';

/** @import { Look } from './gallery_data.js' */
/** @typedef {'a' | 'b'} Side */
/** mix: null for a look without a mixer.
 * @typedef {{enlarge: (look: Look) => void, choose: (side: Side, look: Look) => void,
 *   mixerOf: (look: Look) => (() => void) | null}} CardActions */

/** Labels of files on a card; other files are labelled by name. @type {Record<string, string>} */
const LINKS = {
  'report.html': 'report',
  'comparison.png': 'comparison',
  'relit.png': 'render',
  'relit.exr': 'EXR',
  'lighting.json': 'lighting',
};

/** The text in place of a picture. */
const BLANK_TEXTS = { failed: 'failed', waiting: 'not done yet', done: 'no picture' };

/** Cards omit facts that all looks share. @param {'sensor' | 'scene'} key */
const varies = (key) => new Set(looks.map((look) => look[key]).filter(Boolean)).size > 1;
const VARYING_FACTS = /** @type {const} */ (['sensor', 'scene']).filter(varies);

/** @param {CardActions} actions @returns {Map<Look, HTMLElement>} */
export function createCards(actions) {
  return new Map(looks.map((look) => [look, createCard(look, actions)]));
}

/** @param {Look} look @param {CardActions} actions */
function createCard(look, actions) {
  const card = createElement('li', `card ${look.state}`);
  card.style.setProperty('--aspect', aspectOf(look));
  const title = titleOf(look);
  const blank = BLANK_TEXTS[look.state];
  card.append(look.picture ? pictureButton(look, actions) : createElement('div', 'blank', blank));
  const caption = createElement('div', 'says');
  caption.append(createElement('div', 'name', title), factsOf(look));
  if (look.why) caption.append(createElement('div', 'why', look.why));
  const row = createElement('div', 'row');
  row.append(linksOf(look));
  if (look.picture) {
    for (const side of /** @type {const} */ (['a', 'b'])) {
      const letter = side.toUpperCase();
      const choice = createButton(letter, `${title} as ${letter}`, () =>
        actions.choose(side, look),
      );
      choice.setAttribute('aria-pressed', 'false');
      choice.dataset.side = side;
      row.append(choice);
    }
    const mix = actions.mixerOf(look);
    if (mix) row.append(createButton('Mix', `Mix the lights of ${title}`, mix));
  }
  caption.append(row);
  card.append(caption);
  return card;
}

/** @param {Look} look @param {CardActions} actions */
function pictureButton(look, actions) {
  const button = createElement('button', 'shot');
  button.type = 'button';
  button.setAttribute('aria-label', `Enlarge ${titleOf(look)}`);
  const picture = new Image();
  picture.loading = 'lazy';
  picture.alt = '';
  picture.src = look.picture ?? '';
  button.append(picture);
  button.addEventListener('click', () => actions.enlarge(look));
  return button;
}

/** @param {Look} look */
function factsOf(look) {
  const line = createElement('div', 'facts');
  const facts = [];
  if (look.delta_e !== undefined) facts.push(`ΔE ${look.delta_e.toFixed(1)}`);
  if (look.agrees) facts.push('verified');
  if (look.variation) facts.push(look.variation);
  for (const key of VARYING_FACTS) if (look[key]) facts.push(look[key]);
  line.append(facts.join(' · '));
  if (look.agrees === false) line.append(createElement('span', 'warns', ' render disagrees'));
  return line;
}

/** @param {Look} look */
function linksOf(look) {
  const links = createElement('div', 'links');
  for (const [file, address] of look.links) {
    const link = createElement('a', '', LINKS[file] ?? file);
    link.href = address;
    link.title = file;
    links.append(link);
  }
  return links;
}

/** @param {string} text @param {string} label @param {() => void} act */
function createButton(text, label, act) {
  const button = createElement('button', 'button', text);
  button.type = 'button';
  button.setAttribute('aria-label', label);
  button.addEventListener('click', act);
  return button;
}
