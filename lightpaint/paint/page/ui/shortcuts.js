/** The table of keyboard shortcuts, for the keyboard and for the dialog that lists them. */

import { saveLook } from './look_actions.js';
import { PREVIOUS_KEY, showPrevious } from './previous_answer.js';
import { chooseSelect, updateSelection } from './selection/selection_settings.js';
import { showNextView } from './view_tabs.js';
import {
  chooseTool,
  togglePanels,
  hardenBrush,
  LAYOUTS,
  updateDisplay,
  nextValue,
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
 * @typedef {{keys: string, symbols: string[], description: string, act?: (app: App) => void,
 *   isOnce?: boolean}} Key */

/** Name of the Ctrl key on this system. */
export const MOD = /mac/i.test(navigator.platform) ? '⌘' : 'Ctrl';

const zoomBy =
  (/** @type {number} */ factor) =>
  (/** @type {App} */ { store, engine }) => {
    const { width, height } = engine.element.getBoundingClientRect();
    const pane = engine.panes()[0] ?? { x: 0, y: 0, width, height };
    updateDisplay(store, engine.zoomAt(pane.x + pane.width / 2, pane.y + pane.height / 2, factor));
  };

/** Show one picture pixel per page pixel. @param {App} app */
export function showPixels({ store, engine }) {
  const scale = engine.panes()[0]?.scale;
  if (scale) updateDisplay(store, { zoom: store.value.display.zoom / scale });
}

/** @param {number} step */
const changeExposure =
  (step) =>
  (/** @type {App} */ { store }) =>
    updateDisplay(store, { stops: Math.min(10, Math.max(-10, store.value.display.stops + step)) });

/** All shortcuts, by their effect. `keys`: the browser's names, after Shift and Mod (Ctrl or ⌘). */
/** @type {{title: string, keys: Key[]}[]} */
export const SHORTCUTS = [
  {
    title: 'Tools',
    keys: TOOLS.map(({ tool, keys, label }) => ({
      keys: keys.toLowerCase(),
      symbols: [keys],
      description: label,
      act: ({ store }) => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool)),
    })),
  },
  {
    title: 'General',
    keys: [
      {
        keys: 'mod+s',
        symbols: ['Ctrl', 'S'],
        description: 'save look',
        act: (app) => void saveLook(app),
        isOnce: true,
      },
      {
        keys: 'p',
        symbols: ['P'],
        description: 'show or hide panels',
        act: ({ store }) => togglePanels(store),
      },
      {
        keys: 'd',
        symbols: ['D'],
        description: 'mark the lights, and move them',
        act: ({ store, session }) => {
          if (store.value.state?.can_render) session.toggleLamps();
        },
      },
      {
        keys: '?',
        symbols: ['?'],
        description: 'show these shortcuts',
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { keys: '', symbols: ['Tab'], description: 'next control' },
      {
        keys: '',
        symbols: ['← ↑ ↓ →'],
        description: 'move the brush on the pictures; Enter paints',
      },
      { keys: '', symbols: ['Shift', 'Enter'], description: 'there, a line from the last stroke' },
    ],
  },
  {
    title: 'Brush',
    keys: [
      {
        keys: '[',
        symbols: ['['],
        description: 'smaller',
        act: ({ store }) => resizeBrush(store, -1),
      },
      {
        keys: ']',
        symbols: [']'],
        description: 'larger',
        act: ({ store }) => resizeBrush(store, 1),
      },
      {
        keys: '{',
        symbols: ['Shift', '['],
        description: 'softer',
        act: ({ store }) => hardenBrush(store, -1),
      },
      {
        keys: '}',
        symbols: ['Shift', ']'],
        description: 'harder',
        act: ({ store }) => hardenBrush(store, 1),
      },
      { keys: 'digit', symbols: ['1', '…', '9', '0'], description: 'flow 10 % to 100 %' },
      {
        keys: 'x',
        symbols: ['X'],
        description: 'swap colours',
        act: ({ store }) => swapColours(store),
      },
      { keys: '', symbols: ['Alt', 'click'], description: 'pick light from the picture' },
      { keys: '', symbols: ['Shift', 'click'], description: 'line from the last stroke' },
      {
        keys: 'escape',
        symbols: ['Esc'],
        description: 'cancel the stroke',
        act: ({ engine, store }) => {
          const { draft } = store.value.selection;
          if (draft) return updateSelection(store, { draft: null });
          const { maskLayer, panel, clickAction, isLassoing } = store.value;
          const panelChange = engine.cancel() ? {} : { panel: null };
          const isOther = maskLayer !== null || panel || clickAction || isLassoing;
          const selectionChange = isOther || !('panel' in panelChange) ? {} : { selectedLights: [] };
          if (maskLayer !== null) engine.paintMask(null);
          store.set({
            dragAdjustment: null,
            hoveredLight: null,
            clickAction: null,
            isLassoing: false,
            ...panelChange,
            ...selectionChange,
          });
        },
      },
      {
        keys: 'mod+z',
        symbols: ['Ctrl', 'Z'],
        description: 'undo',
        // Undo first cancels the current stroke, which is the last action.
        act: ({ engine, session, store }) => {
          if (engine.cancel()) store.set({ dragAdjustment: null });
          else void session.send('undo');
        },
      },
      {
        keys: 'mod+shift+z',
        symbols: ['Ctrl', 'Shift', 'Z'],
        description: 'redo',
        act: ({ session }) => void session.send('redo'),
      },
    ],
  },
  {
    title: 'Selection',
    keys: [
      {
        keys: 'mod+a',
        symbols: ['Ctrl', 'A'],
        description: 'select all',
        act: ({ engine }) => void engine.selections.select({ kind: 'all' }),
      },
      {
        keys: 'mod+d',
        symbols: ['Ctrl', 'D'],
        description: 'select nothing',
        act: ({ engine }) => engine.selections.change({ kind: 'none' }),
      },
      {
        keys: 'mod+shift+i',
        symbols: ['Ctrl', 'Shift', 'I'],
        description: 'invert the selection',
        act: ({ engine }) => engine.selections.change({ kind: 'invert' }),
      },
      { keys: '', symbols: ['Shift', 'drag'], description: 'add to the selection' },
      { keys: '', symbols: ['Alt', 'drag'], description: 'subtract from it' },
      { keys: '', symbols: ['Shift', 'Alt', 'drag'], description: 'intersect with it' },
    ],
  },
  {
    title: 'Pictures',
    keys: [
      { keys: '', symbols: ['Space', 'drag'], description: 'pan' },
      { keys: '', symbols: ['Ctrl', 'wheel'], description: 'zoom' },
      { keys: '+', symbols: ['+'], description: 'zoom in', act: zoomBy(1.25) },
      { keys: '-', symbols: ['−'], description: 'zoom out', act: zoomBy(0.8) },
      {
        keys: 'f',
        symbols: ['F'],
        description: 'fit to window',
        act: ({ store }) => updateDisplay(store, { zoom: 1, pan: [0, 0] }),
      },
      { keys: 'shift+f', symbols: ['Shift', 'F'], description: '100 %', act: showPixels },
      {
        keys: 'v',
        symbols: ['V'],
        description: 'side by side, wipe, blink',
        act: ({ store }) =>
          updateDisplay(store, { layout: nextValue(LAYOUTS, store.value.display.layout) }),
      },
      {
        keys: 'n',
        symbols: ['N'],
        description: 'next view, if there are several',
        act: showNextView,
      },
      {
        keys: 'k',
        symbols: ['K'],
        description: 'switch the picture in blink',
        act: ({ store }) =>
          updateDisplay(store, {
            layout: 'blink',
            blink: store.value.display.blink === 'left' ? 'right' : 'left',
          }),
      },
      {
        keys: PREVIOUS_KEY,
        symbols: ['Q'],
        description: 'hold: the answer before the last step',
        act: (app) => void showPrevious(app),
        isOnce: true,
      },
      {
        keys: ',',
        symbols: [','],
        description: 'lower display exposure',
        act: changeExposure(-0.5),
      },
      {
        keys: '.',
        symbols: ['.'],
        description: 'raise display exposure',
        act: changeExposure(0.5),
      },
      {
        keys: 'c',
        symbols: ['C'],
        description: 'denoise on or off',
        act: ({ store }) => updateDisplay(store, { clean: !store.value.display.clean }),
      },
      {
        keys: 'o',
        symbols: ['O'],
        description: 'next overlay',
        act: ({ store }) =>
          updateDisplay(store, { overlay: nextValue(OVERLAYS, store.value.display.overlay) }),
      },
    ],
  },
];
