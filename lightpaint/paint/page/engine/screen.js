/** The canvas of the pictures: its view, its size in device pixels, and when it draws. */
import { chooseView } from '../../../viewer/drawing/choose.js';
import { DEFAULTS, panes } from '../../../viewer/drawing/view.js';

/** @typedef {import("../../../viewer/drawing/view.js").PictureView} PictureView */
/** @typedef {import("../../../viewer/drawing/view.js").Params} Params */
/** @typedef {import("../../../viewer/drawing/view.js").Pane} Pane */

/** Milliseconds after which a picture that was drawn quickly is drawn sharply. */
const REST = 180;

/** Milliseconds that a GPU has to come back. */
const PATIENCE = 3000;

export class Screen {
  /** @param {HTMLElement} element
   * @param {{view?: 'gl' | 'cpu' | null, refill: () => void}} options refill: all that is shown is to
   * be set again */
  constructor(element, options) {
    this.element = element;
    this.options = options;
    /** @type {PictureView | null} */
    this.view = null;
    /** @type {[number, number]} */
    this.size = [1, 1];
    this.count = 0;
    /** @type {Params} */
    this.params = { ...DEFAULTS };
    this.width = 0;
    this.height = 0;
    this.frame = 0;
    this.isLive = false;
    /** Whether a brush is down: what takes long waits until it is lifted. */
    this.isHeld = false;
    /** Whether the solution is the present look. */
    this.isPresent = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.rest = undefined;
    /** Milliseconds that a GPU has to come back. */
    this.patience = PATIENCE;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.waiting = undefined;
  }

  /** A view of pictures of a size, and of so many lights.
   * @param {[height: number, width: number]} size @param {number} count
   * @param {'gl' | 'cpu' | null} [which] */
  begin(size, count, which = this.options.view ?? null) {
    clearTimeout(this.waiting);
    this.view?.close();
    this.view?.canvas.remove();
    this.size = size;
    this.count = count;
    const onRestored = () => this.restored(view);
    const view = chooseView(this.element, size, count, { view: which, onRestored });
    view.canvas.addEventListener('webglcontextlost', () => this.lost(view));
    this.view = view;
    this.fit();
  }

  /** The same pictures of so many lights. @param {number} count */
  setCount(count) {
    this.count = count;
    this.view?.setCount(count);
  }

  /** The GPU has gone; without it, if it does not come back. @param {PictureView} view */
  lost(view) {
    // One that is closed gives its context up, and is told so when the next one is there already.
    if (view !== this.view) return;
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => {
      this.begin(this.size, this.count, 'cpu');
      this.options.refill();
    }, this.patience);
  }

  /** @param {PictureView} view */
  restored(view) {
    if (view !== this.view) return;
    clearTimeout(this.waiting);
    view.setCount(this.count);
    this.options.refill();
  }

  /** @param {number} width @param {number} height in CSS pixels */
  resize(width, height) {
    this.width = width;
    this.height = height;
    this.fit();
  }

  /** As many pixels as the display has. */
  fit() {
    if (!this.view) return;
    const { canvas } = this.view;
    canvas.style.display = 'block';
    canvas.style.width = `${this.width}px`;
    canvas.style.height = `${this.height}px`;
    const [width, height] = [this.width, this.height].map((n) =>
      Math.max(1, Math.round(n * this.ratio)),
    );
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    this.now();
  }

  /** Device pixels for each CSS pixel. */
  get ratio() {
    return Math.max(1, window.devicePixelRatio || 1);
  }

  /** In device pixels. @returns {Pane[]} */
  panes() {
    const [width, height] = [this.width * this.ratio, this.height * this.ratio].map(Math.round);
    return panes(this.params, { width, height }, this.size);
  }

  /** Draw soon. isLive: and once more, sharply, when nothing has come for a while.
   * @param {boolean} [isLive] */
  request(isLive = false) {
    if (isLive) {
      this.isLive = true;
      this.wait();
    }
    this.frame ||= requestAnimationFrame(() => this.now());
  }

  /** Draw sharply after a while. */
  wait() {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => {
      if (this.isHeld) return this.wait();
      this.isLive = false;
      this.request();
    }, REST);
  }

  now() {
    cancelAnimationFrame(this.frame);
    this.frame = 0;
    const { left, right } = this.params;
    const shown = { left: this.standIn(left), right: this.standIn(right) };
    this.view?.draw({ ...this.params, ...shown, live: this.isLive });
  }

  /** The picture that is shown for another. @param {import('../../../viewer/drawing/view.js').Kind} kind */
  standIn(kind) {
    return kind === 'solution' && this.isPresent ? 'present' : kind;
  }

  close() {
    clearTimeout(this.rest);
    clearTimeout(this.waiting);
    cancelAnimationFrame(this.frame);
    this.view?.close();
    this.view?.canvas.remove();
    this.view = null;
  }
}
