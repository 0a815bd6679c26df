/** What a person selects: a shape, an object, colours, what a light lights; and changes of it. */
import { nameInView } from '../message_frames.js';
import { VALUES, toFloats } from '../../../../viewer/drawing/half_floats.js';
import { encoderOf } from '../../../../viewer/drawing/view_transform.js';
import { feathered, grown, inverted, joined } from './mask_operations.js';
import { FULL, ellipse, polygonMask, rectangle } from './polygon_mask.js';
import { OTHER_SLOT, SOLUTION_SLOT } from '../session_mixes.js';
import { SelectionMirror } from './selection_mirror.js';
import { brightnessMask, colourMask, lightMask, objectMask } from './shown_masks.js';
import { t } from '../../language/language.js';

/** @import { Kind } from '../../../../viewer/drawing/view.js' */
/** @import { Mode } from './mask_operations.js' */
/** @import { Corner } from './polygon_mask.js' */
/** @import { Selection } from './selection_mirror.js' */
/** @import { Region } from '../messages.js' */

/** A part to select. Places are in pixels of the picture. `picture`: whose colours count, as they are
 * shown.
 * @typedef {{kind: 'rectangle' | 'ellipse', corners: [Corner, Corner]}
 *   | {kind: 'lasso', corners: Corner[]} | {kind: 'object', object: number}
 *   | {kind: 'light', light: number} | {kind: 'all'}
 *   | {kind: 'colour', picture: Kind, x: number, y: number, tolerance: number}
 *   | {kind: 'brightness', picture: Kind, low: number, high: number}} Part */
/** About what is selected. revision: grows with every change. share: of the picture. isFaint: whether
 * no pixel is half selected.
 * @typedef {{revision: number, bounds: Region, share: number,
 *   isFaint: boolean}} Summary */
/** `pixels`: negative to shrink.
 * @typedef {{kind: 'none'} | {kind: 'invert'} | {kind: 'feather' | 'grow', pixels: number}} Change */

/** What a step calls the other parts. */
const NAMES = {
  rectangle: t('rectangle'),
  ellipse: t('ellipse'),
  lasso: t('lasso'),
  colour: t('by colour'),
  brightness: t('by brightness'),
  all: t('all'),
};

export class Selections {
  /** @param {import("../session_mirror.js").SessionMirror} mirror of the session
   * @param {(kind: string, event: any) => void} emit */
  constructor(mirror, emit) {
    this.session = mirror;
    /** Number of the last request, since masks of pictures take a while. */
    this.count = 0;
    this.mirror = new SelectionMirror(
      mirror.host,
      () => emit('selection', {}),
      (text) => emit('trouble', { text }),
    );
  }

  /** What is selected in the current view; null if everything can be painted.
   * @returns {Selection | null} */
  get current() {
    return this.mirror.current;
  }

  /** Width of the picture, and of the mask. */
  get width() {
    return this.mirror.size[1];
  }

  /** @returns {Summary | null} null if everything can be painted */
  summary() {
    const { current, changes } = this.mirror;
    if (!current) return null;
    let [sum, most] = [0, 0];
    for (const x of current.mask) {
      sum += x;
      if (x > most) most = x;
    }
    const share = sum / (FULL * current.mask.length);
    return { revision: changes, bounds: current.bounds, share, isFaint: 2 * most < FULL };
  }

  /** Select a part of the picture. @param {Part} part
   * @param {{mode?: Mode, feather?: number}} [options] feather: width of its soft edge in pixels
   * @returns {Promise<void>} */
  async select(part, { mode = 'replace', feather = 0 } = {}) {
    const { view } = this.mirror;
    this.count += 1;
    const { count } = this;
    const mask = await this.maskOf(part);
    if (!mask || view !== this.mirror.view || count !== this.count) return;
    const soft = feathered(mask, this.mirror.size, feather);
    this.put(
      joined(this.current?.mask ?? null, soft, mode),
      t('select {part}', { part: this.nameOf(part) }),
    );
  }

  /** Return what a step calls a part. @param {Part} part */
  nameOf(part) {
    const { state } = this.session;
    if (part.kind === 'object') return state?.objects?.[part.object] ?? t('background');
    if (part.kind === 'light')
      return t('what {name} lights', { name: state?.lights[part.light]?.name });
    return NAMES[part.kind];
  }

  /** Change what is selected. @param {Change} change */
  change(change) {
    const { current } = this;
    const { size } = this.mirror;
    if (!current) return;
    this.count += 1;
    if (change.kind === 'none') this.put(null, t('deselect'));
    else if (change.kind === 'invert') this.put(inverted(current.mask), t('invert selection'));
    else if (change.kind === 'feather')
      this.put(feathered(current.mask, size, change.pixels), t('feather selection'));
    else
      this.put(
        grown(current.mask, size, change.pixels),
        change.pixels < 0 ? t('shrink selection') : t('grow selection'),
      );
  }

  /** @param {Uint8Array | null} mask @param {string} label */
  put(mask, label) {
    const { strokes } = this.session;
    if (strokes && !strokes.isSessionLost) this.mirror.change(mask, label, strokes);
  }

  /** Return the mask of a part; null if it is not known yet. @param {Part} part
   * @returns {Promise<Uint8Array | null>} */
  async maskOf(part) {
    const { size } = this.mirror;
    const { canvas } = this.session;
    switch (part.kind) {
      case 'rectangle':
        return polygonMask(rectangle(...part.corners), size);
      case 'ellipse':
        return polygonMask(ellipse(...part.corners), size);
      case 'lasso':
        return polygonMask(part.corners, size);
      case 'all':
        return new Uint8Array(size[0] * size[1]).fill(FULL);
      case 'object':
        return canvas?.objects ? objectMask(canvas.objects, part.object) : null;
      case 'light': {
        const plane = await this.planeOf(part.light);
        return plane && lightMask(plane, canvas?.albedo ?? null);
      }
      case 'brightness': {
        const codes = await this.codesOf(part.picture);
        return codes && brightnessMask(codes, part.low, part.high);
      }
      case 'colour': {
        const codes = await this.codesOf(part.picture);
        const [x, y] = [Math.floor(part.x), Math.floor(part.y)];
        const isInside = x >= 0 && y >= 0 && x < size[1] && y < size[0];
        return codes && isInside ? colourMask(codes, y * size[1] + x, part.tolerance) : null;
      }
    }
  }

  /** Return the display codes of a picture, RGBA, as it is shown. @param {Kind} kind */
  async codesOf(kind) {
    const light = await this.lightOf(kind);
    if (!light) return null;
    const codes = new Uint8ClampedArray((light.length / 3) * 4);
    const { lut, display } = this.session;
    encoderOf(lut, display?.stops ?? 0).pixels(light, codes, 0, light.length / 3);
    return codes;
  }

  /** Return the linear light of a picture, (h, w, 3). @param {Kind} kind
   * @returns {Promise<Float32Array | null>} */
  async lightOf(kind) {
    const { session } = this;
    const { canvas, screen } = session;
    if (kind === 'painting') return session.drawnPainting?.image ?? null;
    const shown = screen.substitute(kind);
    if (shown === 'present') return canvas && toFloats(canvas.present);
    if (shown === 'verified') {
      const { data } = await session.host.fetch(nameInView('verified', session.view));
      return toFloats(/** @type {Uint16Array} */ (data));
    }
    const weights = session.weightsOf(shown === 'other' ? 'other' : 'solution');
    if (!canvas || !weights) return null;
    if (session.hasMixes) return session.mixes.lightOf(shown === 'other' ? OTHER_SLOT : SOLUTION_SLOT);
    const light = new Float32Array(canvas.image.length);
    for (let k = 0; k < weights.length / 3; k++) {
      const rgb = weights.subarray(3 * k, 3 * k + 3);
      const plane = rgb.some((x) => x !== 0) ? await this.planeOf(k) : null;
      const scale = session.state?.lights[k]?.scale ?? 1;
      for (let i = 0; plane && i < light.length; i++)
        light[i] += VALUES[plane[i]] * scale * rgb[i % 3];
    }
    return light;
  }

  /** Return the picture of a light alone, (h, w, 3) halves. @param {number} light
   * @returns {Promise<Uint16Array | null>} */
  async planeOf(light) {
    const { hasMixes, host, loader, state, view } = this.session;
    const slot = light < (state?.lights.length ?? 0) ? `plane ${light}` : null;
    const wanted = hasMixes ? nameInView(`plane/${light}`, view) : loader.wantedNames.get(slot ?? '');
    const name = slot && wanted;
    if (!name) return null;
    return /** @type {Uint16Array} */ ((await host.fetch(name)).data);
  }
}
