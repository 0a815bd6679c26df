/** The table of keyboard shortcuts, for the keyboard and for the dialog that lists them. */

import { saveLook } from './look_actions.js';
import { showOriginal, showPrevious } from './held_pictures.js';
import { swapInset } from './inset_picture.js';
import { chooseSelect, updateSelection } from './selection/selection_settings.js';
import { t } from '../language/language.js';
import { endTour } from './tour.js';
import { showNextView } from './view_tabs.js';
import {
  chooseTool,
  togglePanels,
  hardenBrush,
  LAYOUTS,
  updateDisplay,
  nextValue,
  overlaysOf,
  resizeBrush,
  swapColours,
  TOOLS,
} from './tools.js';

/** @import { App } from './ui_state.js' */

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
    title: t('Tools'),
    keys: TOOLS.map(({ tool, label }) => ({
      command: tool,
      description: label,
      act: ({ store }) => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool)),
    })),
  },
  {
    title: t('General'),
    keys: [
      {
        command: 'saveLook',
        description: t('save look'),
        act: (app) => void saveLook(app),
        isOnce: true,
      },
      { symbols: ['Ctrl', 'V'], description: t('add a copied picture to the references') },
      {
        command: 'panels',
        description: t('show or hide panels'),
        act: ({ store }) => togglePanels(store),
      },
      {
        command: 'lights',
        description: t('mark the lights, and move them'),
        act: ({ store, session }) => {
          if (store.value.state?.can_render) session.toggleLamps();
        },
      },
      {
        command: 'shortcuts',
        description: t('show these shortcuts'),
        act: ({ store }) => store.set({ dialog: 'keys' }),
      },
      { symbols: ['Tab'], description: t('next control') },
      {
        symbols: ['← ↑ ↓ →'],
        description: t('move the brush on the pictures; Enter paints'),
      },
      { symbols: ['Shift', 'Enter'], description: t('there, a line from the last stroke') },
    ],
  },
  {
    title: t('Brush'),
    keys: [
      { command: 'smaller', description: t('smaller'), act: ({ store }) => resizeBrush(store, -1) },
      { command: 'larger', description: t('larger'), act: ({ store }) => resizeBrush(store, 1) },
      { command: 'softer', description: t('softer'), act: ({ store }) => hardenBrush(store, -1) },
      { command: 'harder', description: t('harder'), act: ({ store }) => hardenBrush(store, 1) },
      { symbols: ['1', '…', '9', '0'], description: t('flow 10 % to 100 %') },
      { command: 'swap', description: t('swap colours'), act: ({ store }) => swapColours(store) },
      { symbols: ['Alt', t('click')], description: t('pick light from the picture') },
      { symbols: ['Shift', t('click')], description: t('line from the last stroke') },
      { symbols: ['Esc'], description: t('cancel the stroke, or the drag of a light') },
      {
        command: 'undo',
        description: t('undo'),
        // Undo first cancels the current stroke, which is the last action.
        act: ({ engine, session, store }) => {
          if (engine.cancel()) store.set({ dragAdjustment: null });
          else void session.send('undo');
        },
      },
      { command: 'redo', description: t('redo'), act: ({ session }) => void session.send('redo') },
    ],
  },
  {
    title: t('Selection'),
    keys: [
      {
        command: 'selectAll',
        description: t('select all'),
        act: ({ engine }) => void engine.selections.select({ kind: 'all' }),
      },
      {
        command: 'selectNone',
        description: t('select nothing'),
        act: ({ engine }) => engine.selections.change({ kind: 'none' }),
      },
      {
        command: 'invert',
        description: t('invert the selection'),
        act: ({ engine }) => engine.selections.change({ kind: 'invert' }),
      },
      { symbols: ['Shift', t('drag')], description: t('add to the selection') },
      { symbols: ['Alt', t('drag')], description: t('subtract from it') },
      { symbols: ['Shift', 'Alt', t('drag')], description: t('intersect with it') },
    ],
  },
  {
    title: t('Pictures'),
    keys: [
      { symbols: ['Space', t('drag')], description: t('pan') },
      { symbols: ['Ctrl', t('wheel')], description: t('zoom') },
      { command: 'zoomIn', description: t('zoom in'), act: zoomBy(1.25) },
      { command: 'zoomOut', description: t('zoom out'), act: zoomBy(0.8) },
      {
        command: 'fit',
        description: t('fit to window'),
        act: ({ store }) => updateDisplay(store, { zoom: 1, pan: [0, 0] }),
      },
      { command: 'pixels', description: t('100 %'), act: showPixels },
      {
        command: 'layout',
        description: t('side by side, wipe, blink, inset'),
        act: ({ store }) =>
          updateDisplay(store, { layout: nextValue(LAYOUTS, store.value.display.layout) }),
      },
      { command: 'nextView', description: t('next view, if there are several'), act: showNextView },
      {
        command: 'blink',
        description: t('switch the picture in blink, the large one with an inset'),
        act: ({ store }) => {
          const { layout, blink } = store.value.display;
          if (layout === 'inset') return swapInset(store);
          updateDisplay(store, { layout: 'blink', blink: blink === 'left' ? 'right' : 'left' });
        },
      },
      {
        command: 'previous',
        description: t('hold: the answer before the last step'),
        act: (app) => void showPrevious(app),
        isOnce: true,
      },
      {
        command: 'original',
        description: t('hold: the original scene'),
        act: showOriginal,
        isOnce: true,
      },
      {
        command: 'lowerExposure',
        description: t('lower display exposure'),
        act: changeExposure(-0.5),
      },
      {
        command: 'raiseExposure',
        description: t('raise display exposure'),
        act: changeExposure(0.5),
      },
      {
        command: 'denoise',
        description: t('denoise on or off'),
        act: ({ store }) => updateDisplay(store, { clean: !store.value.display.clean }),
      },
      {
        command: 'overlay',
        description: t('next overlay'),
        act: ({ store }) =>
          updateDisplay(store, {
            overlay: nextValue(overlaysOf(store.value), store.value.display.overlay),
          }),
      },
    ],
  },
];
