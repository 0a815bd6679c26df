/**
 * The page's copy of the session: painting, weights and pictures, kept up to date by its messages.
 */
import { PaintCanvas } from './paint_canvas.js';
import { union } from '../../../viewer/drawing/cpu_picture.js';
import { PictureLoader } from './picture_loader.js';
import { SRGB, lutOf } from '../../../viewer/drawing/view_transform.js';
import { VERSION, inView, stateOfView } from './message_frames.js';
import { showsPresent, sizes, wantedPictures } from './picture_slots.js';
import { StrokeSender } from './stroke_sender.js';

/** @typedef {import("./socket_host.js").Host} Host */
/** @typedef {import("./message_frames.js").Message} Message */
/** @typedef {import("./message_frames.js").Picture} Picture */
/** @typedef {import("./message_frames.js").Region} Region */
/** @typedef {import("./message_frames.js").RGB} RGB */
/** @typedef {import("./picture_canvas.js").Screen} Screen */
/** @typedef {import("./picture_slots.js").Show} Show */

export class SessionMirror {
  /** @param {Host} host @param {Screen} screen
   * @param {(kind: string, event: any) => void} emit */
  constructor(host, screen, emit) {
    this.host = host;
    this.screen = screen;
    this.emit = emit;
    this.loader = new PictureLoader(
      host,
      (slot, name, picture) => this.takePicture(slot, name, picture),
      (done, total, isFirst) => emit('loading', { done, total, isFirst }),
    );
    /** The last state from the session, and its part for the current view.
     * @type {Message | null} */
    this.latestState = null;
    /** @type {Message | null} */
    this.state = null;
    /** Index of the current view. */
    this.view = 0;
    /** @type {PaintCanvas | null} */
    this.canvas = null;
    /** @type {StrokeSender | null} */
    this.strokes = null;
    /** @type {Show | null} */
    this.shown = null;
    this.weights = new Float64Array();
    /** Whether lights have moved since the current look. */
    this.isMoved = false;
    /** Revision of the session in its last message. */
    this.version = -1;
    /** @type {import("../../../viewer/drawing/view_transform.js").Lut} */
    this.lut = SRGB;
    /** Whether the current look exists, and whether the view has it. */
    this.knowsPresent = false;
    this.hasPresent = false;
    /** Number of times that the session has sent the canvas. */
    this.patches = 0;
    /** Whether the canvas equals the session's. */
    this.isReady = false;
    /** Whether a stroke is in progress. */
    this.isPainting = false;
    host.on('state', (message) => this.begin(message));
    host.on('answer', (message) => this.takeAnswer(message));
    host.on('patch', (message) => this.patched(message));
    host.on('closed', () => this.loader.hold());
    host.on('renewed', ({ resources }) => {
      this.loader.know(resources);
      this.want();
    });
    host.on('verified', ({ view = 0 }) => this.loader.renew(inView('verified', view)));
    host.on('explained', ({ view = 0 }) => this.loader.renew(inView('beyond', view)));
  }

  /** @param {Message} state */
  begin(state) {
    this.version = -1;
    this.open(state, this.view);
    this.mix(state);
    this.loader.begin(state.resources);
    this.want();
    if (this.loader.there.has('present')) this.sync();
  }

  /** Show another view. @param {number} view */
  showView(view) {
    const { latestState } = this;
    if (!latestState?.views?.[view] || view === this.view) return;
    // This is not the first state: later changes have to be requested.
    this.open({ ...latestState, first: false }, view);
    this.weigh();
    this.want();
  }

  /** @param {Message} message @param {number} view */
  open(message, view) {
    const previous = this.state;
    const state = stateOfView(message, view);
    const isOther = !previous || !this.latestState || sizes(this.latestState) !== sizes(message);
    const isSame = !isOther && this.view === view;
    this.latestState = message;
    this.state = state;
    this.view = view;
    if (isSame) {
      if (previous?.lights.length !== state.lights.length) this.setLights(state.lights.length);
      return;
    }
    const [height, width] = /** @type {[number, number]} */ (state.size);
    this.screen.begin([height, width], state.lights.length, this.screen.view?.name);
    this.canvas = new PaintCanvas([height, width], new Uint16Array(3 * height * width));
    if (isOther || !this.strokes) {
      const refused = () => this.host.send('hello', { version: VERSION }).catch(() => {});
      this.strokes?.close();
      const reportLoss = (/** @type {number} */ count, /** @type {boolean} */ isStale) =>
        this.emit('lost', { count, isStale });
      this.strokes = new StrokeSender(this.host, refused, reportLoss);
      this.strokes.count = Math.max(0, Number(state.stroke) || 0);
    }
    this.strokes.paintOn(this.canvas, view);
    this.isReady = false;
    this.knowsPresent = false;
    this.loader.forget();
    this.setLut(this.lut);
  }

  /** Lights were added or removed: keep the painting and fetch all planes again.
   * @param {number} count */
  setLights(count) {
    const { loader, screen } = this;
    for (let k = count; k < screen.count; k++) loader.want([[`plane ${k}`, null]]);
    screen.setCount(count);
    this.refill();
  }

  /** Take the weights of an answer or a patch, unless a later message has arrived already.
   * @param {Message} message */
  takeAnswer(message) {
    if (message.version < this.version) return;
    this.version = message.version ?? this.version;
    this.mix(message);
  }

  /** Weights that come with a message. @param {Message} message */
  mix(message) {
    const { poses, added_lights: addedLights } = message;
    if (poses && addedLights) this.isMoved = Object.keys(poses).length + addedLights.length > 0;
    else if (poses) this.isMoved ||= Object.keys(poses).length > 0;
    const weights = message.arrays?.weights?.data;
    if (!weights) return;
    this.weights = Float64Array.from(weights);
    this.weigh();
    // The exact answer comes when the brush rests, and should be drawn sharply.
    this.screen.request(!message.exact);
  }

  /** @param {Message} message */
  patched(message) {
    const { canvas, strokes } = this;
    this.takeAnswer(message);
    const { image, importance } = message.arrays;
    const isOwn = strokes?.isDropping;
    if (strokes) strokes.isDropping = false;
    if (!canvas || !image || !importance || isOwn) return;
    const { view = 0, views = [] } = message;
    if (view !== this.view) {
      // Show the view in which undo changed something.
      if (views.length && !views.includes(this.view)) this.emit('view', { view });
      return;
    }
    const region = /** @type {Region} */ (message.region);
    this.patches++;
    canvas.set(
      region,
      /** @type {Float32Array} */ (image.data),
      /** @type {Float32Array} */ (importance.data),
    );
    this.redraw([region]);
  }

  /** Replace the canvas by the session's, once it has all strokes. */
  async sync() {
    const { canvas, strokes } = this;
    if (!canvas || !strokes) return;
    await strokes.settled();
    if (strokes.isPending) return;
    const [{ count }, { patches }] = [strokes, this];
    try {
      const [image, importance] = await Promise.all(
        ['painting', 'importance'].map((name) => this.host.fetch(inView(name, this.view))),
      );
      // Paint or undo since then is newer.
      if (strokes.isPending || canvas !== this.canvas) return;
      if (strokes.count !== count || this.patches !== patches) {
        if (!this.isReady) this.sync();
        return;
      }
      canvas.set(
        canvas.whole,
        /** @type {Float32Array} */ (image.data),
        /** @type {Float32Array} */ (importance.data),
      );
      this.isReady = true;
      this.redraw([canvas.whole]);
    } catch (error) {
      // A page without the session has been told so already.
      if (this.loader.isHeld) return;
      this.emit('trouble', { text: error instanceof Error ? error.message : String(error) });
    }
  }

  /** Tell the loader which pictures to keep up to date. */
  want() {
    const { state, shown, loader, view } = this;
    if (!state) return;
    loader.want(wantedPictures(state.lights.length, shown, view, loader.resources));
    if ((shown?.transform ?? 'srgb') === 'srgb') this.setLut(SRGB);
  }

  /** @param {string} slot @param {string} name @param {Picture} picture */
  takePicture(slot, name, picture) {
    const { view } = this.screen;
    const { canvas, state } = this;
    if (!view || !canvas || !state) return;
    const { data } = picture;
    if (slot.startsWith('plane ')) {
      const light = Number(slot.slice(6));
      if (light >= state.lights.length) return;
      view.setPlane(light, /** @type {Uint16Array} */ (data), state.lights[light].scale ?? 1);
    } else if (slot === 'lut') this.setLut(lutOf(name.slice(4), picture, state.lut));
    else if (slot === 'present') this.setPresent(/** @type {Uint16Array} */ (data));
    else if (slot === 'albedo') canvas.albedo = /** @type {Uint16Array} */ (data);
    else if (slot === 'objects') canvas.objects = /** @type {Int16Array} */ (data);
    else if (slot === 'verified') view.setPicture('verified', /** @type {Uint16Array} */ (data));
    else if (slot === 'beyond') view.setBeyond(/** @type {Uint8Array} */ (data));
    this.screen.request();
  }

  /** @param {Uint16Array} present */
  setPresent(present) {
    const { canvas, state } = this;
    if (!canvas || !state) return;
    canvas.setPresent(present);
    this.knowsPresent = true;
    this.weigh();
    this.showPresent();
    if (!this.isReady && state.first) this.isReady = true;
    else if (!this.isReady) this.sync();
    this.redraw([canvas.whole]);
  }

  /** @param {import("../../../viewer/drawing/view_transform.js").Lut} lut */
  setLut(lut) {
    this.lut = lut;
    this.screen.view?.setLut(lut);
  }

  /** Set all pictures again, in a new view or one that has lost them. */
  refill() {
    this.setLut(this.lut);
    this.weigh();
    this.showPresent();
    if (this.canvas) this.redraw([this.canvas.whole]);
    this.loader.forget(
      (slot) => slot.startsWith('plane ') || slot === 'verified' || slot === 'beyond',
    );
    this.want();
  }

  /** @param {Show} show */
  show(show) {
    const previous = this.shown;
    this.shown = show;
    this.screen.params = { ...show, live: false };
    if (previous?.transform !== show.transform || previous?.clean !== show.clean) this.want();
    this.weigh();
    if (showsPresent(show) !== showsPresent(previous)) this.showPresent();
    this.screen.request();
  }

  /** Tell the view which weights are shown. */
  weigh() {
    const { view } = this.screen;
    if (!view || !this.state) return;
    const { gains = null, instead = null, other = null } = this.shown ?? {};
    const weights = Float64Array.from(instead?.flat() ?? this.weights);
    if (gains) weights.forEach((weight, i) => (weights[i] = gains[Math.floor(i / 3)] ? weight : 0));
    if (weights.length === 3 * this.state.lights.length) view.setWeights(weights);
    if (other) view.setWeights(Float64Array.from(other.flat()), 'other');
    this.stand(weights);
  }

  /** Unchanged lights give the current look, which arrives before the planes and is denoised.
   * @param {Float64Array} weights */
  stand(weights) {
    const { screen, canvas, state, shown } = this;
    const present =
      state?.lights.flatMap((/** @type {{present: number[]}} */ light) => light.present) ?? [];
    const isClean = shown?.clean ?? true;
    const isPresent =
      isClean &&
      !this.isMoved &&
      weights.every((weight, i) => Math.abs(weight - present[i]) <= 1e-9 * present[i]);
    screen.isPresent = isPresent && this.knowsPresent;
    if (screen.isPresent !== this.hasPresent && canvas) this.showPresent();
  }

  /** Give the view the current look while it is shown. */
  showPresent() {
    const { screen, canvas, shown } = this;
    const isShown = screen.isPresent || showsPresent(shown);
    this.hasPresent = screen.isPresent;
    screen.view?.setPicture('present', isShown && canvas ? canvas.present : null);
  }

  /** @param {Region[]} regions */
  redraw(regions) {
    const { canvas } = this;
    const region = regions.reduce((a, b) => /** @type {Region} */ (union(a, b)), regions[0]);
    if (!canvas || !region) return;
    this.screen.view?.setCanvas(region, canvas.image, canvas.importance);
    this.screen.request(this.isPainting);
  }
}
