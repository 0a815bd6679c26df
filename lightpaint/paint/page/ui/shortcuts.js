/** All keys: one table, for the keyboard and for the overlay that shows them. */

import { keepLook } from './look_actions.js';
import { seeNext } from './view_tabs.js';
import {
  choose,
  fold,
  harden,
  LAYOUTS,
  look,
  next,
  OVERLAYS,
  resize,
  setFlow,
  swap,
  TOOLS,
} from './tools.js';

/** @typedef {import("./engine_interface.js").Engine} Engine */
/** @typedef {import("./session_controller.js").Session} Session */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {{store: UiStore, session: Session, engine: Engine}} Hands */
/** isOnce: a key that is held down does it once.
 * @typedef {{keys: string, shown: string[], does: string, act?: (hands: Hands) => void,
 *   isOnce?: boolean}} Key */

/** What Ctrl is called here. */
export const MOD = /mac/i.test(navigator.platform) ? '⌘' : 'Ctrl';

const zoomBy =
  (/** @type {number} */ factor) =>
  (/** @type {Hands} */ { store, engine }) => {
    const { width, height } = engine.element.getBoundingClientRect();
    const pane = engine.panes()[0] ?? { x: 0, y: 0, width, height };
    look(store, engine.zoomAt(pane.x + pane.width / 2, pane.y + pane.height / 2, factor));
  };

/** One pixel of the picture on one of the page. @param {Hands} hands */
export function showPixels({ store, engine }) {
  const scale = engine.panes()[0]?.scale;
  if (scale) look(store, { zoom: store.value.show.zoom / scale });
}

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
    title: 'General',
    keys: [
      {
        keys: 'mod+s',
        shown: ['Ctrl', 'S'],
        does: 'save look',
        act: (hands) => void keepLook(hands),
        isOnce: true,
      },
      {
        keys: 'p',
        shown: ['P'],
        does: 'show or hide panels',
        act: ({ store }) => fold(store),
      },
      {
        keys: '?',
        shown: ['?'],
        does: 'show these shortcuts',
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { keys: '', shown: ['Tab'], does: 'next control' },
      { keys: '', shown: ['← ↑ ↓ →'], does: 'move the brush on the pictures; Enter paints' },
      { keys: '', shown: ['Shift', 'Enter'], does: 'there, a line from the last stroke' },
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
      { keys: 'x', shown: ['X'], does: 'swap colours', act: ({ store }) => swap(store) },
      { keys: '', shown: ['Alt', 'click'], does: 'pick light from the picture' },
      { keys: '', shown: ['Shift', 'click'], does: 'line from the last stroke' },
      {
        keys: 'escape',
        shown: ['Esc'],
        does: 'cancel the stroke',
        act: ({ engine, store }) => {
          const isClosed = engine.cancel() ? {} : { panel: null };
          store.set({ asking: null, hovered: null, ...isClosed });
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
      { keys: '', shown: ['Space', 'drag'], does: 'pan' },
      { keys: '', shown: ['Ctrl', 'wheel'], does: 'zoom' },
      { keys: '+', shown: ['+'], does: 'zoom in', act: zoomBy(1.25) },
      { keys: '-', shown: ['−'], does: 'zoom out', act: zoomBy(0.8) },
      {
        keys: 'f',
        shown: ['F'],
        does: 'fit to window',
        act: ({ store }) => look(store, { zoom: 1, pan: [0, 0] }),
      },
      { keys: 'shift+f', shown: ['Shift', 'F'], does: '100 %', act: showPixels },
      {
        keys: 'v',
        shown: ['V'],
        does: 'side by side, wipe, blink',
        act: ({ store }) => look(store, { layout: next(LAYOUTS, store.value.show.layout) }),
      },
      {
        keys: 'n',
        shown: ['N'],
        does: 'next view, if there are several',
        act: seeNext,
      },
      {
        keys: 'k',
        shown: ['K'],
        does: 'switch the picture in blink',
        act: ({ store }) =>
          look(store, {
            layout: 'blink',
            blink: store.value.show.blink === 'left' ? 'right' : 'left',
          }),
      },
      { keys: ',', shown: [','], does: 'lower display exposure', act: expose(-0.5) },
      { keys: '.', shown: ['.'], does: 'raise display exposure', act: expose(0.5) },
      {
        keys: 'c',
        shown: ['C'],
        does: 'denoise on or off',
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
  if (key === 'f' && event.shiftKey) return 'shift+f';
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

/** Whether a key is pressed among numbers that are being put in: on a button between them, too, it
 * is none of the pictures'. @param {KeyboardEvent} event */
function isAmongNumbers(event) {
  const element = /** @type {HTMLElement} */ (event.composedPath()[0]);
  return event.key.length === 1 && !isMod(event) && Boolean(element.closest?.('[data-numbers]'));
}

/** Have what is typed in a field taken, before something is done with it.
 * @param {KeyboardEvent} event in that field */
function commit(event) {
  const field = /** @type {HTMLElement} */ (event.composedPath()[0]);
  field.blur();
  field.focus({ preventScroll: true });
}

/**
 * What a key does, if it does anything here.
 * @param {KeyboardEvent} event @param {Hands} hands
 */
export function press(event, hands) {
  const isAlt = event.altKey && !event.getModifierState('AltGraph');
  if (event.defaultPrevented || isAlt) return;
  const name = named(event);
  const isIn = isTyping(event) || isAmongNumbers(event);
  // A page is no file that anybody keeps, and nothing of it but fields has text to be marked.
  if (name === 'mod+s' || (name === 'mod+a' && !isIn)) event.preventDefault();
  if (hands.store.value.dialog) return;
  if (name === 'mod+s' && isIn) commit(event);
  else if (isIn) return;
  const digit = /^[0-9]$/.test(event.key) && !event.ctrlKey && !event.metaKey;
  const found = BY_KEY.get(name);
  if (digit) setFlow(hands.store, (Number(event.key) || 10) / 10);
  else if (found && !(found.isOnce && event.repeat)) found.act?.(hands);
  else if (!found) return;
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
