/** The table of keyboard shortcuts, for the keyboard and for the dialog that lists them. */

import { saveLook } from './look_actions.js';
import { showNextView } from './view_tabs.js';
import {
  chooseTool,
  togglePanels,
  hardenBrush,
  LAYOUTS,
  updateShow,
  next,
  OVERLAYS,
  resizeBrush,
  swapColours,
  TOOLS,
} from './tools.js';

/** @typedef {import("./engine_interface.js").Engine} Engine */
/** @typedef {import("./session_controller.js").SessionController} SessionController */
/** @typedef {import("./ui_state.js").UiStore} UiStore */
/** @typedef {{store: UiStore, session: SessionController, engine: Engine}} App */
/** isOnce: ignores repeats of a held key.
 * @typedef {{keys: string, shown: string[], does: string, act?: (app: App) => void,
 *   isOnce?: boolean}} Key */

/** Name of the Ctrl key on this system. */
export const MOD = /mac/i.test(navigator.platform) ? '⌘' : 'Ctrl';

const zoomBy =
  (/** @type {number} */ factor) =>
  (/** @type {App} */ { store, engine }) => {
    const { width, height } = engine.element.getBoundingClientRect();
    const pane = engine.panes()[0] ?? { x: 0, y: 0, width, height };
    updateShow(store, engine.zoomAt(pane.x + pane.width / 2, pane.y + pane.height / 2, factor));
  };

/** Show one picture pixel per page pixel. @param {App} app */
export function showPixels({ store, engine }) {
  const scale = engine.panes()[0]?.scale;
  if (scale) updateShow(store, { zoom: store.value.show.zoom / scale });
}

/** @param {number} by */
const changeExposure =
  (by) =>
  (/** @type {App} */ { store }) =>
    updateShow(store, { stops: Math.min(10, Math.max(-10, store.value.show.stops + by)) });

/** All shortcuts, by their effect. `keys`: the browser's names, after Shift and Mod (Ctrl or ⌘). */
/** @type {{title: string, keys: Key[]}[]} */
export const SHORTCUTS = [
  {
    title: 'Tools',
    keys: TOOLS.map(({ tool, keys, label }) => ({
      keys: keys.toLowerCase(),
      shown: [keys],
      does: label,
      act: ({ store }) => chooseTool(store, tool),
    })),
  },
  {
    title: 'General',
    keys: [
      {
        keys: 'mod+s',
        shown: ['Ctrl', 'S'],
        does: 'save look',
        act: (app) => void saveLook(app),
        isOnce: true,
      },
      {
        keys: 'p',
        shown: ['P'],
        does: 'show or hide panels',
        act: ({ store }) => togglePanels(store),
      },
      {
        keys: 'd',
        shown: ['D'],
        does: 'mark the lights, and move them',
        act: ({ store, session }) => {
          if (store.value.state?.can_render) session.toggleLamps();
        },
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
      { keys: '[', shown: ['['], does: 'smaller', act: ({ store }) => resizeBrush(store, -1) },
      { keys: ']', shown: [']'], does: 'larger', act: ({ store }) => resizeBrush(store, 1) },
      {
        keys: '{',
        shown: ['Shift', '['],
        does: 'softer',
        act: ({ store }) => hardenBrush(store, -1),
      },
      {
        keys: '}',
        shown: ['Shift', ']'],
        does: 'harder',
        act: ({ store }) => hardenBrush(store, 1),
      },
      { keys: 'digit', shown: ['1', '…', '9', '0'], does: 'flow 10 % to 100 %' },
      { keys: 'x', shown: ['X'], does: 'swap colours', act: ({ store }) => swapColours(store) },
      { keys: '', shown: ['Alt', 'click'], does: 'pick light from the picture' },
      { keys: '', shown: ['Shift', 'click'], does: 'line from the last stroke' },
      {
        keys: 'escape',
        shown: ['Esc'],
        does: 'cancel the stroke',
        act: ({ engine, store }) => {
          const isClosed = engine.cancel() ? {} : { panel: null };
          store.set({ asking: null, hovered: null, pointing: null, ...isClosed });
        },
      },
      {
        keys: 'mod+z',
        shown: ['Ctrl', 'Z'],
        does: 'undo',
        // Undo first cancels the current stroke, which is the last action.
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
        act: ({ store }) => updateShow(store, { zoom: 1, pan: [0, 0] }),
      },
      { keys: 'shift+f', shown: ['Shift', 'F'], does: '100 %', act: showPixels },
      {
        keys: 'v',
        shown: ['V'],
        does: 'side by side, wipe, blink',
        act: ({ store }) => updateShow(store, { layout: next(LAYOUTS, store.value.show.layout) }),
      },
      {
        keys: 'n',
        shown: ['N'],
        does: 'next view, if there are several',
        act: showNextView,
      },
      {
        keys: 'k',
        shown: ['K'],
        does: 'switch the picture in blink',
        act: ({ store }) =>
          updateShow(store, {
            layout: 'blink',
            blink: store.value.show.blink === 'left' ? 'right' : 'left',
          }),
      },
      { keys: ',', shown: [','], does: 'lower display exposure', act: changeExposure(-0.5) },
      { keys: '.', shown: ['.'], does: 'raise display exposure', act: changeExposure(0.5) },
      {
        keys: 'c',
        shown: ['C'],
        does: 'denoise on or off',
        act: ({ store }) => updateShow(store, { clean: !store.value.show.clean }),
      },
      {
        keys: 'o',
        shown: ['O'],
        does: 'next overlay',
        act: ({ store }) =>
          updateShow(store, { overlay: next(OVERLAYS, store.value.show.overlay) }),
      },
    ],
  },
];
