/** All keys: one table, for the keyboard and for the overlay that shows them. */

import { seeNext } from './views.js';
import { choose, harden, LAYOUTS, look, next, OVERLAYS, resize, swap, TOOLS } from './tools.js';

/** @typedef {import("./engine.js").Engine} Engine */
/** @typedef {import("./session.js").Session} Session */
/** @typedef {import("./model.js").UiStore} UiStore */
/** @typedef {{store: UiStore, session: Session, engine: Engine}} Hands */
/** @typedef {{keys: string, shown: string[], does: string, act?: (hands: Hands) => void}} Key */

const zoomBy =
  (/** @type {number} */ factor) =>
  (/** @type {Hands} */ { store, engine }) => {
    const { width, height } = engine.element.getBoundingClientRect();
    const pane = engine.panes()[0] ?? { x: 0, y: 0, width, height };
    look(store, engine.zoomAt(pane.x + pane.width / 2, pane.y + pane.height / 2, factor));
  };

/** @param {number} by */
const expose =
  (by) =>
  (/** @type {Hands} */ { store }) =>
    look(store, { stops: Math.min(10, Math.max(-10, store.value.show.stops + by)) });

/** Named by what they do; `keys` as the browser says them, Shift and Mod (Ctrl or ⌘) in front. */
/** @type {{title: string, keys: Key[]}[]} */
export const KEYS = [
  {
    title: 'Tools',
    keys: TOOLS.map(({ tool, keys, label }) => ({
      keys: keys.toLowerCase(),
      shown: [keys],
      does: label,
      act: ({ store }) => choose(store, tool),
    })),
  },
  {
    title: 'Work',
    keys: [
      {
        keys: 'mod+s',
        shown: ['Ctrl', 'S'],
        does: 'keep this look',
        act: ({ session, store }) =>
          void session.send('save_look', { name: `Look ${store.value.looks.length + 1}` }),
      },
      {
        keys: 'p',
        shown: ['P'],
        does: 'panels away, and back',
        act: ({ store }) => store.set({ side: !store.value.side }),
      },
      {
        keys: '?',
        shown: ['?'],
        does: 'these keys',
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { keys: '', shown: ['Tab'], does: 'from control to control' },
      { keys: '', shown: ['← ↑ ↓ →'], does: 'on the pictures: the brush, Enter paints' },
    ],
  },
  {
    title: 'Brush',
    keys: [
      { keys: '[', shown: ['['], does: 'smaller', act: ({ store }) => resize(store, -1) },
      { keys: ']', shown: [']'], does: 'larger', act: ({ store }) => resize(store, 1) },
      { keys: '{', shown: ['Shift', '['], does: 'softer', act: ({ store }) => harden(store, -1) },
      { keys: '}', shown: ['Shift', ']'], does: 'harder', act: ({ store }) => harden(store, 1) },
      { keys: 'digit', shown: ['1', '…', '9', '0'], does: 'flow 10 % to 100 %' },
      { keys: 'x', shown: ['X'], does: 'other colour', act: ({ store }) => swap(store) },
      { keys: '', shown: ['Alt', 'click'], does: 'take light from the picture' },
      { keys: '', shown: ['Shift', 'click'], does: 'line from the last stroke' },
      {
        keys: 'escape',
        shown: ['Esc'],
        does: 'give up the stroke',
        act: ({ engine, store }) => {
          engine.cancel();
          store.set({ asking: null, hovered: null });
        },
      },
      {
        keys: 'mod+z',
        shown: ['Ctrl', 'Z'],
        does: 'undo',
        // What is under the brush is the last thing that was done.
        act: ({ engine, session, store }) => {
          if (engine.cancel()) store.set({ asking: null });
          else void session.send('undo');
        },
      },
      {
        keys: 'mod+shift+z',
        shown: ['Ctrl', 'Shift', 'Z'],
        does: 'redo',
        act: ({ session }) => void session.send('redo'),
      },
    ],
  },
  {
    title: 'Pictures',
    keys: [
      { keys: '', shown: ['Space', 'drag'], does: 'move the pictures' },
      { keys: '', shown: ['Ctrl', 'wheel'], does: 'zoom' },
      { keys: '+', shown: ['+'], does: 'zoom in', act: zoomBy(1.25) },
      { keys: '-', shown: ['−'], does: 'zoom out', act: zoomBy(0.8) },
      {
        keys: 'f',
        shown: ['F'],
        does: 'fit',
        act: ({ store }) => look(store, { zoom: 1, pan: [0, 0] }),
      },
      {
        keys: 'v',
        shown: ['V'],
        does: 'side by side, wipe, blink',
        act: ({ store }) => look(store, { layout: next(LAYOUTS, store.value.show.layout) }),
      },
      {
        keys: 'n',
        shown: ['N'],
        does: 'next view, where there are several',
        act: seeNext,
      },
      {
        keys: 'k',
        shown: ['K'],
        does: 'the other picture, in blink',
        act: ({ store }) =>
          look(store, {
            layout: 'blink',
            blink: store.value.show.blink === 'left' ? 'right' : 'left',
          }),
      },
      { keys: ',', shown: [','], does: 'display darker', act: expose(-0.5) },
      { keys: '.', shown: ['.'], does: 'display brighter', act: expose(0.5) },
      {
        keys: 'c',
        shown: ['C'],
        does: 'clean or raw',
        act: ({ store }) => look(store, { clean: !store.value.show.clean }),
      },
      {
        keys: 'o',
        shown: ['O'],
        does: 'next overlay',
        act: ({ store }) => look(store, { overlay: next(OVERLAYS, store.value.show.overlay) }),
      },
    ],
  },
];

const BY_KEY = new Map(
  KEYS.flatMap(({ keys }) => keys)
    .filter((one) => one.act)
    .map((one) => [one.keys, one]),
);

/** Some keyboards have [ and ] behind AltGr, which is Ctrl and Alt on some systems.
 * @param {KeyboardEvent} event */
const isMod = (event) => (event.ctrlKey || event.metaKey) && !event.getModifierState('AltGraph');

/** @param {KeyboardEvent} event @returns {string} */
function named(event) {
  const key = event.key.toLowerCase();
  if (isMod(event)) return `mod+${event.shiftKey ? 'shift+' : ''}${key}`;
  return key === '=' ? '+' : key;
}

/** @param {KeyboardEvent} event @returns {boolean} whether it belongs to what is typed in */
export function isTyping(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  const { tagName } = element;
  if (tagName === 'INPUT')
    return !['range', 'checkbox', 'radio'].includes(/** @type {HTMLInputElement} */ (element).type);
  return ['TEXTAREA', 'SELECT'].includes(tagName) || element.isContentEditable;
}

/**
 * What a key does, if it does anything here.
 * @param {KeyboardEvent} event @param {Hands} hands
 */
export function press(event, hands) {
  const isAlt = event.altKey && !event.getModifierState('AltGraph');
  if (event.defaultPrevented || isAlt || isTyping(event)) return;
  if (hands.store.value.dialog || hands.store.value.readonly) return;
  const name = named(event);
  const digit = /^[0-9]$/.test(event.key) && !event.ctrlKey && !event.metaKey;
  const found = BY_KEY.get(name);
  if (digit) hands.store.set({ flow: (Number(event.key) || 10) / 10 });
  else if (found) /** @type {any} */ (found).act(hands);
  else return;
  if (name !== 'escape') event.preventDefault();
}

/** With Ctrl or ⌘, what changes the cells of a notebook: cut, paste, redo, run. */
const CELLS = ['x', 'v', 'y', 'enter'];

/**
 * Whether a key is the painter's alone, where it is one thing among others. By a letter or by
 * Delete a notebook makes and deletes cells; what opens something around the painter, function keys
 * and most of what has Ctrl or ⌘, does so from here, too.
 * @param {KeyboardEvent} event that `press` has seen
 */
function isOurs(event) {
  if (event.defaultPrevented) return true;
  if (isMod(event)) return !isTyping(event) && CELLS.includes(event.key.toLowerCase());
  return !/^F\d+$/.test(event.key);
}

/**
 * The keys of a painter that is one thing among others: nobody else hears them.
 * @param {HTMLElement} root @param {Hands} hands @param {AbortSignal} signal ends it
 */
export function hearWithin(root, hands, signal) {
  const hear = (/** @type {KeyboardEvent} */ event) => {
    press(event, hands);
    if (isOurs(event)) event.stopPropagation();
  };
  root.tabIndex = -1; // wherever in it somebody clicks
  root.addEventListener('keydown', hear, { signal });
  // What had the focus may be gone, a window or a button with nothing left to do; then nothing has.
  let isHere = false;
  const touched = (/** @type {Event} */ event) => {
    isHere = event.composedPath().includes(root);
  };
  const early = { signal, capture: true };
  window.addEventListener('pointerdown', touched, early);
  window.addEventListener('focusin', touched, early);
  window.addEventListener(
    'keydown',
    (event) => isHere && event.target === document.body && hear(event),
    early,
  );
}
