/**
 * Gradients as layers: light, or an adjustment, that falls off from one place of a picture to
 * another; the twin of what paint/layers/composition.py does with them, to the bit.
 */
import { VALUES } from '../../../../viewer/drawing/half_floats.js';
import { t } from '../../language/language.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { Gradient, Layer, RGB } from '../messages.js' */
/** @import { ShownLayer } from './layer_composition.js' */
/** @import { Tile } from './layer_pixels.js' */

/** The gradient that a drag makes. isAdjusting: whether it adjusts by `gain` and `tint`, instead of
 * painting. hasEnd: whether it leads to another colour, instead of fading out.
 * @typedef {{shape: Gradient["shape"], isAdjusting: boolean, hasEnd: boolean, gain: number,
 *   tint: RGB, endRgb: RGB}} GradientSettings */

const round = Math.fround;

/** Square of the shortest gradient, in pixels; a shorter one has not begun to fall off. */
const MIN_GRADIENT = 1e-6;

/** Return the properties of a gradient's layer that begins at a place.
 * @param {import("../stroke.js").ToolSettings} tool @param {{x: number, y: number}} place
 * @returns {Partial<Layer>} */
export function gradientLayer({ gradient, rgb, paintMode }, { x, y }) {
  const { shape = 'linear', isAdjusting = false, hasEnd = false, endRgb } = gradient ?? {};
  const { gain = 1, tint = [1, 1, 1] } = gradient ?? {};
  return {
    name: t('Gradient'),
    ...(isAdjusting ? { gain, tint } : {}),
    gradient: {
      shape,
      start: [x, y],
      end: [x, y],
      light: isAdjusting ? null : rgb,
      end_light: isAdjusting || !hasEnd ? null : (endRgb ?? rgb),
      is_incident: !isAdjusting && paintMode === 'light',
    },
  };
}

/** Return a gradient as a layer of paint, or as an adjustment; others as they are.
 * @param {ShownLayer} layer @returns {ShownLayer} */
export function effectOf(layer) {
  if (!layer.gradient) return layer;
  return { ...layer, kind: layer.gradient.light ? 'paint' : 'adjust' };
}

/** Return colour and coverage of a gradient within its mask. @param {Gradient} gradient
 * @param {Tile} mask @param {Region} region @param {Uint16Array | null} albedo (h, w, 3) halves
 * @param {number} width of the picture @returns {Tile} */
export function gradientTile(gradient, { coverage: mask }, region, albedo, width) {
  const [top, bottom, left, right] = region;
  const { light, end_light: endLight, is_incident: isIncident } = gradient;
  const place = rampOf(gradient);
  const coverage = mask.slice();
  const image = light ? new Float32Array(3 * mask.length) : null;
  const first = (light ?? []).map(round);
  const change = first.map((x, c) => round(round((endLight ?? light ?? [])[c]) - x));
  const surface = isIncident ? albedo : null;
  for (let y = top, p = 0; y < bottom; y++)
    for (let x = left; x < right; x++, p++) {
      if (!mask[p]) continue;
      const share = place(x, y);
      if (!endLight) coverage[p] = mask[p] * round(1 - share);
      if (!image) continue;
      const i = 3 * (y * width + x);
      let isLit = !surface;
      for (let c = 0; c < 3; c++) {
        const value = round(first[c] + round(share * change[c]));
        const part = surface ? VALUES[surface[i + c]] : 1;
        image[3 * p + c] = value * part;
        if (part) isLit = true;
      }
      // Surfaces without diffuse reflection ignore light.
      if (!isLit) coverage[p] = 0;
    }
  return { image, coverage };
}

/** Return what gives 0 at the start of a gradient to 1 at its end, smoothly.
 * @param {Gradient} gradient @returns {(x: number, y: number) => number} at a pixel */
function rampOf({ shape, start, end }) {
  const [dx, dy] = [end[0] - start[0], end[1] - start[1]];
  const square = dx * dx + dy * dy;
  if (square < MIN_GRADIENT) return () => 0;
  const [x0, y0, wide, high] = [start[0], start[1], dx, dy].map(round);
  const scale = round(1 / (shape === 'linear' ? square : Math.sqrt(square)));
  return (x, y) => {
    const [across, down] = [round(x + 0.5 - x0), round(y + 0.5 - y0)];
    const along =
      shape === 'linear'
        ? round(round(across * wide) + round(down * high))
        : round(Math.sqrt(round(round(across * across) + round(down * down))));
    const place = Math.min(1, Math.max(0, round(along * scale)));
    return round(round(place * place) * round(3 - round(2 * place)));
  };
}
