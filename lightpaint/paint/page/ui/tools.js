/** The tools, their hints, and changes of their settings. */

import { toHex } from './paint_colour.js';
import { exposureOf } from './display_state.js';
import { words } from '../language/language.js';

/** @typedef {import("./engine_interface.js").Tool} Tool */
/** @typedef {import("./engine_interface.js").RGB} RGB */
/** @typedef {import("./ui_state.js").UiStore} UiStore */

/** @type {{tool: Tool, label: string, icon: string, tip: string}[]} */
export const TOOLS = [
  {
    tool: 'brush',
    label: words.tools.brush,
    icon: 'brush',
    tip: words.tools.brushPaintLight,
  },
  {
    tool: 'eraser',
    label: words.tools.eraser,
    icon: 'eraser',
    tip: words.tools.eraserRemovePaintUnpaintedParts,
  },
  {
    tool: 'weight',
    label: words.tools.importance,
    icon: 'weight',
    tip: words.tools.importanceWhereTheAnswerMust,
  },
  {
    tool: 'pick',
    label: words.tools.picker,
    icon: 'pick',
    tip: words.tools.pickerTakePaintFromAPicture,
  },
  {
    tool: 'neutral',
    label: words.tools.neutral,
    icon: 'neutral',
    tip: words.tools.neutralPressWhatShould,
  },
  {
    tool: 'fill',
    label: words.tools.fill,
    icon: 'fill',
    tip: words.tools.fillPaintAWholeObject,
  },
  {
    tool: 'line',
    label: words.tools.line,
    icon: 'line',
    tip: words.tools.linePaintAStraightLine,
  },
  {
    tool: 'adjust',
    label: words.tools.adjust,
    icon: 'adjust',
    tip: words.tools.adjustDragUpForBrighterRight,
  },
  {
    tool: 'gradient',
    label: words.tools.gradient,
    icon: 'gradient',
    tip: words.tools.gradientLightThatFallsOffFrom,
  },
  {
    tool: 'select',
    label: words.tools.select,
    icon: 'marquee',
    tip: words.tools.selectPaintAndAdjustOnlyThere,
  },
];

const HINTS = /** @type {Record<Tool, string>} */ ({
  brush: words.tools.dragOnThePaintingShiftClick,
  eraser: words.tools.removesPaintUnpaintedPartsStay,
  weight: words.tools.paintWhereTheAnswerMustMatch,
  pick: words.tools.clickEitherPictureTheLightThere,
  neutral: words.tools.clickWhatShouldHaveNoColour,
  fill: words.tools.clickAnObjectToPaintAll,
  line: words.tools.dragFromOneEndOfThe,
  adjust: words.tools.dragOnAPictureUpBrighter,
  gradient: words.tools.dragFromWhereItBeginsTo,
  select: words.tools.dragOrClickOnAPicture,
});

/** Hints on touch screens. @type {Partial<Record<Tool, string>>} */
const TOUCH_HINTS = {
  brush: words.tools.dragOnThePaintingWithOne,
  pick: words.tools.tapEitherPictureTheLightThere,
  fill: words.tools.tapAnObjectToPaintAll,
};

/** Return the hint of a tool. @param {Tool} tool */
export function toolHint(tool) {
  const isTouch = matchMedia('(pointer: coarse)').matches;
  return (isTouch && TOUCH_HINTS[tool]) || HINTS[tool];
}

const PAINT_HINT = {
  title: words.tools.paintHowItShouldLook,
  text: words.tools.chooseAColourAndDragOver,
};

/** First hint on the painting, for tools other than brushes.
 * @type {Partial<Record<Tool, {title: string, text: string}>>} */
const FIRST_HINTS = {
  weight: { title: words.tools.markWhatMattersMost, text: words.tools.dragOverItOnThisPicture },
  pick: {
    title: words.tools.pickLightFromAPicture,
    text: words.tools.itBecomesThePaintThenChoose,
  },
  neutral: {
    title: words.tools.pressWhatShouldBeNeutral,
    text: words.tools.theWholePictureFollows,
  },
  fill: {
    title: PAINT_HINT.title,
    text: words.tools.chooseAColourThenClickAn,
  },
  select: {
    title: words.tools.selectAPartOfThePicture,
    text: words.tools.thenPaintItFillItOr,
  },
  adjust: {
    title: words.tools.adjustHowItShouldLook,
    text: words.tools.dragOnThisPictureUpBrighter,
  },
};

/** @param {Tool} tool */
export const firstHint = (tool) => FIRST_HINTS[tool] ?? PAINT_HINT;

export const MIN_BRUSH_SIZE = 2;
export const MAX_BRUSH_SIZE = 1000;

/** Range of the paint's slider, in stops from white. */
export const PAINT_MAX_STOPS = 8;

/** Largest number of recent colours. */
const MAX_RECENT = 7;

/** @param {UiStore} store @param {Tool} tool */
export function chooseTool(store, tool) {
  store.set({ tool });
}

/** @param {UiStore} store */
export function swapColours(store) {
  store.set(({ colour, stops, second }) => ({
    colour: second.colour,
    stops: second.stops,
    second: { colour, stops },
  }));
}

/** Use light from a picture as paint. @param {UiStore} store @param {RGB} light */
export function pickPaint(store, light) {
  const exposedLight = light.map((x) => Math.max(0, x) * 2 ** exposureOf(store.value.state));
  const maxChannel = Math.max(...exposedLight);
  if (!(maxChannel > 0)) return store.set({ colour: [0, 0, 0], stops: 0 });
  const stops = Math.min(PAINT_MAX_STOPS, Math.max(-PAINT_MAX_STOPS, Math.log2(maxChannel)));
  // Darker light gives a darker colour instead.
  const scale = Math.max(maxChannel, 2 ** stops);
  store.set({
    colour: /** @type {RGB} */ (exposedLight.map((x) => x / scale)),
    stops: Math.log2(scale),
  });
}

/** @typedef {{colour: RGB, stops: number}} Paint */

/** Remember the paint that was used. @param {UiStore} store */
export function rememberPaint(store) {
  const { colour, stops, recent, tool } = store.value;
  if (!['brush', 'fill', 'line', 'gradient'].includes(tool)) return;
  if (recent.length && isSame({ colour, stops }, recent[0])) return;
  store.set({ recent: distinctPaints([{ colour, stops }, ...recent]) });
}

/** Without duplicates, and limited in number. @param {Paint[]} paints the latest first */
export function distinctPaints(paints) {
  const distinct = paints.filter(
    (paint, k) => !paints.slice(0, k).some((other) => isSame(paint, other)),
  );
  return distinct.slice(0, MAX_RECENT);
}

/** @param {Paint} paint @param {Paint} other */
const isSame = (paint, other) =>
  toHex(paint.colour) === toHex(other.colour) && Math.abs(paint.stops - other.stops) < 0.01;

/** The flow of the current tool: the fill has its own, independent of the brush.
 * @param {import("./ui_state.js").Ui} ui */
export const flowOf = (ui) => (ui.tool === 'fill' ? ui.fillFlow : ui.flow);

/** @param {UiStore} store @param {number} flow */
export function setFlow(store, flow) {
  store.set(store.value.tool === 'fill' ? { fillFlow: flow } : { flow });
}

/** @param {UiStore} store @param {number} sign +1 or −1 */
export function resizeBrush(store, sign) {
  const size = store.value.size * (sign > 0 ? 1.15 : 1 / 1.15);
  store.set({ size: Math.round(Math.min(MAX_BRUSH_SIZE, Math.max(MIN_BRUSH_SIZE, size + sign))) });
}

/** @param {UiStore} store @param {number} sign */
export function hardenBrush(store, sign) {
  const hardness = store.value.hardness + sign * 0.1;
  store.set({ hardness: Math.min(1, Math.max(0, Math.round(hardness * 10) / 10)) });
}

/** @param {UiStore} store @param {Partial<import("./engine_interface.js").Display>} changes */
export function updateDisplay(store, changes) {
  store.set((ui) => ({ display: { ...ui.display, ...changes } }));
}

/** Hide or show the panels. @param {UiStore} store */
export function togglePanels(store) {
  store.set(({ side, panel }) => ({ side: !(side || panel), panel: null }));
}

/** Return the value after another one. @template T @param {readonly T[]} values @param {T} value
 * @returns {T} */
export const nextValue = (values, value) => values[(values.indexOf(value) + 1) % values.length];

export const LAYOUTS = /** @type {const} */ (['side', 'wipe', 'blink', 'inset']);
export const OVERLAYS = /** @type {const} */ ([
  null,
  'missed',
  'beyond',
  'falsecolor',
  'importance',
]);
