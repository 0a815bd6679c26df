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

/** @param {CommandKey["command"]} command @param {string} description @param {CommandKey["act"]} act
 * @param {boolean} [isOnce] @returns {CommandKey} */
const key = (command, description, act, isOnce) => ({ command, description, act, isOnce });

/** @param {string} description @param {string[]} symbols @returns {FixedKey} */
const fixed = (description, ...symbols) => ({ symbols, description });

/** All shortcuts, by their effect. @type {{title: string, keys: (CommandKey | FixedKey)[]}[]} */
export const SHORTCUTS = [
  {
    title: t('Tools'),
    keys: TOOLS.map(({ tool, label }) =>
      key(tool, label, ({ store }) =>
        tool === 'select' ? chooseSelect(store) : chooseTool(store, tool),
      ),
    ),
  },
  {
    title: t('General'),
    keys: [
      key('saveLook', t('save look'), (app) => void saveLook(app), true),
      fixed(t('add a copied picture to the references'), 'Ctrl', 'V'),
      key('panels', t('show or hide panels'), ({ store }) => togglePanels(store)),
      key('lights', t('mark the lights, and move them'), ({ store, session }) => {
        if (store.value.state?.can_render) session.toggleLamps();
      }),
      key('shortcuts', t('show these shortcuts'), ({ store }) => store.set({ dialog: 'keys' })),
      fixed(t('next control'), 'Tab'),
      fixed(t('move the brush on the pictures; Enter paints'), '← ↑ ↓ →'),
      fixed(t('there, a line from the last stroke'), 'Shift', 'Enter'),
    ],
  },
  {
    title: t('Brush'),
    keys: [
      key('smaller', t('smaller'), ({ store }) => resizeBrush(store, -1)),
      key('larger', t('larger'), ({ store }) => resizeBrush(store, 1)),
      key('softer', t('softer'), ({ store }) => hardenBrush(store, -1)),
      key('harder', t('harder'), ({ store }) => hardenBrush(store, 1)),
      fixed(t('flow 10 % to 100 %'), '1', '…', '9', '0'),
      key('swap', t('swap colours'), ({ store }) => swapColours(store)),
      fixed(t('pick light from the picture'), 'Alt', t('click')),
      fixed(t('line from the last stroke'), 'Shift', t('click')),
      fixed(t('cancel the stroke, or the drag of a light'), 'Esc'),
      // Undo first cancels the current stroke, which is the last action.
      key('undo', t('undo'), ({ engine, session, store }) => {
        if (engine.cancel()) store.set({ dragAdjustment: null });
        else void session.send('undo');
      }),
      key('redo', t('redo'), ({ session }) => void session.send('redo')),
    ],
  },
  {
    title: t('Selection'),
    keys: [
      key('selectAll', t('select all'), ({ engine }) => {
        void engine.selections.select({ kind: 'all' });
      }),
      key('selectNone', t('select nothing'), ({ engine }) =>
        engine.selections.change({ kind: 'none' }),
      ),
      key('invert', t('invert the selection'), ({ engine }) =>
        engine.selections.change({ kind: 'invert' }),
      ),
      fixed(t('add to the selection'), 'Shift', t('drag')),
      fixed(t('subtract from it'), 'Alt', t('drag')),
      fixed(t('intersect with it'), 'Shift', 'Alt', t('drag')),
    ],
  },
  {
    title: t('Pictures'),
    keys: [
      fixed(t('pan'), 'Space', t('drag')),
      fixed(t('zoom'), 'Ctrl', t('wheel')),
      key('zoomIn', t('zoom in'), zoomBy(1.25)),
      key('zoomOut', t('zoom out'), zoomBy(0.8)),
      key('fit', t('fit to window'), ({ store }) => updateDisplay(store, { zoom: 1, pan: [0, 0] })),
      key('pixels', t('100 %'), showPixels),
      key('layout', t('side by side, wipe, blink, inset'), ({ store }) =>
        updateDisplay(store, { layout: nextValue(LAYOUTS, store.value.display.layout) }),
      ),
      key('nextView', t('next view, if there are several'), showNextView),
      key('blink', t('switch the picture in blink, the large one with an inset'), ({ store }) => {
        const { layout, blink } = store.value.display;
        if (layout === 'inset') return swapInset(store);
        updateDisplay(store, { layout: 'blink', blink: blink === 'left' ? 'right' : 'left' });
      }),
      key(
        'previous',
        t('hold: the answer before the last step'),
        (app) => void showPrevious(app),
        true,
      ),
      key('original', t('hold: the original scene'), showOriginal, true),
      key('lowerExposure', t('lower display exposure'), changeExposure(-0.5)),
      key('raiseExposure', t('raise display exposure'), changeExposure(0.5)),
      key('denoise', t('denoise on or off'), ({ store }) =>
        updateDisplay(store, { clean: !store.value.display.clean }),
      ),
      key('overlay', t('next overlay'), ({ store }) => {
        const overlay = nextValue(overlaysOf(store.value), store.value.display.overlay);
        updateDisplay(store, { overlay });
      }),
    ],
  },
];
