/** Selecting on the pictures, by pointer or by key. */

import { modeOf, updateSelection } from './selection_settings.js';

/** @import { Engine, Kind, UiStore } from '../ui_state.js' */
/** @import { Corner } from '../../engine/selection/polygon_mask.js' */
/** @import { Mode } from '../../engine/selection/mask_operations.js' */
/** @import { Part } from '../../engine/selection/selections.js' */
/** @typedef {{x: number, y: number, kind: Kind}} Place */
/** @typedef {{shiftKey: boolean, altKey: boolean}} Modifiers */

/** Pixels of the picture between corners of a lasso, and below which a drag is a click. */
const [LASSO_STEP, MIN_DRAG] = [0.7, 1];

/** Pixels from the first corner within which a lasso by key is closed. */
const CLOSING_DISTANCE = 6;

export class SelectDrag {
  /** @param {Engine} engine @param {UiStore} store */
  constructor(engine, store) {
    this.engine = engine;
    this.store = store;
    /** Whether Shift was down at the start; later it makes a square or a circle. */
    this.beganWithShift = false;
  }

  get draft() {
    return this.store.value.selection.draft;
  }

  /** Begin at a place. @param {Place} place @param {Modifiers} event
   * @returns {boolean} whether a drag follows */
  begin({ x, y, kind }, event) {
    const { shape, mode } = this.store.value.selection;
    const joined = modeOf(event, mode);
    this.store.set({ hint: false });
    if (shape === 'object' || shape === 'colour') {
      this.pick({ x, y, kind }, joined);
      return false;
    }
    this.beganWithShift = event.shiftKey;
    const corner = shape === 'lasso' ? [x, y] : [Math.round(x), Math.round(y)];
    const corners = /** @type {Corner[]} */ ([corner, corner]);
    updateSelection(this.store, { draft: { shape, corners, mode: joined } });
    return true;
  }

  /** Select the object or colour at a place. @param {Place} place @param {Mode} mode */
  pick({ x, y, kind }, mode) {
    const { shape, tolerance, feather } = this.store.value.selection;
    const object = this.engine.probe(x, y)?.index;
    if (object === undefined) return;
    /** @type {Part} */
    const part =
      shape === 'object'
        ? { kind: 'object', object }
        : { kind: 'colour', picture: kind, x, y, tolerance };
    void this.engine.selections.select(part, { mode, feather });
  }

  /** @param {{x: number, y: number}[]} places @param {Modifiers} event */
  move(places, event) {
    const { draft } = this;
    const last = places.at(-1);
    if (!draft || !last) return;
    const { shape, corners } = draft;
    if (shape !== 'lasso') {
      const isEven = event.shiftKey && !this.beganWithShift;
      const second = isEven ? evenCorner(corners[0], last) : /** @type {Corner} */ ([last.x, last.y]);
      return this.draw([corners[0], /** @type {Corner} */ (second.map(Math.round))]);
    }
    const path = [...corners];
    for (const { x, y } of places) {
      const [px, py] = path[path.length - 1];
      if (Math.hypot(x - px, y - py) >= LASSO_STEP) path.push([x, y]);
    }
    if (path.length > corners.length) this.draw(path);
  }

  /** @param {Corner[]} corners */
  draw(corners) {
    if (this.draft) updateSelection(this.store, { draft: { ...this.draft, corners } });
  }

  /** Select what was drawn. A click selects nothing. */
  end() {
    const { draft } = this;
    if (!draft) return;
    updateSelection(this.store, { draft: null });
    const { shape, corners, mode } = draft;
    const [xs, ys] = [corners.map(([x]) => x), corners.map(([, y]) => y)];
    const extent = (/** @type {number[]} */ values) => Math.max(...values) - Math.min(...values);
    const { selections } = this.engine;
    if (Math.min(extent(xs), extent(ys)) < MIN_DRAG) {
      if (mode === 'replace') selections.change({ kind: 'none' });
      return;
    }
    const { feather } = this.store.value.selection;
    const kind = /** @type {'rectangle' | 'ellipse' | 'lasso'} */ (shape);
    const part = /** @type {Part} */ ({ kind, corners });
    void selections.select(part, { mode, feather });
  }

  cancel() {
    if (this.draft) updateSelection(this.store, { draft: null });
  }

  /** Draw by key: Enter sets one corner after the other; a lasso ends near its first one, or with
   * Shift. @param {Place} place @param {boolean} isLast */
  press(place, isLast) {
    const { draft } = this;
    const { shape } = this.store.value.selection;
    if (!draft || draft.shape !== shape) {
      this.begin(place, { shiftKey: false, altKey: false });
      return;
    }
    const [first] = draft.corners;
    const isClosing =
      draft.corners.length > 3 &&
      Math.hypot(place.x - first[0], place.y - first[1]) < CLOSING_DISTANCE;
    if (!isClosing) this.move([place], { shiftKey: false, altKey: false });
    if (shape !== 'lasso' || isClosing || isLast) this.end();
  }
}

/** Return the corner of a square. @param {Corner} first @param {{x: number, y: number}} last
 * @returns {Corner} */
function evenCorner([x, y], last) {
  const side = Math.max(Math.abs(last.x - x), Math.abs(last.y - y));
  return [x + side * (Math.sign(last.x - x) || 1), y + side * (Math.sign(last.y - y) || 1)];
}
