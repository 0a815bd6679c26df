/** The settings of selecting, and what happens to them when something is selected. */

import { t } from '../../language/language.js';

/** @import { Engine, Ui, UiStore } from '../ui_state.js' */
/** @import { Mode } from '../../engine/selection/mask_operations.js' */

/** What a press on the pictures selects.
 * @typedef {"rectangle" | "ellipse" | "lasso" | "object" | "colour"} Shape */
/** What is selected by numbers, and from lists.
 * @typedef {"rectangle" | "ellipse" | "object" | "light" | "brightness"} TypedKind */

/** @typedef {Ui["selection"]} SelectionUi */

/** @param {Shape} shape @param {string} label @param {string} hint @param {string} [icon] */
const shape = (shape, label, hint, icon = shape) => ({ shape, label, icon, hint });

export const SHAPES = [
  shape('rectangle', t('Rectangle'), t('Drag from corner to corner.')),
  shape('ellipse', t('Ellipse'), t('Drag from corner to corner.')),
  shape('lasso', t('Lasso'), t('Drag around what you want.')),
  shape('object', t('Object'), t('Click an object.')),
  shape('colour', t('Colour'), t('Click a colour in a picture.'), 'wand'),
];

/** @param {Mode} value @param {string} label @param {string} tip */
const mode = (value, label, tip) => ({ value, label, icon: `join-${value}`, tip });

export const MODES = [
  mode('replace', t('New'), t('Select only the new part')),
  mode('add', t('Add'), t('Add to the selection (Shift)')),
  mode('subtract', t('Subtract'), t('Take from it (Alt)')),
  mode('intersect', t('Intersect'), t('Keep what is in both (Shift Alt)')),
];

/** @param {UiStore} store @param {Partial<SelectionUi>} changes */
export function updateSelection(store, changes) {
  store.set((ui) => ({ selection: { ...ui.selection, ...changes } }));
}

/** Choose the tool that selects; if it is chosen already, its next shape. @param {UiStore} store */
export function chooseSelect(store) {
  const { tool, selection, state } = store.value;
  const hasObjects = state?.objects?.length > 0;
  const shapes = SHAPES.map(({ shape }) => shape).filter((x) => x !== 'object' || hasObjects);
  const next = shapes[(shapes.indexOf(selection.shape) + 1) % shapes.length];
  if (tool === 'select') updateSelection(store, { shape: next });
  else store.set({ tool: 'select' });
}

/** Take what the engine has selected. Adjustments apply to it until nothing is selected any more.
 * @param {Engine} engine @param {Ui} ui @returns {Partial<Ui>} */
export function selectionUpdate(engine, ui) {
  const { selection, adjustedArea } = ui;
  const current = engine.selections.summary();
  const isNew = current !== null && selection.current === null;
  const isLost = current === null && adjustedArea === 'selection';
  return {
    selection: {
      ...selection,
      current,
      areaBefore: isNew && adjustedArea !== 'selection' ? adjustedArea : selection.areaBefore,
    },
    ...(isNew ? { adjustedArea: 'selection' } : {}),
    ...(isLost ? { adjustedArea: selection.areaBefore } : {}),
  };
}

/** Return how a part joins the selection, with Shift and Alt as in other paint programs.
 * @param {{shiftKey: boolean, altKey: boolean}} event @param {Mode} mode @returns {Mode} */
export function modeOf({ shiftKey, altKey }, mode) {
  if (shiftKey && altKey) return 'intersect';
  if (shiftKey) return 'add';
  return altKey ? 'subtract' : mode;
}

/** Return how much is selected, in words. @param {SelectionUi} selection */
export function selectedText({ current }) {
  if (!current) return t('Nothing is selected: paint goes everywhere.');
  const percent = 100 * current.share;
  const share = percent < 0.1 ? t('Less than 0.1') : percent.toFixed(percent < 10 ? 1 : 0);
  return t('{share} % of the picture is selected.', { share });
}
