/** A stroke of a tool on the canvas, from its first point to its last. */

import { Path, fill, flood, stamp } from './brush.js';
import { LayerCanvas } from './layers/layer_canvas.js';
import { warmer, luminance } from '../../../viewer/drawing/colour.js';
import { t } from '../language/language.js';
import { VALUES } from '../../../viewer/drawing/half_floats.js';

/** @import { Point } from './brush.js' */
/** @import { Effect } from './stroke_effects.js' */
/** @import { PaintCanvas } from './paint_canvas.js' */
/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { RGB } from '../../../viewer/drawing/colour.js' */

/** @typedef {'brush' | 'eraser' | 'weight' | 'pick' | 'fill' | 'line' | 'adjust' | 'select' | 'gradient' | 'neutral'} Tool */

/**
 * rgb: linear light of the paint. size: diameter in pixels of the picture. importance: factor of
 * the importance brush. adjustedArea: whether a drag adjusts, or a click fills, a soft spot of that size (the default), the
 * object under it, or all that is selected.
 * @typedef {{tool: Tool, rgb: RGB, paintMode: 'light' | 'colour', size: number, hardness: number,
 *   flow: number, importance: number, gradient?: import("./layers/gradient.js").GradientSettings, adjustedArea?: 'spot' | 'object' | 'selection'}} ToolSettings */

/** Screen pixels of a drag per stop and per mired. */
const DRAG_PIXELS = { stop: 80, mired: 1 };

/** Largest change of a drag, in stops. */
const MAX_STOPS = 8;

/** @type {ToolSettings} */
export const DEFAULT_TOOL = {
  tool: 'brush',
  rgb: [1, 1, 1],
  paintMode: 'colour',
  size: 60,
  hardness: 0.5,
  flow: 1,
  importance: 1,
};

/** Name of a stroke in the undo history. @type {Record<Tool, string>} */
export const LABELS = {
  neutral: t('neutral'),
  brush: t('brush'),
  eraser: t('eraser'),
  weight: t('importance'),
  pick: t('pick'),
  fill: t('fill'),
  line: t('line'),
  adjust: t('adjust'),
  select: t('select'),
  gradient: t('gradient'),
};

/** Pixels of the picture below which a gradient is a click. */
const MIN_GRADIENT_LENGTH = 2;

/** Return the effect that changes brightness and warmth. @param {number} stops
 * @param {number} mired
 * @returns {Effect} */
function adjustEffect(stops, mired) {
  return { kind: 'adjust', gain: 2 ** stops, tint: warmer(mired) };
}

/** One stroke. Its methods return the changed regions. */
export class Stroke {
  /** @param {PaintCanvas} canvas @param {ToolSettings} settings @param {Point} point where it begins
   * @param {number} scale pixels of the screen for each of the picture */
  constructor(canvas, settings, point, scale) {
    this.canvas = canvas;
    this.settings = settings;
    this.start = point;
    this.scale = scale;
    canvas.begin();
    this.effect = effectOf(canvas, settings);
    this.path = new Path(canvas, settings);
    /** Length of a gradient. */
    this.length = 0;
    /** The change that the drag asks for. */
    this.adjustment = { stops: 0, mired: 0 };
  }

  /** @returns {Region[]} */
  begin() {
    const { canvas, settings, start } = this;
    const isSelection = settings.adjustedArea === 'selection' && canvas.selection !== null;
    if (settings.tool === 'fill' && isSelection) return this.apply([flood(canvas, settings.flow)]);
    if (settings.tool === 'fill') {
      const object = canvas.objectAt(start.x, start.y);
      return this.apply([fill(canvas, object, settings.flow)]);
    }
    if (settings.tool === 'gradient') return this.apply([flood(canvas)]);
    if (settings.tool !== 'adjust') return this.apply(this.path.moveTo(start));
    const object = canvas.objectAt(start.x, start.y);
    if (isSelection) flood(canvas);
    else if (settings.adjustedArea === 'object' && object >= 0) fill(canvas, object, 1);
    else
      stamp(canvas, { ...start, pressure: 1 }, { size: 2 * settings.size, hardness: 0, flow: 1 });
    return [];
  }

  /** @param {Point[]} points @returns {Region[]} */
  move(points) {
    const { tool } = this.settings;
    const last = points.at(-1);
    if (!last || tool === 'fill') return [];
    if (tool === 'adjust') return this.adjust(last);
    if (tool === 'line') return this.line(last);
    if (tool === 'gradient') return this.pullTo(last);
    return this.apply(points.flatMap((point) => this.path.moveTo(point)));
  }

  /** Move the end of a gradient. @param {Point} end @returns {Region[]} */
  pullTo({ x, y }) {
    const { canvas } = this;
    this.length = Math.hypot(x - this.start.x, y - this.start.y);
    if (canvas instanceof LayerCanvas && canvas.layer.gradient)
      canvas.layer = { ...canvas.layer, gradient: { ...canvas.layer.gradient, end: [x, y] } };
    return canvas.region ? [canvas.region] : [];
  }

  /** Whether nothing has come of it: a drag that adjusts nothing, or a click of a gradient. */
  get isVoid() {
    const { tool } = this.settings;
    if (tool === 'gradient') return this.length < MIN_GRADIENT_LENGTH;
    return tool === 'adjust' && !this.adjustment.stops && !this.adjustment.mired;
  }

  /** Draw a straight line from the start. @param {Point} end @returns {Region[]} */
  line(end) {
    const { canvas, settings, start } = this;
    const oldRegion = canvas.uncover();
    canvas.region = null;
    const path = new Path(canvas, settings);
    // The last stamp is at the end of the line.
    const length = Math.hypot(end.x - start.x, end.y - start.y);
    path.step = length / Math.max(1, Math.ceil(length / path.step)) || path.step;
    const endRegions = [start, end].map((point) => path.moveTo({ ...point, pressure: 1 }));
    const regions = endRegions.flat();
    return [...(oldRegion ? [oldRegion] : []), ...this.apply(regions)];
  }

  /** @param {Point} point @returns {Region[]} */
  adjust(point) {
    const { start, scale, canvas } = this;
    const stops = ((start.y - point.y) * scale) / DRAG_PIXELS.stop;
    const mired = ((point.x - start.x) * scale) / DRAG_PIXELS.mired;
    this.adjustment = { stops: Math.min(MAX_STOPS, Math.max(-MAX_STOPS, stops)), mired };
    this.effect = adjustEffect(this.adjustment.stops, mired);
    return this.apply(canvas.region ? [canvas.region] : []);
  }

  /** @param {Region[]} regions @returns {Region[]} */
  apply(regions) {
    for (const region of mergeRegions(regions)) this.canvas.apply(region, this.effect);
    return regions;
  }
}

/** Give everything a tint at the same luminance, as one stroke. @param {PaintCanvas} canvas
 * @param {RGB} tint @returns {Region} */
export function tintArea(canvas, tint) {
  canvas.begin();
  const region = flood(canvas);
  canvas.apply(region, { kind: 'adjust', gain: 1, tint });
  return region;
}

/** Make an object, or for null everything, brighter and warmer, as one stroke.
 * @param {PaintCanvas} canvas @param {{stops: number, mired: number, object: number | null}} adjustment
 * @returns {Region} */
export function adjustArea(canvas, { stops, mired, object }) {
  canvas.begin();
  const region = object === null ? flood(canvas) : fill(canvas, object, 1);
  canvas.apply(region, adjustEffect(stops, mired));
  return region;
}

/** @param {PaintCanvas} canvas @param {ToolSettings} settings @returns {Effect} */
function effectOf(canvas, settings) {
  if (settings.tool === 'eraser') return { kind: 'erase', ground: wholeAdjustment(canvas) };
  if (settings.tool === 'weight') return { kind: 'weigh', factor: settings.importance };
  if (settings.tool === 'adjust') return adjustEffect(0, 0);
  // Of a mask.
  if (settings.tool === 'gradient') return { kind: 'weigh', factor: 1 };
  return { kind: 'paint', rgb: settings.rgb, paintMode: settings.paintMode };
}

/** Merge regions into a few that do not contain each other: stamps overlap, and shared pixels would
 * be computed several times. @param {Region[]} regions @returns {Region[]} */
function mergeRegions(regions) {
  /** @type {Region[]} */
  const mergedRegions = [];
  for (const region of regions) {
    const last = mergedRegions.at(-1);
    const isNear =
      last &&
      region[0] < last[1] &&
      last[0] < region[1] &&
      region[2] < last[3] &&
      last[2] < region[3];
    if (
      last &&
      isNear &&
      mergedRegions.length > 0 &&
      area(enclose(last, region)) < 2 * area(last) + area(region)
    )
      mergedRegions[mergedRegions.length - 1] = enclose(last, region);
    else mergedRegions.push(region);
  }
  return mergedRegions;
}

/** @param {Region} a @param {Region} b @returns {Region} */
function enclose(a, b) {
  return [Math.min(a[0], b[0]), Math.max(a[1], b[1]), Math.min(a[2], b[2]), Math.max(a[3], b[3])];
}

/** @param {Region} region */
function area([top, bottom, left, right]) {
  return (bottom - top) * (right - left);
}

/** Factors on luminance (`gain`) and colour (`tint`).
 * @typedef {{gain: number, tint: RGB}} WholeAdjustment */

/** Number of sampled pixels, and the smallest number that suffices. */
const MAX_SAMPLES = 4096;
const MIN_SAMPLES = 32;

/** Largest deviation from the median, in stops, of half of them. */
const MAX_DEVIATION_STOPS = 0.1;

/** Smallest luminance with a meaningful ratio, relative to the picture's mean. */
const MIN_RELATIVE_LUMINANCE = 0.01;

/** Return the adjustment under the strokes of a fully painted picture, or null if it is not uniform.
 * @param {PaintCanvas} canvas @returns {WholeAdjustment | null} */
function wholeAdjustment({ isFullyPainted, importance, image, present }) {
  if (!isFullyPainted) return null;
  /** Luminance, and red and blue over green, in stops. @type {[number[], number[], number[]]} */
  const ratios = [[], [], []];
  const step = Math.max(1, Math.floor(importance.length / MAX_SAMPLES));
  const valueAt = (/** @type {number} */ p, /** @type {boolean} */ isPresent) =>
    [0, 1, 2].map((c) => (isPresent ? VALUES[present[3 * p + c]] : image[3 * p + c]));
  let sum = 0;
  for (let p = 0; p < importance.length; p += step) sum += luminance(valueAt(p, true));
  const minLuminance = (MIN_RELATIVE_LUMINANCE * sum * step) / importance.length;
  for (let p = 0; p < importance.length; p += step) {
    const [presentLight, paintedLight] = [valueAt(p, true), valueAt(p, false)];
    const isGround = importance[p] <= 1 && luminance(presentLight) > minLuminance;
    if (!isGround || Math.min(...presentLight, ...paintedLight) <= 0) continue;
    ratios[0].push(Math.log2(luminance(paintedLight) / luminance(presentLight)));
    ratios[1].push(
      Math.log2((paintedLight[0] * presentLight[1]) / (presentLight[0] * paintedLight[1])),
    );
    ratios[2].push(
      Math.log2((paintedLight[2] * presentLight[1]) / (presentLight[2] * paintedLight[1])),
    );
  }
  if (ratios[0].length < MIN_SAMPLES) return null;
  const [gain, red, blue] = ratios.map(median);
  const isSame = [gain, red, blue].every(
    (middle, i) => median(ratios[i].map((x) => Math.abs(x - middle))) <= MAX_DEVIATION_STOPS,
  );
  return isSame ? { gain: 2 ** gain, tint: [2 ** red, 1, 2 ** blue] } : null;
}

/** @param {number[]} values */
const median = (values) => [...values].sort((a, b) => a - b)[Math.floor(values.length / 2)];
