/** False colours of the illuminance on a measuring plane, a pixel for each of its cells. */

/** @typedef {import("../../engine/messages.js").MeasuredPlane} MeasuredPlane */

/** Colours from little to much light, those of the pictures in reports: they also differ in lightness,
 * for those who see few colours. */
const COLOURS = [
  [38, 14, 74],
  [59, 60, 138],
  [42, 110, 142],
  [32, 156, 137],
  [98, 200, 98],
  [248, 230, 60],
];

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
