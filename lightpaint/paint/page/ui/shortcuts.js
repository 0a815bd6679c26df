/** The table of keyboard shortcuts, for the keyboard and for the dialog that lists them. */

import { saveLook } from './look_actions.js';
import { showOriginal } from './original_scene.js';
import { showPrevious } from './previous_answer.js';
import { swapInset } from './inset_picture.js';
import { chooseSelect, updateSelection } from './selection/selection_settings.js';
import { words } from '../language/language.js';
import { endTour } from './tour.js';
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
/** A command with its key, or something that keys and pointer do and nobody can change.
 * isOnce: ignores repeats of a held key.
 * @typedef {{command: import("./key_bindings.js").Command, description: string,
 *   act: (app: App) => void, isOnce?: boolean}} CommandKey
 * @typedef {{symbols: string[], description: string}} FixedKey */

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

/** What Escape does: it ends what has begun last. @param {App} app */
export function escape({ engine, store }) {
  if (store.value.tour !== null) return endTour(store);
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
}

/** All shortcuts, by their effect. @type {{title: string, keys: (CommandKey | FixedKey)[]}[]} */
export const SHORTCUTS = [
  {
    title: words.shortcuts.tools,
    keys: TOOLS.map(({ tool, label }) => ({
      command: tool,
      description: label,
      act: ({ store }) => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool)),
    })),
  },
  {
    title: words.shortcuts.general,
    keys: [
      {
        command: 'saveLook',
        description: words.shortcuts.saveLook,
        act: (app) => void saveLook(app),
        isOnce: true,
      },
      { symbols: ['Ctrl', 'V'], description: words.shortcuts.pasteAReference },
      {
        command: 'panels',
        description: words.shortcuts.showOrHidePanels,
        act: ({ store }) => togglePanels(store),
      },
      {
        command: 'lights',
        description: words.shortcuts.markTheLightsAndMove,
        act: ({ store, session }) => {
          if (store.value.state?.can_render) session.toggleLamps();
        },
      },
      {
        command: 'shortcuts',
        description: words.shortcuts.showTheseShortcuts,
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { symbols: ['Tab'], description: words.shortcuts.nextControl },
      {
        symbols: ['← ↑ ↓ →'],
        description: words.shortcuts.moveTheBrushOnThe,
      },
      { symbols: ['Shift', 'Enter'], description: words.shortcuts.thereALineFromThe },
    ],
  },
  {
    title: words.shortcuts.brush,
    keys: [
      {
        command: 'smaller',
        description: words.shortcuts.smaller,
        act: ({ store }) => resizeBrush(store, -1),
      },
      {
        command: 'larger',
        description: words.shortcuts.larger,
        act: ({ store }) => resizeBrush(store, 1),
      },
      {
        command: 'softer',
        description: words.shortcuts.softer,
        act: ({ store }) => hardenBrush(store, -1),
      },
      {
        command: 'harder',
        description: words.shortcuts.harder,
        act: ({ store }) => hardenBrush(store, 1),
      },
      { symbols: ['1', '…', '9', '0'], description: words.shortcuts.flow10To100 },
      {
        command: 'swap',
        description: words.shortcuts.swapColours,
        act: ({ store }) => swapColours(store),
      },
      {
        symbols: ['Alt', words.shortcuts.click],
        description: words.shortcuts.pickLightFromThePicture,
      },
      {
        symbols: ['Shift', words.shortcuts.click],
        description: words.shortcuts.lineFromTheLastStroke,
      },
      {
        symbols: ['Esc'],
        description: words.shortcuts.cancelTheStroke,
      },
      {
        command: 'undo',
        description: words.shortcuts.undo,
        // Undo first cancels the current stroke, which is the last action.
        act: ({ engine, session, store }) => {
          if (engine.cancel()) store.set({ dragAdjustment: null });
          else void session.send('undo');
        },
      },
      {
        command: 'redo',
        description: words.shortcuts.redo,
        act: ({ session }) => void session.send('redo'),
      },
    ],
  },
  {
    title: words.shortcuts.selection,
    keys: [
      {
        command: 'selectAll',
        description: words.shortcuts.selectAll,
        act: ({ engine }) => void engine.selections.select({ kind: 'all' }),
      },
      {
        command: 'selectNone',
        description: words.shortcuts.selectNothing,
        act: ({ engine }) => engine.selections.change({ kind: 'none' }),
      },
      {
        command: 'invert',
        description: words.shortcuts.invertTheSelection,
        act: ({ engine }) => engine.selections.change({ kind: 'invert' }),
      },
      {
        symbols: ['Shift', words.shortcuts.drag],
        description: words.shortcuts.addToTheSelection,
      },
      {
        symbols: ['Alt', words.shortcuts.drag],
        description: words.shortcuts.subtractFromIt,
      },
      {
        symbols: ['Shift', 'Alt', words.shortcuts.drag],
        description: words.shortcuts.intersectWithIt,
      },
    ],
  },
  {
    title: words.shortcuts.pictures,
    keys: [
      { symbols: ['Space', words.shortcuts.drag], description: words.shortcuts.pan },
      { symbols: ['Ctrl', words.shortcuts.wheel], description: words.shortcuts.zoom },
      { command: 'zoomIn', description: words.shortcuts.zoomIn, act: zoomBy(1.25) },
      { command: 'zoomOut', description: words.shortcuts.zoomOut, act: zoomBy(0.8) },
      {
        command: 'fit',
        description: words.shortcuts.fitToWindow,
        act: ({ store }) => updateDisplay(store, { zoom: 1, pan: [0, 0] }),
      },
      {
        command: 'pixels',
        description: words.shortcuts.fullSize,
        act: showPixels,
      },
      {
        command: 'layout',
        description: words.shortcuts.sideBySideWipeBlink,
        act: ({ store }) =>
          updateDisplay(store, { layout: nextValue(LAYOUTS, store.value.display.layout) }),
      },
      {
        command: 'nextView',
        description: words.shortcuts.nextViewIfThereAre,
        act: showNextView,
      },
      {
        command: 'blink',
        description: words.shortcuts.switchThePictureInBlink,
        act: ({ store }) => {
          const { layout, blink } = store.value.display;
          if (layout === 'inset') return swapInset(store);
          updateDisplay(store, { layout: 'blink', blink: blink === 'left' ? 'right' : 'left' });
        },
      },
      {
        command: 'previous',
        description: words.shortcuts.holdTheAnswerBeforeThe,
        act: (app) => void showPrevious(app),
        isOnce: true,
      },
      {
        command: 'original',
        description: words.shortcuts.holdTheOriginalScene,
        act: showOriginal,
        isOnce: true,
      },
      {
        command: 'lowerExposure',
        description: words.shortcuts.lowerDisplayExposure,
        act: changeExposure(-0.5),
      },
      {
        command: 'raiseExposure',
        description: words.shortcuts.raiseDisplayExposure,
        act: changeExposure(0.5),
      },
      {
        command: 'denoise',
        description: words.shortcuts.denoiseOnOrOff,
        act: ({ store }) => updateDisplay(store, { clean: !store.value.display.clean }),
      },
      {
        command: 'overlay',
        description: words.shortcuts.nextOverlay,
        act: ({ store }) =>
          updateDisplay(store, { overlay: nextValue(OVERLAYS, store.value.display.overlay) }),
      },
    ],
  },
];
