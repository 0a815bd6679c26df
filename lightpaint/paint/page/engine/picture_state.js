/** What the pictures on the screen show: a state of the session, weights of the lights, the painting. */
import { union } from '../../../viewer/drawing/cpu_picture.js';
import { SRGB } from '../../../viewer/drawing/view_transform.js';
import { COMPARED_COUNT, showsPresent } from './picture_slots.js';
import { MIX_SLOTS, OTHER_SLOT, SOLUTION_SLOT, WALL_SLOT, SessionMixes } from './session_mixes.js';

/** @import { Lut } from '../../../viewer/drawing/view_transform.js' */
/** @import { Message } from './message_frames.js' */
/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { PaintCanvas } from './paint_canvas.js' */
/** @import { Screen } from './picture_canvas.js' */
/** @import { Display } from './picture_slots.js' */

export class PictureState {
  /** @param {Screen} screen @param {import("./socket_host.js").Host} host */
  constructor(screen, host) {
    this.screen = screen;
    this.mixes = new SessionMixes(host, screen);
    /** The session's state of the current view. @type {Message | null} */
    this.state = null;
    /** @type {PaintCanvas | null} */
    this.canvas = null;
    /** @type {Display | null} */
    this.display = null;
    this.weights = new Float64Array();
    /** The small picture of the weights that are being taken, where it has come with them.
     * @type {import("./draft_detail.js").SmallPicture | null} */
    this.draft = null;
    /** Whether lights have moved since the current look. */
    this.haveLightsMoved = false;
    /** @type {Lut} */
    this.lut = SRGB;
    /** Whether the current look exists, and whether the view has it. */
    this.knowsPresent = false;
    this.hasPresent = false;
    /** Whether the solution is the current look, which may be on its way. */
    this.isLookNow = false;
    /** Whether a stroke is in progress. */
    this.isPainting = false;
  }

  /** Light and importance of the painting, as they are drawn.
   * @returns {{image: Float32Array, importance: Float32Array} | null} */
  get drawnPainting() {
    return this.canvas;
  }

  /** Whether the session mixes the pictures of lightings, and the view has no plane of a light. */
  get hasMixes() {
    return Boolean(this.state?.hasMixes);
  }

  /** Whether the solution is the answer under the master dimmer, and not a part of it or a look. */
  get showsAnswer() {
    const { visibleLights, solutionWeights } = this.display ?? {};
    return !solutionWeights && !visibleLights?.includes(false);
  }

  /** Whether an answer to paint is to have a draft. */
  get wantsDrafts() {
    return this.hasMixes && this.showsAnswer && this.mixes.detail !== null;
  }

  /** Whether the view shows the current look in place of lights that it has not all received. */
  get lacksLights() {
    return false;
  }

  /** Number of planes of the view before the planes of compared looks. */
  get mixedCount() {
    return this.hasMixes ? MIX_SLOTS : (this.state?.lights.length ?? 0);
  }

  /** Weights that come with a message. @param {Message} message */
  takeWeights(message) {
    const { poses, added_lights: addedLights } = message;
    if (poses && addedLights)
      this.haveLightsMoved = Object.keys(poses).length + addedLights.length > 0;
    else if (poses) this.haveLightsMoved ||= Object.keys(poses).length > 0;
    if (poses && this.hasMixes) this.mixes.renew();
    const weights = message.arrays?.weights?.data;
    if (!weights) return;
    this.weights = Float64Array.from(weights);
    const { draft } = message.arrays;
    const halves = /** @type {Uint16Array | undefined} */ (draft?.data);
    this.draft = halves ? { halves, size: [draft.shape[0], draft.shape[1]] } : null;
    this.showWeights();
    this.draft = null;
    // The exact answer comes when the brush rests, and should be drawn sharply.
    this.screen.requestDraw(!message.exact);
  }

  /** @param {Lut} lut */
  setLut(lut) {
    this.lut = lut;
    this.screen.view?.setLut(lut);
  }

  /** Return the weights that the planes of the view are shown with; null for none.
   * @param {'solution' | 'other'} kind */
  weightsOf(kind) {
    const weights = this.lightWeights(kind);
    return weights && this.forPlanes(weights, kind === 'other' ? OTHER_SLOT : SOLUTION_SLOT);
  }

  /** Return the weights that lights, and maybe compared looks, are shown with; null for none.
   * @param {'solution' | 'other'} kind */
  lightWeights(kind) {
    const {
      visibleLights = null,
      solutionWeights = null,
      otherWeights = null,
      master = 1,
    } = this.display ?? {};
    if (kind === 'other') return otherWeights && this.checked(otherWeights.flat());
    const weights = this.checked(solutionWeights?.flat() ?? this.outputWeights(master));
    if (weights && visibleLights)
      weights.forEach(
        (weight, i) => (weights[i] = (visibleLights[Math.floor(i / 3)] ?? true) ? weight : 0),
      );
    return weights;
  }

  /** Tell the view which weights are shown. */
  showWeights() {
    const { view } = this.screen;
    if (!view || !this.state) return;
    const ofLights = this.lightWeights('solution');
    if (ofLights) this.checkPresent(ofLights);
    const weights = this.weightsOf('solution');
    const otherMix = this.weightsOf('other');
    if (weights) view.setWeights(weights);
    if (otherMix) view.setWeights(otherMix, 'other');
  }

  /** Tell the view which of the looks that are side by side it draws next; false for none.
   * @param {number} index */
  chooseLook(index) {
    const ofLights = this.checked(this.display?.lookMixes?.[index]?.flat() ?? []);
    const weights = ofLights && this.forPlanes(ofLights, WALL_SLOT + index);
    if (weights) this.screen.view?.setWeights(weights, 'other');
    return weights !== null;
  }

  /** Return the answer's weights under the master dimmer. @param {number} master a factor */
  outputWeights(master) {
    const { weights, state } = this;
    const isFixed = (/** @type {number} */ i) => state?.lights[Math.floor(i / 3)]?.is_fixed;
    return master === 1 ? weights : weights.map((x, i) => (isFixed(i) ? x : master * x));
  }

  /** Return a copy of the weights of lights, and maybe of compared looks; null for weights of other
   * lights. @param {ArrayLike<number>} weights */
  checked(weights) {
    const length = 3 * (this.state?.lights.length ?? 0);
    if (weights.length !== length && weights.length !== length + 3 * COMPARED_COUNT) return null;
    return Float64Array.from(weights);
  }

  /** Return weights for all planes of the view. @param {Float64Array} weights of the lights and maybe
   * of compared looks @param {number} slot of the mix that shows these lights, where there are mixes */
  forPlanes(weights, slot) {
    const length = 3 * (this.state?.lights.length ?? 0);
    const planeWeights = new Float64Array(3 * this.screen.count);
    const looks = weights.subarray(length, length + planeWeights.length - 3 * this.mixedCount);
    planeWeights.set(looks, 3 * this.mixedCount);
    if (!this.hasMixes) planeWeights.set(weights.subarray(0, length));
    else if (this.showMix(slot, weights.slice(0, length))) planeWeights.fill(1, 3 * slot, 3 * slot + 3);
    return planeWeights;
  }

  /** Show lights in a slot of mixes, unless they give the current look; return whether any is on. @param {number} slot @param {Float64Array} weights */
  showMix(slot, weights) {
    const isLit = weights.some((weight) => weight !== 0);
    const isLook = slot === SOLUTION_SLOT && this.isLookNow;
    const draft = slot === SOLUTION_SLOT && this.showsAnswer ? this.draft : null;
    if (isLit && !isLook) this.mixes.show(slot, weights, draft);
    return isLit;
  }

  /** Unchanged lights give the current look, which arrives before the planes and is denoised. Others
   * do when all planes are there.
   * @param {Float64Array} weights */
  checkPresent(weights) {
    const { screen, canvas, state, display } = this;
    const present =
      state?.lights.flatMap((/** @type {{present: number[]}} */ light) => light.present) ?? [];
    const isClean = display?.clean ?? true;
    const isUnchanged = () =>
      weights.every(
        (weight, i) => Math.abs(weight - (present[i] ?? 0)) <= 1e-9 * (present[i] ?? 0),
      );
    const isPresent =
      isClean &&
      !this.haveLightsMoved &&
      ((this.showsAnswer && this.lacksLights) || isUnchanged());
    this.isLookNow = isPresent;
    screen.isPresent = isPresent && this.knowsPresent;
    if (screen.isPresent !== this.hasPresent && canvas) this.showPresent();
  }

  /** Give the view the current look while it is shown. */
  showPresent() {
    const { screen, canvas, display } = this;
    const isShown = screen.isPresent || showsPresent(display);
    this.hasPresent = screen.isPresent;
    screen.view?.setPicture('present', isShown && canvas ? canvas.present : null);
  }

  /** @param {Region[]} regions */
  redraw(regions) {
    const { drawnPainting } = this;
    const region = regions.reduce((a, b) => /** @type {Region} */ (union(a, b)), regions[0]);
    if (!drawnPainting || !region) return;
    this.screen.view?.setCanvas(region, drawnPainting.image, drawnPainting.importance);
    this.screen.requestDraw(this.isPainting);
  }
}
