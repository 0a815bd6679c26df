/** The table of keyboard shortcuts, for the keyboard and for the dialog that lists them. */

import { saveLook } from './look_actions.js';
import { PREVIOUS_KEY, showPrevious } from './previous_answer.js';
import { chooseSelect, updateSelection } from './selection/selection_settings.js';
import { words } from '../language/language.js';
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
    title: words.shortcuts.tools,
    keys: TOOLS.map(({ tool, keys, label }) => ({
      keys: keys.toLowerCase(),
      symbols: [keys],
      description: label,
      act: ({ store }) => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool)),
    })),
  },
  {
    title: words.shortcuts.general,
    keys: [
      {
        keys: 'mod+s',
        symbols: ['Ctrl', 'S'],
        description: words.shortcuts.saveLook,
        act: (app) => void saveLook(app),
        isOnce: true,
      },
      {
        keys: 'p',
        symbols: ['P'],
        description: words.shortcuts.showOrHidePanels,
        act: ({ store }) => togglePanels(store),
      },
      {
        keys: 'd',
        symbols: ['D'],
        description: words.shortcuts.markTheLightsAndMove,
        act: ({ store, session }) => {
          if (store.value.state?.can_render) session.toggleLamps();
        },
      },
      {
        keys: '?',
        symbols: ['?'],
        description: words.shortcuts.showTheseShortcuts,
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { keys: '', symbols: ['Tab'], description: words.shortcuts.nextControl },
      {
        keys: '',
        symbols: ['← ↑ ↓ →'],
        description: words.shortcuts.moveTheBrushOnThe,
      },
      { keys: '', symbols: ['Shift', 'Enter'], description: words.shortcuts.thereALineFromThe },
    ],
  },
  {
    title: words.shortcuts.brush,
    keys: [
      {
        keys: '[',
        symbols: ['['],
        description: words.shortcuts.smaller,
        act: ({ store }) => resizeBrush(store, -1),
      },
      {
        keys: ']',
        symbols: [']'],
        description: words.shortcuts.larger,
        act: ({ store }) => resizeBrush(store, 1),
      },
      {
        keys: '{',
        symbols: ['Shift', '['],
        description: words.shortcuts.softer,
        act: ({ store }) => hardenBrush(store, -1),
      },
      {
        keys: '}',
        symbols: ['Shift', ']'],
        description: words.shortcuts.harder,
        act: ({ store }) => hardenBrush(store, 1),
      },
      { keys: 'digit', symbols: ['1', '…', '9', '0'], description: words.shortcuts.flow10To100 },
      {
        keys: 'x',
        symbols: ['X'],
        description: words.shortcuts.swapColours,
        act: ({ store }) => swapColours(store),
      },
      {
        keys: '',
        symbols: ['Alt', words.shortcuts.click],
        description: words.shortcuts.pickLightFromThePicture,
      },
      {
        keys: '',
        symbols: ['Shift', words.shortcuts.click],
        description: words.shortcuts.lineFromTheLastStroke,
      },
      {
        keys: 'escape',
        symbols: ['Esc'],
        description: words.shortcuts.cancelTheStroke,
        act: ({ engine, store }) => {
          const { draft } = store.value.selection;
          if (draft) return updateSelection(store, { draft: null });
          const { maskLayer, panel, clickAction, isLassoing } = store.value;
          const panelChange = engine.cancel() ? {} : { panel: null };
          const isOther = maskLayer !== null || panel || clickAction || isLassoing;
          const selectionChange =
            isOther || !('panel' in panelChange) ? {} : { selectedLights: [] };
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
        description: words.shortcuts.undo,
        // Undo first cancels the current stroke, which is the last action.
        act: ({ engine, session, store }) => {
          if (engine.cancel()) store.set({ dragAdjustment: null });
          else void session.send('undo');
        },
      },
      {
        keys: 'mod+shift+z',
        symbols: ['Ctrl', 'Shift', 'Z'],
        description: words.shortcuts.redo,
        act: ({ session }) => void session.send('redo'),
      },
    ],
  },
  {
    title: words.shortcuts.selection,
    keys: [
      {
        keys: 'mod+a',
        symbols: ['Ctrl', 'A'],
        description: words.shortcuts.selectAll,
        act: ({ engine }) => void engine.selections.select({ kind: 'all' }),
      },
      {
        keys: 'mod+d',
        symbols: ['Ctrl', 'D'],
        description: words.shortcuts.selectNothing,
        act: ({ engine }) => engine.selections.change({ kind: 'none' }),
      },
      {
        keys: 'mod+shift+i',
        symbols: ['Ctrl', 'Shift', 'I'],
        description: words.shortcuts.invertTheSelection,
        act: ({ engine }) => engine.selections.change({ kind: 'invert' }),
      },
      {
        keys: '',
        symbols: ['Shift', words.shortcuts.drag],
        description: words.shortcuts.addToTheSelection,
      },
      {
        keys: '',
        symbols: ['Alt', words.shortcuts.drag],
        description: words.shortcuts.subtractFromIt,
      },
      {
        keys: '',
        symbols: ['Shift', 'Alt', words.shortcuts.drag],
        description: words.shortcuts.intersectWithIt,
      },
    ],
  },
  {
    title: words.shortcuts.pictures,
    keys: [
      { keys: '', symbols: ['Space', words.shortcuts.drag], description: words.shortcuts.pan },
      { keys: '', symbols: ['Ctrl', words.shortcuts.wheel], description: words.shortcuts.zoom },
      { keys: '+', symbols: ['+'], description: words.shortcuts.zoomIn, act: zoomBy(1.25) },
      { keys: '-', symbols: ['−'], description: words.shortcuts.zoomOut, act: zoomBy(0.8) },
      {
        keys: 'f',
        symbols: ['F'],
        description: words.shortcuts.fitToWindow,
        act: ({ store }) => updateDisplay(store, { zoom: 1, pan: [0, 0] }),
      },
      {
        keys: 'shift+f',
        symbols: ['Shift', 'F'],
        description: words.shortcuts.n100,
        act: showPixels,
      },
      {
        keys: 'v',
        symbols: ['V'],
        description: words.shortcuts.sideBySideWipeBlink,
        act: ({ store }) =>
          updateDisplay(store, { layout: nextValue(LAYOUTS, store.value.display.layout) }),
      },
      {
        keys: 'n',
        symbols: ['N'],
        description: words.shortcuts.nextViewIfThereAre,
        act: showNextView,
      },
      {
        keys: 'k',
        symbols: ['K'],
        description: words.shortcuts.switchThePictureInBlink,
        act: ({ store }) =>
          updateDisplay(store, {
            layout: 'blink',
            blink: store.value.display.blink === 'left' ? 'right' : 'left',
          }),
      },
      {
        keys: PREVIOUS_KEY,
        symbols: ['Q'],
        description: words.shortcuts.holdTheAnswerBeforeThe,
        act: (app) => void showPrevious(app),
        isOnce: true,
      },
      {
        keys: ',',
        symbols: [','],
        description: words.shortcuts.lowerDisplayExposure,
        act: changeExposure(-0.5),
      },
      {
        keys: '.',
        symbols: ['.'],
        description: words.shortcuts.raiseDisplayExposure,
        act: changeExposure(0.5),
      },
      {
        keys: 'c',
        symbols: ['C'],
        description: words.shortcuts.denoiseOnOrOff,
        act: ({ store }) => updateDisplay(store, { clean: !store.value.display.clean }),
      },
      {
        keys: 'o',
        symbols: ['O'],
        description: words.shortcuts.nextOverlay,
        act: ({ store }) =>
          updateDisplay(store, { overlay: nextValue(OVERLAYS, store.value.display.overlay) }),
      },
    ],
  },
];
