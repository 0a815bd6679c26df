/**
 * Sends the changed pixels of strokes to the session, one message at a time.
 *
 * Changes in the meantime go with the next message. A finished stroke is kept until the session
 * confirms it, and sent again as a whole after a lost connection.
 */
import { union } from '../../../viewer/drawing/cpu_picture.js';
import { plainLayer } from './layers/layer_list.js';

/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { Arrays } from './message_frames.js' */
/** @import { PaintCanvas } from './paint_canvas.js' */
/** @import { ChangeLayers, Layer, Requests, Select } from './messages.js' */


/** The stroke in progress. canvas: the pixels that it paints. layerOf: returns their layer; null for
 * the painting that is always there. dirty: region not sent yet. wholeRegion: region of the stroke.
 * @typedef {{stroke: number, view: number, canvas: PaintCanvas, layerOf: () => Layer | null,
 *   dirty: Region | null, wholeRegion: Region | null, isKnown: boolean}} CurrentStroke */
/** A finished or cancelled stroke, or a change of layers or of the selection, without an answer yet.
 * cutRegion: region to send.
 * @typedef {{stroke: number, view: number, cutRegion: Region, wholeRegion: Region, arrays: Arrays,
 *   label: string, layer: Layer | null} | {stroke: number, isDropped: true} |
 *   {change: ChangeLayers, isSent: boolean} | PendingSelection} PendingStroke */
/** onAnswer: hears whether the session has taken it.
 * @typedef {{select: Select, arrays: Arrays, onAnswer: (isTaken: boolean) => void}} PendingSelection */

export class StrokeSender {
  /** Returns whether answers to paint are to have drafts. @type {() => boolean} */
  wantsDrafts = () => false;

  /** Called before changes of the stroke in progress are sent; may bring further ones. */
  onBeforeSend = () => {};

  /** @param {import("./socket_host.js").Host} host
   * @param {() => void} [onRefusal] hears that the session has not taken a stroke
   * @param {(count: number, isStale: boolean) => void} [onLoss] hears how many strokes are not sent
   * any more, since another page had the session in between; stale: since it is there no more */
  constructor(host, onRefusal = () => {}, onLoss = () => {}) {
    this.host = host;
    /** @type {PaintCanvas | null} */
    this.canvas = null;
    this.view = 0;
    this.onRefusal = onRefusal;
    this.onLoss = onLoss;
    this.count = 0;
    /** @type {CurrentStroke | null} */
    this.currentStroke = null;
    /** @type {PendingStroke[]} */
    this.pendingStrokes = [];
    this.isBusy = false;
    this.isCollecting = false;
    /** Whether a slider of a layer moves. */
    this.isSliding = false;
    /** @type {ChangeLayers} */
    this.lastChange = {};
    /** Called once everything is answered. */
    this.onSettled = () => {};
    this.isOpen = true;
    this.isOver = false;
    /** Whether painting is impossible: another page has the session, or it has ended. */
    this.isSessionLost = false;
    /** @type {(() => void)[]} */
    this.waiters = [];
    /** Whether the next patch belongs to a stroke that the canvas has cancelled already. */
    this.isDropping = false;
    this.onPageHide = () => this.flush();
    addEventListener('pagehide', this.onPageHide);
    host.gate = () => this.settle();
    host.on('connection', ({ state }) => {
      this.setConnected(state === 'open');
      if (state === 'stale') {
        this.isSessionLost = true;
        this.dropUnsent(true);
      }
    });
    // Pause: another page has the session.
    host.on('closed', () => {
      this.isSessionLost = true;
      this.setConnected(false);
    });
    host.on('state', ({ is_back: isBack }) => {
      this.isSessionLost = false;
      if (isBack === false) this.dropUnsent();
    });
    host.on('state', ({ stroke }) => {
      this.count = Math.max(this.count, Number(stroke) || 0);
    });
  }

  /** StrokeSender are of this picture from now on. @param {PaintCanvas} canvas @param {number} view */
  paintOn(canvas, view) {
    this.canvas = canvas;
    this.view = view;
  }

  /** Drop unsent strokes: they would overwrite what another page has painted meanwhile, or nobody
   * would receive them. */
  dropUnsent(isStale = false) {
    const count =
      this.pendingStrokes.filter(isLoss).length + (this.currentStroke?.wholeRegion ? 1 : 0);
    for (const pending of this.pendingStrokes) if ('select' in pending) pending.onAnswer(false);
    this.pendingStrokes = [];
    this.currentStroke = null;
    this.isSliding = false;
    this.resolveWaiting();
    if (count) this.onLoss(count, isStale);
  }

  /** Stop sending. */
  close() {
    this.isOver = true;
    this.pendingStrokes = [];
    removeEventListener('pagehide', this.onPageHide);
    this.resolveWaiting();
  }

  /** The page closes: send finished strokes now, without waiting for answers. */
  flush() {
    if (!this.isOpen || this.isOver) return;
    for (const pending of this.pendingStrokes) {
      // Earlier messages have arrived already.
      if ('cutRegion' in pending)
        this.host.send('paint', paintFields(pending), cutArrays(pending)).catch(() => {});
      else if ('change' in pending && !pending.isSent && isLoss(pending))
        this.host.send('change_layers', pending.change).catch(() => {});
      else if ('select' in pending)
        this.host.send('select', pending.select, pending.arrays).catch(() => {});
    }
  }

  /** Return whether parts of a stroke are pending. */
  get isPending() {
    const isUnfinished = this.isSliding || this.currentStroke !== null;
    return this.isBusy || isUnfinished || this.pendingStrokes.length > 0;
  }

  /** Resolve once all finished strokes are answered. @returns {Promise<void>} */
  settle() {
    return new Promise((resolve) => {
      this.waiters.push(resolve);
      this.resolveWaiting();
    });
  }

  resolveWaiting() {
    if (!this.pendingStrokes.length) for (const resolve of this.waiters.splice(0)) resolve();
  }

  /** Begin a stroke. @param {PaintCanvas | null} [canvas] the pixels that it paints
   * @param {() => Layer | null} [layerOf] returns their layer */
  begin(canvas = this.canvas, layerOf = () => null) {
    if (!canvas) return;
    const regions = { dirty: null, wholeRegion: null };
    const { view } = this;
    this.currentStroke = {
      ...{ stroke: ++this.count, view, canvas, layerOf },
      ...regions,
      isKnown: false,
    };
  }

  /** Send a change of layers, in the order of the strokes. @param {ChangeLayers} change */
  change(change) {
    this.isSliding = change.is_final === false;
    this.lastChange = change;
    const last = this.pendingStrokes[this.pendingStrokes.length - 1];
    // While a slider moves, only its newest place is sent.
    if (last && 'change' in last && !last.isSent && !isLoss(last)) this.pendingStrokes.pop();
    this.pendingStrokes.push({ change, isSent: false });
    this.pump();
  }

  /** Send what is selected, in the order of the strokes. @param {Select} select
   * @param {Arrays} arrays its mask @param {(isTaken: boolean) => void} onAnswer */
  select(select, arrays, onAnswer) {
    this.pendingStrokes.push({ select, arrays, onAnswer });
    this.pump();
  }

  /** Queue changed pixels of the stroke. @param {Region} region */
  touch(region) {
    if (!this.currentStroke || region[0] >= region[1] || region[2] >= region[3]) return;
    this.currentStroke.dirty = union(this.currentStroke.dirty, region);
    this.currentStroke.wholeRegion = union(this.currentStroke.wholeRegion, region);
    this.pump();
  }

  /** Send the properties of the stroke's layer, which have changed without its pixels. */
  touchLayer() {
    const { currentStroke } = this;
    if (!currentStroke?.wholeRegion) return;
    const [top, , left] = currentStroke.wholeRegion;
    currentStroke.dirty ??= [top, top, left, left];
    this.pump();
  }

  /** Finish the stroke. @param {string} label what undo calls it
   * @param {Layer | null} [layer] of its pixels */
  end(label, layer = null) {
    const { currentStroke } = this;
    this.currentStroke = null;
    if (currentStroke?.wholeRegion) {
      const { stroke, view, wholeRegion, canvas } = currentStroke;
      const cutRegion =
        currentStroke.dirty ??
        /** @type {Region} */ ([wholeRegion[0], wholeRegion[0], wholeRegion[2], wholeRegion[2]]);
      this.pendingStrokes.push({
        stroke,
        view,
        cutRegion,
        wholeRegion,
        arrays: canvas.copy(wholeRegion),
        label,
        layer,
      });
    }
    this.pump();
  }

  /** Cancel the stroke; the canvas has done so already. */
  drop() {
    const { currentStroke } = this;
    this.currentStroke = null;
    if (currentStroke?.isKnown)
      this.pendingStrokes.push({ stroke: currentStroke.stroke, isDropped: true });
    this.pump();
  }

  /** @param {boolean} isOpen */
  setConnected(isOpen) {
    this.isOpen = isOpen;
    if (!isOpen) {
      // It is unknown which of them arrived.
      for (const stroke of this.pendingStrokes) {
        if ('cutRegion' in stroke) stroke.cutRegion = stroke.wholeRegion;
        if ('change' in stroke) stroke.isSent = false;
      }
      if (this.currentStroke) this.currentStroke.dirty = this.currentStroke.wholeRegion;
    }
    this.pump();
  }

  /** Send the next message, unless one is pending. */
  pump() {
    if (this.isBusy || !this.isOpen || this.isOver) return;
    if (this.currentStroke && !this.isCollecting) {
      this.isCollecting = true;
      this.onBeforeSend();
      this.isCollecting = false;
      if (this.isBusy) return; // these have been sent already
    }
    const [next] = this.pendingStrokes;
    if (next && 'isDropped' in next) this.send('drop_stroke', { stroke: next.stroke }, {}, next);
    else if (next && 'change' in next) {
      next.isSent = true;
      this.send('change_layers', next.change, {}, next);
    } else if (next && 'select' in next) this.send('select', next.select, next.arrays, next);
    else if (next)
      this.send('paint', { ...paintFields(next), with_draft: this.wantsDrafts() }, cutArrays(next), next);
    else if (this.currentStroke?.dirty) {
      const { stroke, view, dirty, canvas, layerOf } = this.currentStroke;
      this.currentStroke.dirty = null;
      this.currentStroke.isKnown = true;
      const fields = {
        ...{ stroke, view, region: dirty, is_final: false, with_draft: this.wantsDrafts() },
        ...layerFields(layerOf()),
      };
      this.send('paint', fields, canvas.copy(dirty), null);
    }
  }

  /** @template {"paint" | "drop_stroke" | "change_layers" | "select"} K @param {K} kind
   * @param {Requests[K]} fields @param {Arrays} arrays
   * @param {PendingStroke | null} pending what is answered with it */
  async send(kind, fields, arrays, pending) {
    this.isBusy = true;
    this.isDropping = kind === 'drop_stroke';
    try {
      const reply = await this.host.send(kind, fields, arrays);
      if (pending && reply.kind !== 'closed')
        this.pendingStrokes = this.pendingStrokes.filter((stroke) => stroke !== pending);
      if (pending && 'select' in pending && reply.kind !== 'closed')
        pending.onAnswer(reply.kind !== 'failed');
      else if (pending && reply.kind === 'failed') this.onRefusal();
    } catch {
      // Pause after a lost connection, until `connected` is called.
      this.isOpen = false;
    }
    this.isBusy = false;
    this.isDropping = false;
    this.resolveWaiting();
    this.pump();
    if (!this.isPending) this.onSettled();
  }
}

/** Return whether something that somebody did is lost with it. @param {PendingStroke} pending */
const isLoss = (pending) =>
  'cutRegion' in pending || ('change' in pending && pending.change.is_final !== false);

/** @param {Layer | null} layer */
const layerFields = (layer) => (layer ? { layer: layer.id, properties: plainLayer(layer) } : {});

/** Return the fields of a finished stroke.
 * @param {Extract<PendingStroke, {cutRegion: Region}>} stroke */
function paintFields({ stroke, view, cutRegion, label, layer }) {
  return { stroke, view, region: cutRegion, is_final: true, label, ...layerFields(layer) };
}

/** Return the pixels of a finished stroke that have to be sent.
 * @param {{cutRegion: Region, wholeRegion: Region, arrays: Arrays}} stroke @returns {Arrays} */
function cutArrays({ cutRegion, wholeRegion, arrays }) {
  const [height, width] = [cutRegion[1] - cutRegion[0], cutRegion[3] - cutRegion[2]];
  if (cutRegion === wholeRegion) return arrays;
  const rowLength = wholeRegion[3] - wholeRegion[2];
  /** @type {Arrays} */
  const parts = {};
  for (const [name, { data, shape }] of Object.entries(arrays)) {
    const channels = shape[2] ?? 1;
    const part = new Float32Array(height * width * channels);
    for (let y = 0; y < height; y++) {
      const start =
        ((cutRegion[0] - wholeRegion[0] + y) * rowLength + cutRegion[2] - wholeRegion[2]) *
        channels;
      part.set(data.subarray(start, start + width * channels), y * width * channels);
    }
    parts[name] = { data: part, shape: [height, width, ...shape.slice(2)] };
  }
  return parts;
}
