/**
 * How pictures are shown: what a view can do, and where on its canvas which picture lies.
 *
 * There are two views, gl.js and cpu.js, which show the same to one display code; choose.js says
 * which one a page gets. A view holds one plane for each light: clean or raw ones, whatever was
 * set last.
 */

/** Rows and columns of the picture, ends not included.
 * @typedef {[top: number, bottom: number, left: number, right: number]} Region */
/** @typedef {import("./lut.js").Shaper} Shaper */

/** The painting; the mix of the planes with the weights; the mix with other weights (another
 * look); a picture that was set by name.
 * @typedef {'painting' | 'solution' | 'other' | 'verified' | 'present'} Kind */
/** missed: where the solution is not what was painted; beyond: what no lighting reaches.
 * @typedef {null | 'missed' | 'beyond' | 'falsecolor' | 'importance'} Overlay */

/**
 * What is drawn.
 *
 * left, right: which pictures. layout: beside each other (or one over the other, where there is
 * more room so), the left one in front up to the wipe, or one of them alone (blink: 'left' or
 * 'right'). zoom: 1 fits. pan: what lies in the middle, in picture pixels from its middle. stops:
 * exposure. live: whether the next one comes soon, so that quick is better than sharp.
 * @typedef {{left: Kind, right: Kind, layout: 'side' | 'wipe' | 'blink', wipe: number,
 *   blink: 'left' | 'right', zoom: number, pan: [number, number], stops: number,
 *   overlay: Overlay, live: boolean}} Params
 */

/** @type {Readonly<Params>} */
export const DEFAULTS = Object.freeze({
  left: 'painting',
  right: 'solution',
  layout: 'side',
  wipe: 0.5,
  blink: 'left',
  zoom: 1,
  pan: /** @type {[number, number]} */ ([0, 0]),
  stops: 0,
  overlay: null,
  live: false,
});

/**
 * A view of pictures of one size on one canvas.
 *
 * @typedef {object} PictureView
 * @property {'gl' | 'cpu'} name
 * @property {HTMLCanvasElement} canvas whose width and height are device pixels
 * @property {(count: number) => void} setCount how many lights there are; their planes are black
 * @property {(light: number, halves: Uint16Array, scale: number) => void} setPlane
 *   (h, w, 3) halves of the light at unit emission, times `scale`. The view may keep the array.
 * @property {(weights: ArrayLike<number>, kind?: 'solution' | 'other') => void} setWeights
 *   (n, 3), row by row
 * @property {(region: Region, image: Float32Array, importance: Float32Array) => void} setCanvas
 *   what changed, and the whole painting (h, w, 3) and importance (h, w). May keep both.
 * @property {(kind: 'verified' | 'present', halves: Uint16Array | null) => void} setPicture
 * @property {(beyond: Uint8Array | null) => void} setBeyond (h, w)
 * @property {(lut: import("./lut.js").Lut) => void} setLut
 * @property {(params: Params) => void} draw
 * @property {(x: number, y: number, width: number, height: number) => Uint8Array} read
 *   RGBA truly on the canvas after the last draw, in device pixels from its top left
 * @property {(x: number, y: number) => Float32Array} planesAt
 *   (n, 3) light of each plane at a pixel, at unit emission
 * @property {(kind: Kind, x: number, y: number) => [number, number, number]} lightAt
 *   linear light of a picture at a pixel
 * @property {() => boolean} lost whether all that was set is gone, and is to be set again
 * @property {() => number} memory bytes held for pictures
 * @property {() => void} close
 */

/** Where a picture lies: device pixels of the pane, device pixels for each of the picture, and
 * the device position of its top left corner.
 * @typedef {{kind: Kind, x: number, y: number, width: number, height: number, scale: number,
 *   left: number, top: number, middle: [number, number]}} Pane
 * middle: of what the picture was fitted into */

/** Device pixels between two panes. */
export const GAP = 4;

/** Device pixels for each of the picture from which on single pixels are shown as squares. */
export const SQUARES = 2;

/** Shown where no picture is. */
export const GROUND = [24, 24, 26];

/** What is drawn where. Of a wipe the second pane is in front, cut at the wipe.
 * @param {Params} params @param {{width: number, height: number}} canvas
 * @param {[height: number, width: number]} size of the picture @returns {Pane[]} */
export function panes(params, canvas, size) {
  const { width, height } = canvas;
  const whole = { x: 0, y: 0, width, height };
  if (params.layout === 'blink') return [placed(params[params.blink], whole, whole, params, size)];
  if (params.layout === 'wipe') {
    const cut = Math.round(width * Math.min(1, Math.max(0, params.wipe)));
    const front = { ...whole, width: cut };
    const back = { ...whole, x: cut, width: width - cut };
    return [
      placed(params.right, back, whole, params, size),
      placed(params.left, front, whole, params, size),
    ].filter((pane) => pane.width > 0);
  }
  const columnWidth = Math.max(1, Math.floor((width - GAP) / 2));
  const rowHeight = Math.max(1, Math.floor((height - GAP) / 2));
  const isBeside = fit([columnWidth, height], size) >= fit([width, rowHeight], size);
  const first = isBeside ? { ...whole, width: columnWidth } : { ...whole, height: rowHeight };
  const second = isBeside ? { ...first, x: width - columnWidth } : { ...first, y: height - rowHeight };
  return [
    placed(params.left, first, first, params, size),
    placed(params.right, second, second, params, size),
  ];
}

/** Which pixel of which picture lies at a place of the canvas, both not rounded; null between.
 * @param {Pane[]} shown @param {number} x @param {number} y */
export function at(shown, x, y) {
  for (const pane of [...shown].reverse()) {
    const isIn = x >= pane.x && x < pane.x + pane.width && y >= pane.y && y < pane.y + pane.height;
    if (isIn) return { pane, ...inPicture(pane, x, y) };
  }
  return null;
}

/** A place of the canvas in pixels of the picture of a pane, also beyond it.
 * @param {Pane} pane @param {number} x @param {number} y */
export function inPicture(pane, x, y) {
  return { x: (x - pane.left) / pane.scale, y: (y - pane.top) / pane.scale };
}

/** Zoom by a factor so that what lies under a place of a pane stays there.
 * @param {Params} params @param {Pane} pane @param {number} x @param {number} y
 * @param {number} factor @returns {{zoom: number, pan: [number, number]}} */
export function zoomed(params, pane, x, y, factor) {
  const zoom = Math.min(64, Math.max(0.25, params.zoom * factor));
  const scale = (pane.scale * zoom) / params.zoom;
  const shift = 1 / pane.scale - 1 / scale;
  const [across, down] = pane.middle;
  return {
    zoom,
    pan: [params.pan[0] + (x - across) * shift, params.pan[1] + (y - down) * shift],
  };
}

/** @typedef {{x: number, y: number, width: number, height: number}} Box */

/** A pane whose picture is fitted into an area that may be larger, by zoom and pan. Its corner
 * lies on a whole device pixel, so that pixels that are as large as those of the device meet them.
 * @param {Kind} kind @param {Box} box @param {Box} area @param {Params} params
 * @param {[number, number]} size @returns {Pane} */
function placed(kind, box, area, params, [height, width]) {
  const scale = fit([area.width, area.height], [height, width]) * params.zoom;
  /** @type {[number, number]} */
  const middle = [area.x + area.width / 2, area.y + area.height / 2];
  const left = Math.round(middle[0] - scale * (width / 2 + params.pan[0]));
  const top = Math.round(middle[1] - scale * (height / 2 + params.pan[1]));
  return { kind, ...box, scale, left, top, middle };
}

/** Device pixels for each of the picture where all of it is seen.
 * @param {[width: number, height: number]} area @param {[height: number, width: number]} size */
function fit([across, down], [height, width]) {
  return Math.max(1e-6, Math.min(across / width, down / height));
}
