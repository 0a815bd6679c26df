/** Two looks, A and B, separated by a wipe, with the lights of both beside them. */
import { createElement } from '../../viewer/mixer/page_elements.js';
import {
  aspectOf,
  elementOf,
  headRow,
  inputOf,
  lightCell,
  lightsOf,
  luminanceText,
  stopsText,
  titleOf,
} from './gallery_data.js';

/** @import { Look } from './gallery_data.js' */
/** @import { Side } from './look_cards.js' */

export class LookComparison {
  /** @param {() => Look[]} shownLooks the looks that the filter leaves, in their order */
  constructor(shownLooks) {
    this.shownLooks = shownLooks;
    /** Set once the cards are made. @type {Map<Look, HTMLElement>} */
    this.cards = new Map();
    /** @type {{a: Look | null, b: Look | null}} */
    this.pair = { a: null, b: null };
    this.dialog = /** @type {HTMLDialogElement} */ (elementOf('wipe'));
    this.stage = /** @type {HTMLElement} */ (this.dialog.querySelector('.stage'));
    this.addListeners();
  }

  addListeners() {
    const { dialog, stage } = this;
    /** @param {PointerEvent} event */
    const follow = (event) => {
      if (!(this.pair.a && this.pair.b)) return;
      const box = stage.getBoundingClientRect();
      const percent = (100 * (event.clientX - box.left)) / box.width;
      this.moveBorder(Math.min(100, Math.max(0, percent)));
    };
    stage.addEventListener('pointerdown', follow);
    stage.addEventListener('pointermove', follow);
    const slider = inputOf('slide');
    slider.addEventListener('input', () => this.moveBorder(Number(slider.value)));
    elementOf('before').addEventListener('click', () => this.step(-1));
    elementOf('next').addEventListener('click', () => this.step(1));
    elementOf('swap').addEventListener('click', () => this.swap());
    elementOf('compare').addEventListener('click', () => this.open());
    elementOf('clear').addEventListener('click', () => this.clear());
    elementOf('close').addEventListener('click', () => dialog.close());
    dialog.addEventListener('keydown', (event) => {
      if (event.target instanceof HTMLInputElement) return;
      if (event.key === 'ArrowLeft') this.step(-1);
      if (event.key === 'ArrowRight') this.step(1);
    });
    dialog.addEventListener('click', (event) => {
      if (event.target === dialog) dialog.close();
    });
    // An enlarged look is not part of a pair.
    dialog.addEventListener('close', () => {
      if (!this.pair.b) this.choose('a', null);
    });
  }

  /** @param {Side} side @param {Look | null} look */
  choose(side, look) {
    const previous = this.pair[side];
    this.pair[side] = look;
    const { a, b } = this.pair;
    for (const changedLook of [previous, look]) {
      const card = changedLook && this.cards.get(changedLook);
      if (!card) continue;
      for (const button of card.querySelectorAll('[data-side]')) {
        const chosenLook = /** @type {HTMLElement} */ (button).dataset.side === 'a' ? a : b;
        button.setAttribute('aria-pressed', String(chosenLook === changedLook));
      }
      card.classList.toggle('is-chosen', a === changedLook || b === changedLook);
    }
    this.showTray();
  }

  /** Choose a look or, if it is chosen already, no look; compare both once there are two.
   * @param {Side} side @param {Look} look */
  toggle(side, look) {
    this.choose(side, this.pair[side] === look ? null : look);
    if (this.pair.a && this.pair.b) this.open();
  }

  /** Show one look, large. @param {Look} look */
  enlarge(look) {
    this.choose('a', look);
    this.open();
  }

  clear() {
    this.choose('a', null);
    this.choose('b', null);
  }

  swap() {
    const { a, b } = this.pair;
    this.choose('a', b);
    this.choose('b', a);
    this.open();
  }

  /** Show the chosen looks in the tray, where others can be chosen. */
  showTray() {
    const { a, b } = this.pair;
    elementOf('tray').hidden = (!a && !b) || elementOf('looks-panel').hidden;
    elementOf('tray-a').textContent = a ? titleOf(a) : '—';
    elementOf('tray-b').textContent = b ? titleOf(b) : '—';
    inputOf('compare').disabled = !a || !b;
  }

  /** Fill the dialog with the chosen looks, and open it. */
  open() {
    const { dialog } = this;
    const { a, b } = this.pair;
    const first = a ?? b;
    if (!first) return;
    const pictures = this.stage.querySelectorAll('img');
    [b ?? first, first].forEach((look, k) => {
      pictures[k].src = look.picture ?? '';
      pictures[k].alt = titleOf(look);
    });
    elementOf('name-a').textContent = titleOf(first);
    elementOf('name-b').textContent = b ? titleOf(b) : '';
    const isPair = Boolean(a && b && a !== b);
    elementOf('pair').textContent =
      isPair && b ? `${titleOf(first)} | ${titleOf(b)}` : titleOf(first);
    for (const element of dialog.querySelectorAll('.of-two'))
      /** @type {HTMLElement} */ (element).hidden = !isPair;
    dialog.style.setProperty('--aspect', aspectOf(first));
    dialog.style.setProperty('--ratio', String(first.size[0] / first.size[1]));
    this.moveBorder(isPair ? 50 : 100);
    listLights(first, isPair ? b : null);
    if (!dialog.open) dialog.showModal();
  }

  /** @param {number} percent from the left, of A */
  moveBorder(percent) {
    this.stage.style.setProperty('--p', `${percent}%`);
    inputOf('slide').value = String(percent);
  }

  /** Go to the look before or after this one, among the visible ones. @param {number} count */
  step(count) {
    const side = this.pair.b ? 'b' : 'a';
    const looks = this.shownLooks().filter((look) => look.picture);
    if (!looks.length) return;
    const currentIndex = looks.indexOf(/** @type {Look} */ (this.pair[side]));
    const border = Number(inputOf('slide').value);
    this.choose(side, looks[(currentIndex + count + looks.length) % looks.length]);
    this.open();
    if (this.pair.b) this.moveBorder(border);
  }
}

/** List the lights of one or both looks, those that change most first.
 * @param {Look} a @param {Look | null} b */
function listLights(a, b) {
  const lightsOfB = new Map((b ? lightsOf(b) : []).map((light) => [light.name, light]));
  const rows = lightsOf(a).map((light) => {
    const lightOfB = lightsOfB.get(light.name);
    const [y, z] = [light.y, lightOfB?.y ?? 0];
    const stops = y > 0 && z > 0 ? Math.log2(z / y) : y > 0 || z > 0 ? Infinity : 0;
    const row = createElement('tr');
    row.append(createElement('th', '', light.name), lightCell(light, luminanceText(light.y)));
    if (b && lightOfB) {
      const change = Number.isFinite(stops) ? stopsText(stops) : z > 0 ? 'on' : 'off';
      row.append(lightCell(lightOfB, luminanceText(lightOfB.y)));
      row.append(createElement('td', '', y === z ? '=' : change));
    }
    return { row, weight: b ? Math.abs(stops) : 0 };
  });
  if (b) rows.sort((rowA, rowB) => rowB.weight - rowA.weight || 0);
  const headings = b ? ['light', 'A', 'B', 'stops'] : ['light', 'luminance'];
  elementOf('beside-head').replaceChildren(headRow(headings));
  elementOf('beside-body').replaceChildren(...rows.map(({ row }) => row));
}
