/**
 * The gallery of a batch: a page from a disk, with all that it shows in itself.
 *
 * Cards that can be filtered and ordered, any two of them under a border, the table of their lights,
 * and a mixer for each basis, which begins from any of its looks.
 */
import { begin } from '../../viewer/mixer/mixer.js';

/** @typedef {import("../../viewer/drawing/colour.js").RGB} RGB */
/** @typedef {import("../../viewer/mixer/mixer.js").Look["transform"]} Transform */
/** @typedef {{name: string, y: number, emission?: RGB, hex?: string, kelvin?: number, duv?: number,
 *   stops?: number}} LookLight */
/** links: name and address. basis: of its mixer. view: transform and stops.
 * @typedef {{look: string, state: 'failed' | 'waiting' | 'done', folder: string, why?: string,
 *   sensor?: string, scene?: string, target?: string, variation?: string, delta_e?: number,
 *   agrees?: boolean, lights?: LookLight[], size: [number, number], picture?: string,
 *   links: [string, string][], basis?: string, view?: [string, number]}} Look */

/** How far from Planck's locus a light may be to have a colour temperature. */
const WHITE = 0.02;
/** What files are called on a card; others go by their names. @type {Record<string, string>} */
const LINKS = {
  'report.html': 'report',
  'comparison.png': 'comparison',
  'relit.png': 'render',
  'relit.exr': 'EXR',
  'lighting.json': 'lighting',
};

/** What stands where there is no picture. */
const BLANK = { failed: 'failed', waiting: 'not done yet', done: 'no picture' };

/** @param {string} id */
const find = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
const field = (id) => /** @type {HTMLInputElement} */ (find(id));
/** @param {string} id @returns {any} */
const json = (id) => JSON.parse(find(id).textContent ?? '');

/** @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag @param {string} [text] @param {string} [kind] */
function made(tag, text = '', kind = '') {
  const element = document.createElement(tag);
  element.textContent = text;
  if (kind) element.className = kind;
  return element;
}

/** @param {string} text @param {string} label @param {() => void} act */
function button(text, label, act) {
  const element = made('button', text, 'button');
  element.type = 'button';
  element.setAttribute('aria-label', label);
  element.addEventListener('click', act);
  return element;
}

/** @type {Look[]} */
const looks = json('looks');
/** @type {Record<string, Transform>} */
const transforms = json('transforms');
/** @type {Map<string, HTMLElement>} */
const mixers = new Map();
for (const root of document.querySelectorAll('.mixer'))
  if (root instanceof HTMLElement) mixers.set(root.dataset.basis ?? '', root);

/** @param {Look} look */
const called = (look) =>
  look.folder === look.look ? look.look : `${look.look} · ${look.sensor ?? look.folder}`;
/** @param {Look} look */
const aspect = (look) => `${look.size[0]} / ${look.size[1]}`;
/** @param {number} y */
const number = (y) => (y === 0 ? 'off' : String(Number(y.toPrecision(3))));
/** @param {number} stops */
const signed = (stops) => `${stops < 0 ? '−' : '+'}${Math.abs(stops).toFixed(1)}`;

/** What not all looks have in common is worth saying of each. @param {'sensor' | 'scene'} key */
const varies = (key) => new Set(looks.map((look) => look[key]).filter(Boolean)).size > 1;
const SAID = /** @type {const} */ (['sensor', 'scene']).filter(varies);

// ------------------------------------------------------------------------------------- cards

/** @param {Look} look */
function facts(look) {
  const line = made('div', '', 'facts');
  const said = [];
  if (look.delta_e !== undefined) said.push(`ΔE ${look.delta_e.toFixed(1)}`);
  if (look.agrees) said.push('verified');
  if (look.variation) said.push(look.variation);
  for (const key of SAID) if (look[key]) said.push(look[key]);
  line.append(said.join(' · '));
  if (look.agrees === false) line.append(made('span', ' render disagrees', 'warns'));
  return line;
}

/** @param {Look} look */
function card(look) {
  const item = made('li', '', `card ${look.state}`);
  item.style.setProperty('--aspect', aspect(look));
  const name = called(look);
  if (look.picture) {
    const shot = made('button', '', 'shot');
    shot.type = 'button';
    shot.setAttribute('aria-label', `Enlarge ${name}`);
    const picture = new Image();
    picture.loading = 'lazy';
    picture.alt = '';
    picture.src = look.picture;
    shot.append(picture);
    shot.addEventListener('click', () => show(look));
    item.append(shot);
  } else item.append(made('div', BLANK[look.state], 'blank'));
  const says = made('div', '', 'says');
  says.append(made('div', name, 'name'), facts(look));
  if (look.why) says.append(made('div', look.why, 'why'));
  const row = made('div', '', 'row');
  const links = made('div', '', 'links');
  for (const [file, to] of look.links) {
    const link = made('a', LINKS[file] ?? file);
    link.href = to;
    link.title = file;
    links.append(link);
  }
  row.append(links);
  if (look.picture) {
    for (const side of /** @type {const} */ (['a', 'b'])) {
      const choice = button(side.toUpperCase(), `${name} as ${side.toUpperCase()}`, () => {
        choose(side, chosen[side] === look ? null : look);
        if (chosen.a && chosen.b) compare();
      });
      choice.setAttribute('aria-pressed', 'false');
      choice.dataset.side = side;
      row.append(choice);
    }
    if (look.basis && mixers.has(look.basis))
      row.append(button('Mix', `Mix the lights of ${name}`, () => mix(look)));
  }
  says.append(row);
  item.append(says);
  return item;
}

const cards = new Map(looks.map((look) => [look, card(look)]));

/** Those that are shown, in their order. @type {Look[]} */
let shown = [];
const texts = new Map(
  looks.map((look) => [
    look,
    [look.look, look.target, look.sensor, look.scene, look.variation, look.why]
      .join(' ')
      .toLowerCase(),
  ]),
);

function arrange() {
  const words = field('filter').value.toLowerCase().split(/\s+/).filter(Boolean);
  const state = field('state').value;
  shown = looks.filter((look) => {
    const text = texts.get(look) ?? '';
    return (!state || look.state === state) && words.every((word) => text.includes(word));
  });
  const order = field('order').value;
  if (order === 'look') shown.sort((a, b) => called(a).localeCompare(called(b), 'en', NUMERIC));
  if (order === 'delta_e') shown.sort((a, b) => (b.delta_e ?? -1) - (a.delta_e ?? -1));
  find('cards').replaceChildren(...shown.map((look) => cards.get(look) ?? ''));
  find('count').textContent = `${shown.length} of ${looks.length}`;
  find('none').hidden = shown.length > 0;
  if (!find('lights-panel').hidden) tabulate();
}
/** So that 10 stands behind 9. */
const NUMERIC = { numeric: true };
for (const id of ['filter', 'state', 'order']) find(id).addEventListener('input', arrange);
find('large').addEventListener('input', () =>
  document.body.style.setProperty('--card', field('large').checked ? '420px' : '250px'),
);

// ----------------------------------------------------------------------------------- A and B

/** @type {{a: Look | null, b: Look | null}} */
const chosen = { a: null, b: null };
const wipe = /** @type {HTMLDialogElement} */ (find('wipe'));
const stage = /** @type {HTMLElement} */ (wipe.querySelector('.stage'));

/** @param {'a' | 'b'} side @param {Look | null} look */
function choose(side, look) {
  const before = chosen[side];
  chosen[side] = look;
  for (const one of [before, look]) {
    const item = one && cards.get(one);
    if (!item) continue;
    for (const other of item.querySelectorAll('[data-side]')) {
      const its = /** @type {HTMLElement} */ (other).dataset.side === 'a' ? chosen.a : chosen.b;
      other.setAttribute('aria-pressed', String(its === one));
    }
    item.classList.toggle('is-chosen', chosen.a === one || chosen.b === one);
  }
  tray();
}

/** What is chosen, where more can be. */
function tray() {
  const { a, b } = chosen;
  find('tray').hidden = (!a && !b) || find('looks-panel').hidden;
  find('tray-a').textContent = a ? called(a) : '—';
  find('tray-b').textContent = b ? called(b) : '—';
  field('compare').disabled = !a || !b;
}

/** One look, large. @param {Look} look */
function show(look) {
  choose('a', look);
  choose('b', chosen.b ?? null);
  compare();
}

/** Open, or fill, the pair. */
function compare() {
  const { a, b } = chosen;
  const first = a ?? b;
  if (!first) return;
  const pictures = stage.querySelectorAll('img');
  [b ?? first, first].forEach((look, k) => {
    pictures[k].src = look.picture ?? '';
    pictures[k].alt = called(look);
  });
  find('name-a').textContent = called(first);
  find('name-b').textContent = b ? called(b) : '';
  const isPair = Boolean(a && b && a !== b);
  find('pair').textContent = isPair && b ? `${called(first)} | ${called(b)}` : called(first);
  for (const element of wipe.querySelectorAll('.of-two'))
    /** @type {HTMLElement} */ (element).hidden = !isPair;
  wipe.style.setProperty('--aspect', aspect(first));
  wipe.style.setProperty('--ratio', String(first.size[0] / first.size[1]));
  border(isPair ? 50 : 100);
  besides(first, isPair ? b : null);
  if (!wipe.open) wipe.showModal();
}

/** The lights of one or of both, those that change most first.
 * @param {Look} a @param {Look | null} b */
function besides(a, b) {
  const others = new Map((b?.lights ?? []).map((light) => [light.name, light]));
  const rows = (a.lights ?? []).map((light) => {
    const other = others.get(light.name);
    const [y, z] = [light.y, other?.y ?? 0];
    const stops = y > 0 && z > 0 ? Math.log2(z / y) : y > 0 || z > 0 ? Infinity : 0;
    const row = made('tr');
    row.append(made('th', light.name), cell(light, number(light.y)));
    if (b && other) {
      const change = Number.isFinite(stops) ? signed(stops) : z > 0 ? 'on' : 'off';
      row.append(cell(other, number(other.y)), made('td', y === z ? '=' : change));
    }
    return { row, weight: b ? Math.abs(stops) : 0 };
  });
  if (b) rows.sort((one, other) => other.weight - one.weight || 0);
  const head = made('tr');
  for (const text of b ? ['light', 'A', 'B', 'stops'] : ['light', 'luminance'])
    head.append(made('th', text));
  for (const th of head.children) th.setAttribute('scope', 'col');
  find('beside-head').replaceChildren(head);
  find('beside-body').replaceChildren(...rows.map(({ row }) => row));
}

/** @param {LookLight} light @param {string} text */
function cell(light, text) {
  const made_ = made('td', '', light.y === 0 ? 'is-off' : '');
  if (light.hex && light.y > 0) {
    const swatch = made('span', '', 'swatch');
    swatch.style.background = light.hex;
    made_.append(swatch);
  }
  made_.append(text);
  return made_;
}

/** @param {number} percent from the left, of A */
function border(percent) {
  stage.style.setProperty('--p', `${percent}%`);
  field('slide').value = String(percent);
}
/** @param {PointerEvent} event */
function follow(event) {
  if (!(chosen.a && chosen.b)) return;
  const box = stage.getBoundingClientRect();
  border(Math.min(100, Math.max(0, (100 * (event.clientX - box.left)) / box.width)));
}
stage.addEventListener('pointerdown', follow);
stage.addEventListener('pointermove', follow);
find('slide').addEventListener('input', () => border(Number(field('slide').value)));

/** The look that stands so many places on, of those that are shown. @param {number} by */
function step(by) {
  const side = chosen.b ? 'b' : 'a';
  const seen = shown.filter((look) => look.picture);
  const now = seen.indexOf(/** @type {Look} */ (chosen[side]));
  if (!seen.length) return;
  const at = Number(field('slide').value);
  choose(side, seen[(now + by + seen.length) % seen.length]);
  compare();
  if (chosen.b) border(at);
}
find('before').addEventListener('click', () => step(-1));
find('next').addEventListener('click', () => step(1));
wipe.addEventListener('keydown', (event) => {
  if (event.target instanceof HTMLInputElement) return;
  if (event.key === 'ArrowLeft') step(-1);
  if (event.key === 'ArrowRight') step(1);
});
find('swap').addEventListener('click', () => {
  const { a, b } = chosen;
  choose('a', b);
  choose('b', a);
  compare();
});
find('close').addEventListener('click', () => wipe.close());
wipe.addEventListener('click', (event) => {
  if (event.target === wipe) wipe.close();
});
// One that was only looked at is not half of a pair.
wipe.addEventListener('close', () => {
  if (!chosen.b) choose('a', null);
});
find('compare').addEventListener('click', compare);
find('clear').addEventListener('click', () => {
  choose('a', null);
  choose('b', null);
});

// -------------------------------------------------------------------------------- all lights

const lit = new Set(looks.filter((look) => look.lights));
const names = [...new Set([...lit].flatMap((look) => (look.lights ?? []).map((x) => x.name)))];
/** The brightest that each light is anywhere. */
const most = new Map();
for (const look of lit)
  for (const { name, y } of look.lights ?? []) most.set(name, Math.max(y, most.get(name) ?? 0));

/** @type {Map<Look, HTMLElement>} */
const rows = new Map();

/** @param {Look} look */
function lightsOf(look) {
  const row = made('tr');
  const head = made('th', called(look));
  head.title = called(look);
  head.scope = 'row';
  row.append(head);
  const its = new Map((look.lights ?? []).map((light) => [light.name, light]));
  const isStops = field('unit').value === 'stops';
  for (const name of names) {
    const light = its.get(name);
    if (!light) {
      row.append(made('td'));
      continue;
    }
    const stops = light.stops === undefined ? '' : signed(light.stops);
    const one = cell(light, isStops ? (light.y === 0 ? 'off' : stops) : number(light.y));
    if (light.kelvin) one.title = `${Math.round(light.kelvin)} K`;
    // Ten stops below its brightest a bar has no length.
    const part = light.y > 0 ? 1 + Math.log2(light.y / most.get(name)) / 10 : 0;
    one.style.setProperty('--v', Math.max(0, part).toFixed(3));
    row.append(one);
  }
  return row;
}

function tabulate() {
  const head = made('tr');
  head.append(...['look', ...names].map((name) => made('th', name)));
  for (const th of head.children) th.setAttribute('scope', 'col');
  find('lights-head').replaceChildren(head);
  const made_ = shown
    .filter((look) => lit.has(look))
    .map((look) => {
      const row = rows.get(look) ?? lightsOf(look);
      rows.set(look, row);
      return row;
    });
  find('lights-body').replaceChildren(...made_);
}
find('unit').addEventListener('input', () => {
  rows.clear();
  tabulate();
});

// ------------------------------------------------------------------------------------- mixer

/** How often a mixer was asked for: one that is slow to unpack does not come after another. */
let asked = 0;
/** The mixer that begins from a look. @param {Look} look */
function mix(look) {
  const root = mixers.get(look.basis ?? '');
  if (!root) return;
  const turn = ++asked;
  select('mixer');
  for (const other of mixers.values()) if (other !== root) other.hidden = true;
  field('from').value = String(looks.indexOf(look));
  const [view, stops] = look.view ?? ['srgb', 0];
  const transform = { ...(transforms[view] ?? transforms.srgb), stops };
  const lights = look.lights ?? [];
  const isWhite = (/** @type {LookLight} */ { duv }) => duv !== undefined && Math.abs(duv) <= WHITE;
  /** @type {import("../../viewer/mixer/mixer.js").Look} */
  const its = {
    name: look.look,
    emission: new Map(lights.map((light) => [light.name, light.emission ?? [0, 0, 0]])),
    kelvin: new Map(lights.map((x) => [x.name, (isWhite(x) && x.kelvin) || null])),
    transform,
  };
  begin(root, its, () => turn === asked);
  scrollTo(0, 0);
}
/** Those that can be mixed. */
const mixed = looks.filter((look) => look.basis && mixers.has(look.basis));
for (const look of mixed) {
  const option = made('option', called(look));
  option.value = String(looks.indexOf(look));
  find('from').append(option);
}
find('from').addEventListener('input', () => mix(looks[Number(field('from').value)]));

// -------------------------------------------------------------------------------------- tabs

const tabs = [...document.querySelectorAll('[role=tab]')].map(
  (x) => /** @type {HTMLElement} */ (x),
);

/** @param {string} name */
function select(name) {
  for (const tab of tabs) {
    const is = tab.id === `${name}-tab`;
    tab.setAttribute('aria-selected', String(is));
    tab.tabIndex = is ? 0 : -1;
    find(tab.getAttribute('aria-controls') ?? '').hidden = !is;
  }
  find('filters').style.visibility = name === 'mixer' ? 'hidden' : '';
  find('size').hidden = name !== 'looks';
  tray();
  if (name === 'lights') tabulate();
  if (name === 'mixer' && !asked && mixed.length) mix(mixed[0]);
}
tabs.forEach((tab, k) => {
  tab.addEventListener('click', () => select(tab.id.replace('-tab', '')));
  tab.addEventListener('keydown', (event) => {
    const by = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (!by) return;
    const there = tabs.filter((x) => !x.hidden);
    const other = there[(there.indexOf(tab) + by + there.length) % there.length];
    other.focus();
    other.click();
  });
  if (k === 2) tab.hidden = !mixed.length;
});

arrange();
