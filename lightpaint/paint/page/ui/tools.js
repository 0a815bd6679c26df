/** The tools, and what a person does with them that is no stroke: colours, sizes, looks of it. */

import { toHex } from './colours.js';
import { exposureOf } from './model.js';

/** @typedef {import("./engine.js").Tool} Tool */
/** @typedef {import("./engine.js").RGB} RGB */
/** @typedef {import("./model.js").UiStore} UiStore */

/** @type {{tool: Tool, label: string, icon: string, keys: string, tip: string}[]} */
export const TOOLS = [
  { tool: 'brush', label: 'Brush', icon: 'brush', keys: 'B', tip: 'Brush: paint light' },
  {
    tool: 'eraser',
    label: 'Eraser',
    icon: 'eraser',
    keys: 'E',
    tip: 'Eraser: take paint away; what is not painted stays near the present look',
  },
  {
    tool: 'weight',
    label: 'Importance',
    icon: 'weight',
    keys: 'W',
    tip: 'Importance: where the answer has to fit best',
  },
  {
    tool: 'pick',
    label: 'Picker',
    icon: 'pick',
    keys: 'I',
    tip: 'Picker: take light from a picture',
  },
  { tool: 'fill', label: 'Fill', icon: 'fill', keys: 'G', tip: 'Fill: one object' },
  { tool: 'line', label: 'Line', icon: 'line', keys: 'L', tip: 'Straight line' },
  {
    tool: 'ask',
    label: 'Ask',
    icon: 'ask',
    keys: 'A',
    tip: 'Ask by dragging: up is brighter, right is warmer',
  },
];

export const HINTS = /** @type {Record<Tool, string>} */ ({
  brush: 'Drag on the painting. Shift-click draws a line, Alt-click takes a colour.',
  eraser: 'Erased places are free again, and held near the present look.',
  weight: 'Paint where it matters most. At 0 a place does not count.',
  pick: 'Click on either picture: the light there becomes the paint.',
  fill: 'Click on an object to paint all of it.',
  line: 'Drag from one end of the line to the other.',
  ask: 'Drag on a place: up brighter, down darker, right warmer, left cooler.',
});

export const LEAST_SIZE = 2;
export const MOST_SIZE = 1000;

/** @param {UiStore} store @param {Tool} tool */
export function choose(store, tool) {
  // Who asks by a drag may want to do it in numbers.
  store.set(({ open }) => ({ tool, open: tool === 'ask' ? { ...open, ask: true } : open }));
}

/** @param {UiStore} store */
export function swap(store) {
  store.set(({ colour, stops, second }) => ({
    colour: second.colour,
    stops: second.stops,
    second: { colour, stops },
  }));
}

/** Take light from a picture as paint. @param {UiStore} store @param {RGB} light */
export function take(store, light) {
  const shown = light.map((x) => Math.max(0, x) * 2 ** exposureOf(store.value.state));
  const top = Math.max(...shown);
  if (!(top > 0)) return store.set({ colour: [0, 0, 0], stops: 0 });
  const scale = Math.max(1, top);
  store.set({
    colour: /** @type {RGB} */ (shown.map((x) => x / scale)),
    stops: Math.log2(scale),
  });
}

/** Remember what was painted with. @param {UiStore} store */
export function remember(store) {
  const { colour, stops, recent, tool } = store.value;
  if (!['brush', 'fill', 'line'].includes(tool)) return;
  const same = (/** @type {{colour: RGB, stops: number}} */ one) =>
    toHex(one.colour) === toHex(colour) && Math.abs(one.stops - stops) < 0.01;
  if (recent.length && same(recent[0])) return;
  store.set({ recent: [{ colour, stops }, ...recent.filter((one) => !same(one))].slice(0, 7) });
}

/** @param {UiStore} store @param {number} way +1 or −1 */
export function resize(store, way) {
  const size = store.value.size * (way > 0 ? 1.15 : 1 / 1.15);
  store.set({ size: Math.round(Math.min(MOST_SIZE, Math.max(LEAST_SIZE, size + way))) });
}

/** @param {UiStore} store @param {number} way */
export function harden(store, way) {
  const hardness = store.value.hardness + way * 0.1;
  store.set({ hardness: Math.min(1, Math.max(0, Math.round(hardness * 10) / 10)) });
}

/** @param {UiStore} store @param {Partial<import("./engine.js").Show>} changes */
export function look(store, changes) {
  store.set((ui) => ({ show: { ...ui.show, ...changes } }));
}

/** The next of some values. @template T @param {readonly T[]} values @param {T} now @returns {T} */
export const next = (values, now) => values[(values.indexOf(now) + 1) % values.length];

export const LAYOUTS = /** @type {const} */ (['side', 'wipe', 'blink']);
export const OVERLAYS = /** @type {const} */ ([
  null,
  'missed',
  'beyond',
  'falsecolor',
  'importance',
]);
