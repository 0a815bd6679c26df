/** The tools, their hints, and changes of their settings. */

import { toHex } from '../../../viewer/drawing/colour.js';
import { exposureOf } from './display_state.js';
import { t } from '../language/language.js';

/** @import { Display, RGB, Tool, Ui, UiStore } from './ui_state.js' */

/** @param {Tool} tool @param {string} label @param {string} tip @param {string} [icon] */
const described = (tool, label, tip, icon = tool) => ({ tool, label, icon, tip });

export const TOOLS = [
  described('brush', t('Brush'), t('Brush: paint light')),
  described(
    'eraser',
    t('Eraser'),
    t('Eraser: remove paint. Unpainted parts stay near their current look.'),
  ),
  described('weight', t('Importance'), t('Importance: where the answer must match best')),
  described('pick', t('Picker'), t('Picker: take paint from a picture')),
  described(
    'neutral',
    t('Neutral'),
    t('Neutral: press what should be white or grey, and the rest follows'),
  ),
  described('fill', t('Fill'), t('Fill: paint a whole object')),
  described('line', t('Line'), t('Line: paint a straight line')),
  described('adjust', t('Adjust'), t('Adjust: drag up for brighter, right for warmer')),
  described(
    'gradient',
    t('Gradient'),
    t('Gradient: light that falls off from one place to another'),
  ),
  described(
    'select',
    t('Select'),
    t('Select: paint and adjust only there. Again for the next shape.'),
    'marquee',
  ),
];

const HINTS = /** @type {Record<Tool, string>} */ ({
  brush: t('Drag on the painting. Shift-click paints a line, Alt-click picks a colour.'),
  eraser: t('Removes paint. Unpainted parts stay near their current look.'),
  weight: t('Paint where the answer must match best. Above 1× an area counts more, below 1× less.'),
  pick: t('Click either picture: the light there becomes the paint.'),
  neutral: t(
    'Click what should be white or grey, in either picture. The whole picture, or what is selected, gets its tint.',
  ),
  fill: t('Click an object to paint all of it.'),
  line: t('Drag from one end of the line to the other.'),
  adjust: t('Drag on a picture: up brighter, down darker, right warmer, left cooler.'),
  gradient: t('Drag from where it begins to where it ends. Its ends can be moved later.'),
  select: t('Drag, or click, on a picture. Shift adds, Alt subtracts, both together intersect.'),
});

/** Hints on touch screens. @type {Partial<Record<Tool, string>>} */
const TOUCH_HINTS = {
  brush: t('Drag on the painting with one finger. Two fingers pan and zoom.'),
  pick: t('Tap either picture: the light there becomes the paint.'),
  fill: t('Tap an object to paint all of it.'),
};

/** Return the hint of a tool. @param {Tool} tool */
export function toolHint(tool) {
  const isTouch = matchMedia('(pointer: coarse)').matches;
  return (isTouch && TOUCH_HINTS[tool]) || HINTS[tool];
}

const PAINT_HINT = {
  title: t('Paint how it should look'),
  text: t(
    'Choose a colour and drag over this picture. The other one shows what the lights can do.',
  ),
};

/** First hint on the painting, for tools other than brushes.
 * @type {Partial<Record<Tool, {title: string, text: string}>>} */
const FIRST_HINTS = {
  weight: { title: t('Mark what matters most'), text: t('Drag over it on this picture.') },
  pick: {
    title: t('Pick light from a picture'),
    text: t('It becomes the paint. Then choose the brush.'),
  },
  neutral: {
    title: t('Press what should be neutral'),
    text: t('The whole picture, or what is selected, gets the tint that takes its colour away.'),
  },
  fill: {
    title: PAINT_HINT.title,
    text: t(
      'Choose a colour, then click an object in this picture. The other one shows what the lights can do.',
    ),
  },
  select: {
    title: t('Select a part of the picture'),
    text: t('Then paint it, fill it or adjust it: everything else stays as it is.'),
  },
  adjust: {
    title: t('Adjust how it should look'),
    text: t('Drag on this picture: up brighter, down darker, right warmer, left cooler.'),
  },
};

/** @param {Tool} tool */
export const firstHint = (tool) => FIRST_HINTS[tool] ?? PAINT_HINT;

export const MIN_BRUSH_SIZE = 2;
export const MAX_BRUSH_SIZE = 1000;

/** Range of the paint's slider, in stops from white. */
const PAINT_MAX_STOPS = 8;

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
 * @param {Ui} ui */
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

/** @param {UiStore} store @param {Partial<Display>} changes */
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
const OVERLAYS = /** @type {const} */ ([
  null,
  'missed',
  'beyond',
  'falsecolor',
  'importance',
  'lux',
]);

/** Return the overlays of the view: lux only where it shows measuring planes.
 * @param {Ui} ui */
export const overlaysOf = ({ planes, view }) =>
  OVERLAYS.filter((overlay) => overlay !== 'lux' || planes?.cameras[view]);
