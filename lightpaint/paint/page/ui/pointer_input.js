/**
 * Mouse, pen and touch on the pictures.
 *
 * One finger paints, two pan and zoom. Space or the middle button pan; Ctrl and the wheel zoom.
 */

import { SelectDrag } from './selection/select_drag.js';
import { updateDisplay, rememberPaint, pickPaint } from './tools.js';
import { t } from '../language/language.js';

/** @import { Engine, Kind, Pane, Point, Ui, UiStore } from './ui_state.js' */

/** Within this time and distance a second finger cancels the stroke of the first. */
const SECOND_FINGER_LIMITS = { ms: 250, px: 24 };

export class Pointer {
  /** @param {Engine} engine @param {UiStore} store @param {(x: number, y: number) => void} onMove
   * @param {(text: string) => void} say */
  constructor(engine, store, onMove, say) {
    this.engine = engine;
    this.store = store;
    this.onMove = onMove;
    this.say = say;
    /** @type {Map<number, {x: number, y: number}>} */
    this.fingers = new Map();
    this.selecting = new SelectDrag(engine, store);
    /** @type {null | "stroke" | "select" | "pan" | "pinch"} */
    this.gesture = null;
    /** Places of the fingers in the last frame of a pinch, while they have moved since.
     * @type {Map<number, {x: number, y: number}> | null} */
    this.spreadFrom = null;
    this.startTime = 0;
    this.pathLength = 0;
    /** @type {Point | null} */
    this.lastPoint = null;
    /** Start of a gradient that is drawn by key. @type {Point | null} */
    this.gradientStart = null;
    this.isSpaceDown = false;
    /** What the hand has done since the last `move`, where the browser tells it before the next
     * frame. @type {PointerEvent[]} */
    this.earlyEvents = [];
    this.hasEarlyEvents = false;
    engine.on('send', () => this.follow());
    /** Whether a drag adjusts light: its label stays at the place that it started from. */
    this.isAdjusting = false;
  }

  /** @param {PointerEvent} event @returns {{x: number, y: number}} in CSS pixels of the pictures */
  place(event) {
    const { left, top } = this.engine.element.getBoundingClientRect();
    return { x: event.clientX - left, y: event.clientY - top };
  }

  /** Return the place in pixels of the picture, in the pane in which the stroke began.
   * @param {PointerEvent} event @returns {Point & {kind: Kind} | null} */
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
    if (isSessionElsewhere(this.store.value)) return;
    const place = this.place(event);
    this.fingers.set(event.pointerId, place);
    capture(event);
    if (event.pointerType === 'touch' && this.fingers.size === 2) return this.pinch(event);
    if (this.fingers.size > 1) return;
    if (event.button === 1 || this.isSpaceDown) {
      this.gesture = 'pan';
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
    if (tool === 'select') {
      if (this.selecting.begin(point, event)) this.gesture = 'select';
      return;
    }
    if (event.altKey || tool === 'pick') {
      pickPaint(this.store, this.engine.paintAt(point.kind, point.x, point.y));
      this.pane = null;
      return;
    }
    if (!this.canPaint()) return;
    if (tool === 'neutral') {
      this.neutralize(point);
      this.pane = null;
      return;
    }
    rememberPaint(this.store);
    this.store.set({ hint: false });
    if (event.shiftKey && this.lastPoint && !['adjust', 'gradient'].includes(tool)) {
      this.engine.line(this.lastPoint, point);
      this.lastPoint = point;
      return;
    }
    this.gesture = 'stroke';
    this.hasEarlyEvents = false;
    this.earlyEvents = [];
    this.startTime = event.timeStamp;
    this.pathLength = 0;
    this.engine.begin(point);
    this.lastPoint = point;
    this.isAdjusting = tool === 'adjust';
    if (this.isAdjusting) this.store.set({ dragAdjustment: { stops: 0, mired: 0 } });
  }

  /** @param {PointerEvent} event */
  move(event) {
    const place = this.place(event);
    const previous = this.fingers.get(event.pointerId);
    if (this.gesture === 'pinch') this.startSpread();
    if (previous) this.fingers.set(event.pointerId, place);
    this.isAdjusting &&= this.store.value.dragAdjustment !== null; // until it is cancelled
    if (!this.isAdjusting) this.onMove(place.x, place.y);
    if (this.gesture === 'pan' && previous) {
      this.pan(place.x - previous.x, place.y - previous.y);
    } else if ((this.gesture === 'stroke' || this.gesture === 'select') && previous) {
      if (this.gesture === 'select') return this.selecting.move(this.points(samplesOf(event)), event);
      this.pathLength += Math.hypot(place.x - previous.x, place.y - previous.y);
      if (!this.hasEarlyEvents) this.earlyEvents = samplesOf(event);
      this.follow();
    }
  }

  /** Note a movement of the hand before the frame in which `move` hears of it: a message to the
   * session that leaves in between should have it. @param {PointerEvent} event */
  moveEarly(event) {
    if (this.gesture !== 'stroke' || !this.fingers.has(event.pointerId)) return;
    this.hasEarlyEvents = true;
    this.earlyEvents.push(...samplesOf(event));
  }

  /** Move the stroke to where the hand is. */
  follow() {
    const points = this.points(this.earlyEvents.splice(0));
    if (!points.length) return;
    this.lastPoint = points[points.length - 1];
    this.engine.move(points);
  }

  /** @param {PointerEvent[]} events @returns {Point[]} in the pane in which the stroke began */
  points(events) {
    return /** @type {Point[]} */ (events.map((event) => this.point(event)).filter(Boolean));
  }

  /** @param {PointerEvent} event */
  up(event) {
    this.spread();
    this.fingers.delete(event.pointerId);
    if (this.gesture === 'stroke' && event.type !== 'pointercancel') this.follow();
    if (this.gesture === 'stroke' && event.type === 'pointercancel') this.engine.cancel();
    else if (this.gesture === 'stroke') this.engine.end();
    if (this.gesture === 'select' && event.type === 'pointercancel') this.selecting.cancel();
    else if (this.gesture === 'select') this.selecting.end();
    if (this.gesture === 'stroke' || this.gesture === 'select' || this.fingers.size === 0) {
      this.gesture = null;
      this.pane = null;
      this.store.set({ dragAdjustment: null });
      if (this.isAdjusting) this.onMove(...pairOf(this.place(event)));
      this.isAdjusting = false;
    }
  }

  /** Do not paint on a hidden picture. */
  canPaint() {
    const { mix, display } = this.store.value;
    const { left, right } = display;
    const isShown = left === 'painting' || right === 'painting';
    if (!isShown)
      this.say(
        mix
          ? t('The painting is not shown: press Back to the painting to paint.')
          : t('The painting is not shown: compare Painting | Answer to paint.'),
      );
    return isShown;
  }

  /** Paint a dab by key, or a line from the last place to this one.
   * @param {number} x @param {number} y in CSS pixels @param {boolean} [isLine] */
  dab(x, y, isLine = false) {
    const pane = paneAt(this.engine, x, y);
    const { tool } = this.store.value;
    if (!pane || isSessionElsewhere(this.store.value)) return;
    const point = { x: (x - pane.left) / pane.scale, y: (y - pane.top) / pane.scale, pressure: 1 };
    if (tool === 'pick')
      return pickPaint(this.store, this.engine.paintAt(pane.kind, point.x, point.y));
    if (tool === 'select') return this.selecting.press({ ...point, kind: pane.kind }, isLine);
    if (tool === 'adjust')
      return this.say(
        t('Adjust needs a drag. To type values instead, press By numbers above the pictures.'),
      );
    if (!this.canPaint()) return;
    if (tool === 'neutral') return this.neutralize(point);
    rememberPaint(this.store);
    this.store.set({ hint: false });
    if (tool === 'gradient') return this.dabGradient(point);
    if (isLine && this.lastPoint) this.engine.line(this.lastPoint, point);
    else {
      this.engine.begin(point);
      this.engine.end();
    }
    this.lastPoint = point;
  }

  /** Make a place neutral, or say why not. @param {Point} point */
  neutralize(point) {
    this.store.set({ hint: false });
    if (!this.engine.neutralize(point))
      this.say(t('Nothing is neutral here: it is black, or has light of one colour alone.'));
  }

  /** Draw a gradient by key: Enter sets its start, then its end. @param {Point} point */
  dabGradient(point) {
    const { gradientStart } = this;
    this.gradientStart = gradientStart ? null : point;
    if (gradientStart) this.engine.line(gradientStart, point);
    else this.say(t('It begins here. Move to where it ends, and press Enter again.'));
  }

  /** Handle a second finger: cancel what the first began, or end it if it is a stroke already.
   * @param {PointerEvent} event */
  pinch(event) {
    if (this.gesture === 'stroke') {
      const { ms, px } = SECOND_FINGER_LIMITS;
      if (event.timeStamp - this.startTime < ms || this.pathLength < px) this.engine.cancel();
      else this.engine.end();
    }
    this.selecting.cancel();
    this.pane = null;
    this.isAdjusting = false;
    this.store.set({ dragAdjustment: null });
    this.gesture = 'pinch';
  }

  /** Zoom and pan by what both fingers do until the next frame: they move one after the other, and
   * the engine zooms from what is shown. */
  startSpread() {
    if (this.spreadFrom) return;
    this.spreadFrom = new Map(this.fingers);
    requestAnimationFrame(() => this.spread());
  }

  spread() {
    const ids = [...(this.spreadFrom?.keys() ?? [])].slice(0, 2);
    const before = ids.flatMap((id) => this.spreadFrom?.get(id) ?? []);
    const after = ids.flatMap((id) => this.fingers.get(id) ?? []);
    this.spreadFrom = null;
    if (before.length < 2 || after.length < 2) return;
    const measure = (/** @type {{x: number, y: number}[]} */ [a, b]) => ({
      x: (a.x + b.x) / 2,
      y: (a.y + b.y) / 2,
      length: Math.max(1, Math.hypot(a.x - b.x, a.y - b.y)),
    });
    const [from, to] = [measure(before), measure(after)];
    updateDisplay(this.store, this.engine.zoomAt(to.x, to.y, to.length / from.length));
    this.pan(to.x - from.x, to.y - from.y);
  }

  /** @param {number} x @param {number} y in CSS pixels */
  pan(x, y) {
    const scale = this.engine.panes()[0]?.scale ?? 1;
    const [px, py] = this.store.value.display.pan;
    updateDisplay(this.store, { pan: [px - x / scale, py - y / scale] });
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    const { x, y } = this.place(/** @type {any} */ (event));
    const { zoom } = this.store.value.display;
    if (event.ctrlKey || event.metaKey) {
      updateDisplay(this.store, this.engine.zoomAt(x, y, 2 ** (-event.deltaY / 240)));
    } else if (zoom > 1) {
      this.pan(-(event.shiftKey ? event.deltaY : event.deltaX), event.shiftKey ? 0 : -event.deltaY);
    } else {
      return;
    }
    event.preventDefault();
  }

  /** @type {Pane | null} */
  pane = null;
}

/** @param {{x: number, y: number}} place @returns {[number, number]} */
const pairOf = ({ x, y }) => [x, y];

/** Return whether the session receives no strokes from here.
 * @param {Ui} ui */
const isSessionElsewhere = ({ closure, connection }) => closure !== null || connection === 'stale';

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

/** @param {PointerEvent} event @returns {PointerEvent[]} what has been made one event */
function samplesOf(event) {
  const events = event.getCoalescedEvents?.() ?? [];
  return events.length ? events : [event];
}

/** @param {PointerEvent} event */
function capture(event) {
  try {
    /** @type {HTMLElement} */ (event.currentTarget).setPointerCapture(event.pointerId);
  } catch {
    // The pointer may have gone already.
  }
}
