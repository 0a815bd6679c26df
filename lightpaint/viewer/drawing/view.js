/**
 * The interface of a view, and the layout of pictures on its canvas.
 *
 * There are two views, gl.js and cpu.js, which agree to one display code; choose_renderer.js chooses one for
 * a page. A view holds one plane per light, denoised or raw, as set last.
 * Planes of many lights have fewer pixels than the picture, and are stretched over it.
 */

/** Rows and columns of the picture, ends not included.
 * @typedef {[top: number, bottom: number, left: number, right: number]} Region */
/** @import { Lut } from './view_transform.js' */

/** The painting; the mix of the planes with the weights; the mix with other weights (another
 * look); a picture that was set by name.
 * @typedef {'painting' | 'solution' | 'other' | 'verified' | 'present'} Kind */
/** missed: where the solution differs from the painting; beyond: what no lighting reaches.
 * @typedef {null | 'missed' | 'beyond' | 'falsecolor' | 'importance'} Overlay */

/** What is drawn. left, right: the pictures. layout: side by side (or stacked, if they are larger
 * so), the left one in front up to the wipe, one alone (blink: 'left' or 'right'), or one (large)
 * with all of the other small in a corner. zoom: 1 fits.
 * pan: offset of the centre, in picture pixels. stops: exposure. live: whether more frames follow
 * soon, so that speed matters more than sharpness. draftStep: between the pixels and rows that are
 * worth drawing while live; others repeat these.
 * @typedef {{left: Kind, right: Kind, layout: 'side' | 'wipe' | 'blink' | 'inset', wipe: number,
 *   blink: 'left' | 'right', zoom: number, pan: [number, number], stops: number,
 *   overlay: Overlay, live: boolean, draftStep?: number, large?: 'left' | 'right',
 *   corner?: Corner}} Params */
/** @typedef {'top-left' | 'top-right' | 'bottom-left' | 'bottom-right'} Corner */

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

/** A view of pictures of one size on one canvas.
 *
 * @typedef {object} PictureView
 * @property {'gl' | 'cpu'} name
 * @property {HTMLCanvasElement} canvas whose width and height are device pixels
 * @property {(count: number) => void} setCount how many lights there are; their planes are black
 * @property {(light: number, halves: Uint16Array, scale: number, step?: number) => void} setPlane
 *   (h, w, 3) halves of the light at unit emission, times `scale`; of every step-th pixel of every
 *   step-th row. The view may keep the array.
 * @property {(weights: ArrayLike<number>, kind?: 'solution' | 'other') => void} setWeights
 *   (n, 3), row by row
 * @property {(region: Region, image: Float32Array, importance: Float32Array) => void} setCanvas
 *   what changed, and the whole painting (h, w, 3) and importance (h, w). May keep both.
 * @property {(kind: 'verified' | 'present', halves: Uint16Array | null) => void} setPicture
 * @property {(beyond: Uint8Array | null) => void} setBeyond (h, w)
 * @property {(lut: Lut) => void} setLut
 * @property {(params: Params) => void} draw
 * @property {(x: number, y: number, width: number, height: number) => Uint8Array} read
 *   RGBA truly on the canvas after the last draw, in device pixels from its top left
 * @property {(x: number, y: number) => Float32Array} planesAt
 *   (n, 3) light of each plane at a pixel, at unit emission
 * @property {(kind: Kind, x: number, y: number) => [number, number, number]} lightAt
 *   linear light of a picture at a pixel
 * @property {() => {data: Float32Array, width: number, height: number, channels: number} | null} mixedLight
 *   linear light of the solution, maybe at reduced size; null before there is any
 * @property {() => boolean} hasLostContext whether the context lost all that was set, so that it has to be set again
 * @property {() => number} memory bytes held for pictures
 * @property {() => void} close */

/** Place of a picture: the pane in device pixels, device pixels per picture pixel, and the device
 * position of the picture's top left corner.
 * @typedef {{kind: Kind, x: number, y: number, width: number, height: number, scale: number,
 *   left: number, top: number, middle: [number, number]}} Pane
 * middle: of what the picture was fitted into */

/** Device pixels between two panes. */
const GAP = 4;

/** Largest part of the width and the height that a small picture in a corner takes, and its distance
 * from the edges as a part of the shorter one. */
const [INSET_SHARE, INSET_MARGIN] = [0.32, 0.02];

/** Device pixels per picture pixel from which pixels are shown as squares. */
export const SQUARES = 2;

/** Background without a picture. */
export const GROUND = [24, 24, 26];

/** Return the panes to draw. In a wipe the second pane is in front, cut at the wipe.
 * @param {Params} params @param {{width: number, height: number}} canvas
 * @param {[height: number, width: number]} size of the picture @returns {Pane[]} */
export function panes(params, canvas, size) {
  const { width, height } = canvas;
  const area = { x: 0, y: 0, width, height };
  if (params.layout === 'blink') return [fitPane(params[params.blink], area, area, params, size)];
  if (params.layout === 'wipe') {
    const border = Math.round(width * Math.min(1, Math.max(0, params.wipe)));
    const frontBox = { ...area, width: border };
    const backBox = { ...area, x: border, width: width - border };
    return [
      fitPane(params.right, backBox, area, params, size),
      fitPane(params.left, frontBox, area, params, size),
    ].filter((pane) => pane.width > 0);
  }
  if (params.layout === 'inset') {
    const isLeftLarge = params.large === 'left';
    const [large, small] = isLeftLarge ? [params.left, params.right] : [params.right, params.left];
    const box = insetBox(area, size, params.corner ?? 'bottom-right');
    const whole = { ...params, zoom: 1, pan: /** @type {[number, number]} */ ([0, 0]) };
    return [fitPane(large, area, area, params, size), fitPane(small, box, box, whole, size)];
  }
  const columnWidth = Math.max(1, Math.floor((width - GAP) / 2));
  const rowHeight = Math.max(1, Math.floor((height - GAP) / 2));
  const isSideBySide = fit([columnWidth, height], size) >= fit([width, rowHeight], size);
  const first = isSideBySide ? { ...area, width: columnWidth } : { ...area, height: rowHeight };
  const second = isSideBySide
    ? { ...first, x: width - columnWidth }
    : { ...first, y: height - rowHeight };
  return [
    fitPane(params.left, first, first, params, size),
    fitPane(params.right, second, second, params, size),
  ];
}

/** Return where the small picture lies, in whole pixels. @param {Box} area
 * @param {[height: number, width: number]} size of the picture @param {Corner} corner
 * @returns {Box} */
function insetBox(area, [height, width], corner) {
  const scale = Math.min((INSET_SHARE * area.width) / width, (INSET_SHARE * area.height) / height);
  const box = { width: Math.max(1, Math.round(scale * width)), height: Math.max(1, Math.round(scale * height)) };
  const margin = Math.round(INSET_MARGIN * Math.min(area.width, area.height));
  return {
    ...box,
    x: area.x + (corner.endsWith('left') ? margin : area.width - margin - box.width),
    y: area.y + (corner.startsWith('top') ? margin : area.height - margin - box.height),
  };
}

/** Return the picture and its pixel, not rounded, at a place of the canvas; null between pictures.
 * @param {Pane[]} visiblePanes @param {number} x @param {number} y */
export function hitTest(visiblePanes, x, y) {
  for (const pane of [...visiblePanes].reverse()) {
    const isInside =
      x >= pane.x && x < pane.x + pane.width && y >= pane.y && y < pane.y + pane.height;
    if (isInside) return { pane, ...toPicture(pane, x, y) };
  }
  return null;
}

/** Return a place of the canvas in picture pixels of a pane, also outside it.
 * @param {Pane} pane @param {number} x @param {number} y */
function toPicture(pane, x, y) {
  return { x: (x - pane.left) / pane.scale, y: (y - pane.top) / pane.scale };
}

/** Zoom by a factor around a place of a pane.
 * @param {Params} params @param {Pane} pane @param {number} x @param {number} y
 * @param {number} factor @returns {{zoom: number, pan: [number, number]}} */
export function zoomAround(params, pane, x, y, factor) {
  const zoom = Math.min(64, Math.max(0.25, params.zoom * factor));
  const scale = (pane.scale * zoom) / params.zoom;
  const shift = 1 / pane.scale - 1 / scale;
  const [middleX, middleY] = pane.middle;
  return {
    zoom,
    pan: [params.pan[0] + (x - middleX) * shift, params.pan[1] + (y - middleY) * shift],
  };
}

/** @typedef {{x: number, y: number, width: number, height: number}} Box */

/** Return a pane with its picture fitted into an area, then zoomed and panned. The corner is at a
 * whole device pixel, so that at 100 % the pixels coincide.
 * @param {Kind} kind @param {Box} box @param {Box} area @param {Params} params
 * @param {[number, number]} size @returns {Pane} */
function fitPane(kind, box, area, params, [height, width]) {
  const scale = fit([area.width, area.height], [height, width]) * params.zoom;
  /** @type {[number, number]} */
  const middle = [area.x + area.width / 2, area.y + area.height / 2];
  const left = Math.round(middle[0] - scale * (width / 2 + params.pan[0]));
  const top = Math.round(middle[1] - scale * (height / 2 + params.pan[1]));
  return { kind, ...box, scale, left, top, middle };
}

/** Return device pixels per picture pixel when the whole picture fits.
 * @param {[width: number, height: number]} area @param {[height: number, width: number]} size */
function fit([areaWidth, areaHeight], [height, width]) {
  return Math.max(1e-6, Math.min(areaWidth / width, areaHeight / height));
}
