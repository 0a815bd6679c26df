/** The canvas of the pictures: its view, its size in device pixels, and when it draws. */
import { chooseView } from '../../../viewer/drawing/choose_renderer.js';
import { DEFAULTS, panes } from '../../../viewer/drawing/view.js';

/** @import { Kind, Pane, Params, PictureView } from '../../../viewer/drawing/view.js' */

/** Milliseconds without changes before a quick draft is redrawn sharply. */
const DRAFT_PAUSE_MS = 180;

/** Milliseconds that a GPU has to come back. */
const GPU_RECOVERY_MS = 3000;

/** Size in CSS pixels. choose: has the view draw the picture of a canvas, if there is one.
 * @typedef {{canvases: HTMLCanvasElement[], width: number, height: number,
 *   choose: (index: number) => boolean}} Copies */

export class Screen {
  /** @param {HTMLElement} element
   * @param {{view?: 'gl' | 'cpu' | null, refill: () => void, beforeDraw?: () => void}} options refill:
   * called when the view has lost its pictures; beforeDraw: before it draws in a frame */
  constructor(element, options) {
    this.element = element;
    this.options = options;
    /** @type {PictureView | null} */
    this.view = null;
    /** @type {[number, number]} */
    this.size = [1, 1];
    /** Height and width of the planes. @type {[number, number]} */
    this.planeSize = [1, 1];
    this.count = 0;
    /** @type {Params} */
    this.params = { ...DEFAULTS };
    this.width = 0;
    this.height = 0;
    /** Canvases that show looks instead, and what prepares each. @type {Copies | null} */
    this.copies = null;
    this.frame = 0;
    this.isLive = false;
    /** Whether a brush is down; slow work waits until it is lifted. */
    this.isBrushDown = false;
    /** While a light is being dragged, the step between the pixels that its pictures show.
     * @type {number | null} */
    this.draftStep = null;
    /** Whether the solution equals the current look. */
    this.isPresent = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.pauseTimer = undefined;
    /** Milliseconds that a GPU has to come back. */
    this.recoveryMs = GPU_RECOVERY_MS;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.recoveryTimer = undefined;
  }

  /** Start a view for pictures of a size and a number of lights.
   * @param {[height: number, width: number]} size @param {number} count
   * @param {'gl' | 'cpu' | null} [viewName] @param {[number, number]} [planeSize] */
  begin(size, count, viewName = this.options.view ?? null, planeSize = size) {
    clearTimeout(this.recoveryTimer);
    this.view?.close();
    this.view?.canvas.remove();
    this.size = size;
    this.planeSize = planeSize;
    this.count = count;
    const onRestored = () => this.handleRestore(view);
    const view = chooseView(this.element, size, count, { view: viewName, planeSize, onRestored });
    view.canvas.addEventListener('webglcontextlost', () => this.handleLoss(view));
    this.view = view;
    this.fit();
  }

  /** Change the number of lights. @param {number} count */
  setCount(count) {
    this.count = count;
    this.view?.setCount(count);
  }

  /** Handle the loss of the GPU: continue without it if it does not come back.
   * @param {PictureView} view */
  handleLoss(view) {
    // A closed view releases its context, and its event arrives after the next view has started.
    if (view !== this.view) return;
    clearTimeout(this.recoveryTimer);
    this.recoveryTimer = setTimeout(() => {
      this.begin(this.size, this.count, 'cpu', this.planeSize);
      this.options.refill();
    }, this.recoveryMs);
  }

  /** @param {PictureView} view */
  handleRestore(view) {
    if (view !== this.view) return;
    clearTimeout(this.recoveryTimer);
    view.setCount(this.count);
    this.options.refill();
  }

  /** @param {number} width @param {number} height in CSS pixels */
  resize(width, height) {
    this.width = width;
    this.height = height;
    this.fit();
  }

  /** Draw looks on other canvases instead, or for null the pictures again.
   * @param {Copies | null} copies */
  copyTo(copies) {
    this.copies = copies;
    this.fit();
  }

  /** Match the canvas to the pixels of the display. */
  fit() {
    if (!this.view) return;
    const { canvas } = this.view;
    const area = this.copies ?? this;
    canvas.style.display = 'block';
    canvas.style.width = `${area.width}px`;
    canvas.style.height = `${area.height}px`;
    const [width, height] = [area.width, area.height].map((n) =>
      Math.max(1, Math.round(n * this.ratio)),
    );
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    this.drawNow();
  }

  /** Device pixels per CSS pixel. */
  get ratio() {
    return Math.max(1, window.devicePixelRatio || 1);
  }

  /** In device pixels. @returns {Pane[]} */
  panes() {
    const area = this.copies ?? this;
    const [width, height] = [area.width * this.ratio, area.height * this.ratio].map(Math.round);
    return panes(this.params, { width, height }, this.size);
  }

  /** Draw in the next frame. isLive: draw a quick draft, and redraw sharply after a pause.
   * @param {boolean} [isLive] */
  requestDraw(isLive = false) {
    if (isLive) {
      this.isLive = true;
      this.scheduleSharpDraw();
    }
    this.frame ||= requestAnimationFrame(() => {
      this.options.beforeDraw?.();
      // Panels that follow the same message may want to see the pictures in another way.
      queueMicrotask(() => this.frame && this.drawNow());
    });
  }

  /** Draw sharply after a pause. */
  scheduleSharpDraw() {
    clearTimeout(this.pauseTimer);
    this.pauseTimer = setTimeout(() => {
      if (this.isBrushDown || this.draftStep !== null) return this.scheduleSharpDraw();
      this.isLive = false;
      this.requestDraw();
    }, DRAFT_PAUSE_MS);
  }

  drawNow() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    if (this.copies) return this.drawCopies(this.copies);
    const { left, right } = this.params;
    const kinds = { left: this.substitute(left), right: this.substitute(right) };
    const draftStep = this.draftStep ?? 1;
    this.view?.draw({ ...this.params, ...kinds, live: this.isLive, draftStep });
  }

  /** Draw one look after another, and copy each. @param {Copies} copies */
  drawCopies({ canvases, choose }) {
    const { view } = this;
    canvases.forEach((canvas, k) => {
      if (!view || !choose(k)) return;
      view.draw({ ...this.params, live: this.isLive });
      const { width, height } = view.canvas;
      Object.assign(canvas, { width, height });
      canvas.getContext('2d')?.drawImage(view.canvas, 0, 0);
    });
  }

  /** Return the picture shown in place of another.
   * @param {Kind} kind */
  substitute(kind) {
    return kind === 'solution' && this.isPresent ? 'present' : kind;
  }

  close() {
    clearTimeout(this.pauseTimer);
    clearTimeout(this.recoveryTimer);
    cancelAnimationFrame(this.frame);
    this.view?.close();
    this.view?.canvas.remove();
    this.view = null;
  }
}
