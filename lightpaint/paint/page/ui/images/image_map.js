/** The picture of an image, a pixel for each texel, as it is lit now. */

import { encode } from '../../../../viewer/drawing/colour.js';
import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';

/** @import { RGB } from '../ui_state.js' */
/** @import { LightImage } from './light_images.js' */

/** Draw an image on a canvas; texels that are not lights stay transparent.
 * @param {HTMLCanvasElement} canvas @param {LightImage} image @param {RGB[]} weights
 * @param {number} stops exposure */
export function drawMap(canvas, { places, lights }, weights, stops) {
  const [height, width] = [places.length, places[0].length];
  if (canvas.width !== width) canvas.width = width;
  if (canvas.height !== height) canvas.height = height;
  const pixels = new ImageData(width, height);
  const gain = 2 ** stops;
  const colourOf = (/** @type {RGB} */ rgb) => {
    // What is too bright keeps its hue, by which it is recognised where it was painted.
    const shown = Math.min(gain, 1 / Math.max(...rgb, 1e-30));
    return [...rgb.map((value) => 255 * encode(shown * value)), 255];
  };
  // Each light once: where some texels are finer, the others have many places.
  const colours = new Map(lights.map((k) => [k, colourOf(weights[k] ?? [0, 0, 0])]));
  let at = 0;
  for (const row of places)
    for (const k of row) {
      const colour = colours.get(k);
      if (colour) pixels.data.set(colour, at);
      at += 4;
    }
  canvas.getContext('2d')?.putImageData(pixels, 0, 0);
}

/** The picture of an image in its row. @param {{image: LightImage, weights: RGB[], stops: number}} props */
export function ImageMap({ image, weights, stops }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  useLayoutEffect(() => {
    if (ref.current) drawMap(ref.current, image, weights, stops);
  });
  return html`<canvas class="thumb image-map" ref=${ref} aria-hidden="true"></canvas>`;
}
