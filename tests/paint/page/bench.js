/** What tests of the picture engine call in the browser. */
import { PaintCanvas } from "/engine/paint_canvas.js";
import { chooseView } from "/viewer/drawing/choose_renderer.js";
import { lutOf } from "/viewer/drawing/lattice.js";
import { SRGB } from "/viewer/drawing/view_transform.js";
import { pictureOf } from "/engine/message_frames.js";
import { DEFAULTS } from "/viewer/drawing/view.js";

/** An array of the site. */
export async function array(name) {
  const response = await fetch(`/data/${name}`);
  const shape = response.headers.get("x-shape").split(",").map(Number);
  return pictureOf(response.headers.get("x-dtype"), shape, await response.arrayBuffer());
}

/** A view with all there is on the site, its canvas as large as asked. */
export async function viewOf(which, { count, scales, width, height, lut, planeSize }) {
  const painting = await array("painting");
  const options = { view: which, planeSize: planeSize ?? undefined };
  const view = chooseView(document.body, painting.shape.slice(0, 2), count, options);
  [view.canvas.width, view.canvas.height] = [width, height];
  const [rows, columns] = painting.shape;
  view.setCanvas([0, rows, 0, columns], painting.data, (await array("importance")).data);
  for (let k = 0; k < count; k++) view.setPlane(k, (await array(`plane/${k}`)).data, scales[k]);
  view.setBeyond((await array("beyond")).data);
  view.setLut(lut ? lutOf(lut.name, await array("lut"), lut) : SRGB);
  view.setWeights((await array("weights")).data);
  window.view = view;
  return view.name;
}

/** All that the view shows, RGBA by rows. */
export function shown(params) {
  const { view } = window;
  view.draw({ ...DEFAULTS, ...params });
  return Array.from(view.read(0, 0, view.canvas.width, view.canvas.height));
}

/** A canvas of one colour, of so many pixels. */
export function plain(height, width, light, objects = null) {
  const half = { 0: 0, 0.25: 0x3400, 0.5: 0x3800, 1: 0x3c00 }[light];
  const canvas = new PaintCanvas([height, width], new Uint16Array(3 * height * width).fill(half));
  canvas.objects = objects && Int16Array.from(objects);
  return canvas;
}
