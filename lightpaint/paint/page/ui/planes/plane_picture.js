/** False colours of illuminance, and the picture of a measuring plane, a pixel for each of its cells. */

import { numberText } from '../format.js';
import { t } from '../../language/language.js';

/** @import { MeasuredPlane, PlanesInfo, PlanesReading } from '../../engine/messages.js' */

/** Colours from little to much light, as in the pictures of reports: they also differ in lightness,
 * for those who see few colours. */
const COLOURS = [
  [38, 14, 74],
  [59, 60, 138],
  [42, 110, 142],
  [32, 156, 137],
  [98, 200, 98],
  [248, 230, 60],
];

/** The colours of the scale, for a style sheet. */
export const SCALE_GRADIENT = `linear-gradient(to right, ${COLOURS.map((rgb) => `rgb(${rgb.join(' ')})`).join(', ')})`;

/** Number of levels of the scale. */
const STEPS = 10;

/** @param {number} lux */
export const luxText = (lux) => t('{value} lx', { value: numberText(Number(lux.toPrecision(3))) });

/** Return the illuminance of the brightest colour: of the planes in a case, rounded up as in the
 * isolux pictures of reports. @param {PlanesInfo} info
 * @param {PlanesReading} reading @param {string} shownCase */
export function scaleTop(info, reading, shownCase) {
  const inCase = reading.planes.filter((_, k) => info.planes[k].case === shownCase);
  return roundedUp(Math.max(0, ...inCase.map(({ most }) => most)));
}

/** Return lx, rounded up to one of about ten steps of 1, 2 or 5 times a power of ten.
 * @param {number} most */
export function roundedUp(most) {
  if (!(most > 0)) return 1;
  const raw = most / STEPS;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5].find((k) => raw <= power * k * (1 + 1e-9)) ?? 10);
  return step * Math.ceil(most / step - 1e-9);
}

/** Return the colour of a share of the scale, 0 to 1. @param {number} share @returns {number[]} */
export function colourOf(share) {
  const place = Math.min(Math.max(share, 0), 1) * (COLOURS.length - 1);
  const low = Math.min(Math.floor(place), COLOURS.length - 2);
  return COLOURS[low].map((value, k) =>
    Math.round(value + (place - low) * (COLOURS[low + 1][k] - value)),
  );
}

/** Draw the illuminance on a plane; cells without a point stay empty. The first row is at the bottom.
 * @param {HTMLCanvasElement} canvas @param {MeasuredPlane} plane @param {number[]} lux at its points
 * @param {number} most lx of the brightest colour */
export function drawPlane(canvas, { size: [rows, columns], cells }, lux, most) {
  const image = new ImageData(columns, rows);
  cells.forEach(([row, column], k) => {
    const at = 4 * ((rows - 1 - row) * columns + column);
    image.data.set([...colourOf(most > 0 ? lux[k] / most : 0), 255], at);
  });
  canvas.width = columns;
  canvas.height = rows;
  canvas.getContext('2d')?.putImageData(image, 0, 0);
}
