/**
 * Mouse, pen and touch on the pictures.
 *
 * One finger paints, two pan and zoom. Space or the middle button pan; Ctrl and the wheel zoom.
 */

import { updateShow, rememberPaint, pickPaint } from './tools.js';

/** @typedef {import("./engine_interface.js").Engine} Engine */
/** @typedef {import("./engine_interface.js").Point} Point */
/** @typedef {import("./ui_state.js").UiStore} UiStore */

/** Within this time and distance a second finger cancels the stroke of the first. */
const SECOND_FINGER = { ms: 250, px: 24 };

export class Pointer {
  /** @param {Engine} engine @param {UiStore} store @param {(x: number, y: number) => void} moved
   * @param {(text: string) => void} say */
  constructor(engine, store, moved, say) {
    this.engine = engine;
    this.store = store;
    this.moved = moved;
    this.say = say;
    /** @type {Map<number, {x: number, y: number}>} */
    this.fingers = new Map();
    /** @type {null | "stroke" | "pan" | "pinch"} */
    this.doing = null;
    this.began = 0;
    this.way = 0;
    /** @type {Point | null} */
    this.last = null;
    this.isSpace = false;
    /** Whether a drag adjusts light: its label stays at the place that it started from. */
    this.isAsking = false;
  }

  /** @param {PointerEvent} event @returns {{x: number, y: number}} in CSS pixels of the pictures */
  place(event) {
    const { left, top } = this.engine.element.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }

  /**
   * Return the place in pixels of the picture, in the pane in which the stroke began.
   * @param {PointerEvent} event @returns {Point & {kind: import("./engine_interface.js").Kind} | null}
   */
  point(event) {
    const { x, y } = this.place(event);
    const pane = this.pane ?? paneAt(this.engine, x, y);
    if (!pane) return null;
    const pressure = event.pointerType === 'pen' ? event.pressure : 1;
    const [px, py] = [(x - pane.left) / pane.scale, (y - pane.top) / pane.scale];
    return { x: px, y: py, pressure, kind: pane.kind };
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (isElsewhere(this.store.value)) return;
    const place = this.place(event);
    this.fingers.set(event.pointerId, place);
    capture(event);
    if (event.pointerType === 'touch' && this.fingers.size === 2) return this.pinch(event);
    if (this.fingers.size > 1) return;
    if (event.button === 1 || this.isSpace) {
      this.doing = 'pan';
    } else if (event.button === 0) {
      this.pane = paneAt(this.engine, place.x, place.y);
      this.press(event);
    }
    event.preventDefault();
    /** @type {HTMLElement} */ (event.currentTarget).focus({ preventScroll: true });
  }

  /** @param {PointerEvent} event */
  press(event) {
    const point = this.point(event);
    const { tool } = this.store.value;
    if (!point) return;
    if (event.altKey || tool === 'pick') {
      pickPaint(this.store, this.engine.paintAt(point.kind, point.x, point.y));
      this.pane = null;
      return;
    }
    if (!this.canPaint()) return;
    rememberPaint(this.store);
    this.store.set({ hint: false });
    if (event.shiftKey && this.last && tool !== 'adjust') {
      this.engine.line(this.last, point);
      this.last = point;
      return;
    }
    this.doing = 'stroke';
    this.began = event.timeStamp;
    this.way = 0;
    this.engine.begin(point);
    this.last = point;
    this.isAsking = tool === 'adjust';
    if (this.isAsking) this.store.set({ asking: { stops: 0, mired: 0 } });
  }

  /** @param {PointerEvent} event */
  move(event) {
    const place = this.place(event);
    const before = this.fingers.get(event.pointerId);
    if (this.doing === 'pinch') this.spread(event.pointerId, place);
    if (before) this.fingers.set(event.pointerId, place);
    this.isAsking &&= this.store.value.asking !== null; // until it is cancelled
    if (!this.isAsking) this.moved(place.x, place.y);
    if (this.doing === 'pan' && before) {
      this.pan(place.x - before.x, place.y - before.y);
    } else if (this.doing === 'stroke' && before) {
      const all = event.getCoalescedEvents?.() ?? [];
      const points = (all.length ? all : [event]).map((one) => this.point(one));
      const found = /** @type {Point[]} */ (points.filter(Boolean));
      this.way += Math.hypot(place.x - before.x, place.y - before.y);
      if (found.length) this.last = found[found.length - 1];
      this.engine.move(found);
    }
  }

  /** @param {PointerEvent} event */
  up(event) {
    this.fingers.delete(event.pointerId);
    if (this.doing === 'stroke' && event.type === 'pointercancel') this.engine.cancel();
    else if (this.doing === 'stroke') this.engine.end();
    if (this.doing === 'stroke' || this.fingers.size === 0) {
      this.doing = null;
      this.pane = null;
      this.store.set({ asking: null });
      if (this.isAsking) this.moved(...xy(this.place(event)));
      this.isAsking = false;
    }
  }

  /** Do not paint on a hidden picture. */
  canPaint() {
    const { mix, show } = this.store.value;
    const { left, right } = show;
    const isShown = left === 'painting' || right === 'painting';
    const way = mix ? 'press Back to the painting' : 'compare Painting | Answer';
    if (!isShown) this.say(`The painting is not shown: ${way} to paint.`);
    return isShown;
  }

  /** Paint a dab by key, or a line from the last place to this one.
   * @param {number} x @param {number} y in CSS pixels @param {boolean} [isLine] */
  dab(x, y, isLine = false) {
    const pane = paneAt(this.engine, x, y);
    const { tool } = this.store.value;
    if (!pane || isElsewhere(this.store.value)) return;
    const point = { x: (x - pane.left) / pane.scale, y: (y - pane.top) / pane.scale, pressure: 1 };
    if (tool === 'pick')
      return pickPaint(this.store, this.engine.paintAt(pane.kind, point.x, point.y));
    if (tool === 'adjust')
      return this.say(
        'Adjust needs a drag. To type values instead, press By numbers above the pictures.',
      );
    if (!this.canPaint()) return;
    rememberPaint(this.store);
    this.store.set({ hint: false });
    if (isLine && this.last) this.engine.line(this.last, point);
    else {
      this.engine.begin(point);
      this.engine.end();
    }
    this.last = point;
  }

  /** Handle a second finger: cancel what the first began, or end it if it is a stroke already.
   * @param {PointerEvent} event */
  pinch(event) {
    if (this.doing === 'stroke') {
      const { ms, px } = SECOND_FINGER;
      if (event.timeStamp - this.began < ms || this.way < px) this.engine.cancel();
      else this.engine.end();
    }
    this.pane = null;
    this.isAsking = false;
    this.store.set({ asking: null });
    this.doing = 'pinch';
  }

  /** @param {number} id @param {{x: number, y: number}} place */
  spread(id, place) {
    const own = this.fingers.get(id);
    const other = [...this.fingers].find(([key]) => key !== id)?.[1];
    if (!own || !other) return;
    const far = (/** @type {{x: number, y: number}} */ a) =>
      Math.hypot(a.x - other.x, a.y - other.y);
    const factor = far(place) / Math.max(1, far(own));
    updateShow(
      this.store,
      this.engine.zoomAt((place.x + other.x) / 2, (place.y + other.y) / 2, factor),
    );
    this.pan((place.x - own.x) / 2, (place.y - own.y) / 2);
  }

  /** @param {number} x @param {number} y in CSS pixels */
  pan(x, y) {
    const scale = this.engine.panes()[0]?.scale ?? 1;
    const [px, py] = this.store.value.show.pan;
    updateShow(this.store, { pan: [px - x / scale, py - y / scale] });
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    const { x, y } = this.place(/** @type {any} */ (event));
    const { zoom } = this.store.value.show;
    if (event.ctrlKey || event.metaKey) {
      updateShow(this.store, this.engine.zoomAt(x, y, 2 ** (-event.deltaY / 240)));
    } else if (zoom > 1) {
      this.pan(-(event.shiftKey ? event.deltaY : event.deltaX), event.shiftKey ? 0 : -event.deltaY);
    } else {
      return;
    }
    event.preventDefault();
  }

  /** @type {import("./engine_interface.js").Pane | null} */
  pane = null;
}

/** @param {{x: number, y: number}} place @returns {[number, number]} */
const xy = ({ x, y }) => [x, y];

/** Return whether the session receives no strokes from here.
 * @param {import("./ui_state.js").Ui} ui */
const isElsewhere = ({ closed, connection }) => closed !== null || connection === 'stale';

/** @param {Engine} engine @param {number} x @param {number} y */
export function paneAt(engine, x, y) {
  return (
    [...engine.panes()]
      .reverse()
      .find(
        (pane) => x >= pane.x && x < pane.x + pane.width && y >= pane.y && y < pane.y + pane.height,
      ) ?? null
  );
}

/** @param {PointerEvent} event */
function capture(event) {
  try {
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
  } catch {
    // The pointer may have gone already.
  }
}
