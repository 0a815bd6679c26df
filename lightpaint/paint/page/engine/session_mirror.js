/**
 * The page's copy of the session: painting, weights and pictures, kept up to date by its messages.
 */

import { LayerMirror } from './layers/layer_mirror.js';
import { PaintCanvas } from './paint_canvas.js';
import { PictureLoader } from './picture_loader.js';
import { PictureState } from './picture_state.js';
import { lutOf } from '../../../viewer/drawing/lattice.js';
import { SRGB } from '../../../viewer/drawing/view_transform.js';
import { VERSION, nameInView, stateOfView } from './message_frames.js';
import { COMPARED_COUNT, showsPresent, sizesText, wantedPictures } from './picture_slots.js';
import { SOLUTION_SLOT } from './session_mixes.js';
import { StrokeSender } from './stroke_sender.js';
import { repeatPixels } from '../../../viewer/drawing/coarse_planes.js';

/** @import { Host } from './socket_host.js' */
/** @import { Message } from './message_frames.js' */
/** @import { Picture } from '../../../viewer/drawing/lattice.js' */
/** @import { Region } from '../../../viewer/drawing/view.js' */
/** @import { Screen } from './picture_canvas.js' */
/** @import { Display } from './picture_slots.js' */

export class SessionMirror extends PictureState {
  /** @param {Host} host @param {Screen} screen
   * @param {(kind: string, event: any) => void} emit */
  constructor(host, screen, emit) {
    super(screen, host);
    this.host = host;
    this.emit = emit;
    this.loader = new PictureLoader(
      host,
      (slot, name, picture, isLive) => this.takePicture(slot, name, picture, isLive),
      (done, total, isFirst) => emit('loading', { done, total, isFirst }),
    );
    /** The last state from the session, of all views. @type {Message | null} */
    this.latestState = null;
    /** Index of the current view. */
    this.view = 0;
    /** @type {StrokeSender | null} */
    this.strokes = null;
    this.layers = new LayerMirror(host, {
      redraw: (region) => this.redraw([region]),
      onChange: () => this.announceLayers(),
      onError: (text) => this.emit('trouble', { text }),
    });
    /** @type {import("./selection/selections.js").Selections | null} */
    this.selections = null;
    /** Revision of the session in its last message. */
    this.version = -1;
    this.drafts = new LightDrafts(this.loader);
    /** Number of times that the session has sent the canvas. */
    this.patchCount = 0;
    /** Whether the canvas equals the session's. */
    this.isReady = false;
    /** Whether the view has planes for compared looks; it keeps them. */
    this.hasLookPlanes = false;
    host.on('state', (message) => this.begin(message));
    host.on('answer', (message) => {
      this.drafts.show();
      this.takeAnswer(message);
      if (!message.layers) return;
      this.layers.remember(message.layers);
      if (!this.strokes?.isPending) this.layers.adopt(false);
    });
    host.on('patch', (message) => this.takePatch(message));
    host.on('closed', () => this.loader.pause());
    host.on('renewed', ({ resources }) => {
      this.loader.addResources(resources);
      this.requestPictures();
      const isOfLight = Object.keys(resources).some((name) => name.startsWith('plane/'));
      if (this.hasMixes && isOfLight) this.mixes.renew();
    });
    host.on('dragged', (draft) => {
      const isShown = draft.view === this.view && this.loader.wantedNames.has(`plane ${draft.light}`);
      if (isShown) this.drafts.add(draft, this.screen.planeSize);
      else this.loader.addResources(draft.resources);
    });
    host.on('verified', ({ view = 0 }) => this.loader.renew(nameInView('verified', view)));
    host.on('explained', ({ view = 0 }) => this.loader.renew(nameInView('beyond', view)));
  }

  /** @param {Message} state */
  begin(state) {
    this.version = -1;
    this.drafts.clear();
    this.layers.remember(state.layers);
    this.open(state, this.view);
    const isOther = state.is_back === false;
    if (isOther || !this.strokes?.isPending) this.layers.adopt(isOther);
    this.takeWeights(state);
    if (this.hasMixes) this.mixes.renew();
    this.loader.begin(state.resources);
    this.requestPictures();
    if (this.loader.loadedVersions.has('present')) this.sync();
  }

  /** Show another view. @param {number} view */
  showView(view) {
    const { latestState } = this;
    if (!latestState?.views?.[view] || view === this.view) return;
    // This is not the first state: later changes have to be requested.
    this.open({ ...latestState, first: false }, view);
    this.showWeights();
    this.requestPictures();
  }

  /** @param {Message} message @param {number} view */
  open(message, view) {
    const { state: previous } = this;
    const state = stateOfView(message, view);
    const hasOtherSizes =
      !previous || !this.latestState || sizesText(this.latestState) !== sizesText(message);
    const isSame = !hasOtherSizes && this.view === view;
    this.latestState = message;
    this.state = state;
    this.view = view;
    if (isSame) {
      if (previous?.lights.length !== state.lights.length) this.setPlanes();
      return;
    }
    const [height, width] = /** @type {[number, number]} */ (state.size);
    const planeSize = /** @type {[number, number]} */ (state.planeSize ?? state.size);
    this.screen.begin([height, width], this.planeCount, this.screen.view?.name, planeSize);
    this.canvas = new PaintCanvas([height, width], new Uint16Array(3 * height * width));
    if (hasOtherSizes || !this.strokes) {
      const requestState = () => {
        this.layers.distrustPixels();
        this.host.send('hello', { version: VERSION }).catch(() => {});
      };
      this.strokes?.close();
      const reportLoss = (/** @type {number} */ count, /** @type {boolean} */ isStale) =>
        this.emit('lost', { count, isStale });
      this.strokes = new StrokeSender(this.host, requestState, reportLoss);
      this.strokes.count = Math.max(0, Number(state.stroke) || 0);
      this.strokes.onSettled = () => this.layers.adopt(false);
      this.strokes.wantsDrafts = () => this.wantsDrafts;
      this.strokes.onBeforeSend = () => this.emit('send', {});
    }
    this.strokes.paintOn(this.canvas, view);
    this.layers.open(this.canvas, view);
    this.selections?.mirror.open([height, width], view);
    this.isReady = false;
    this.knowsPresent = false;
    this.loader.forget();
    this.mixes.forget();
    this.mixes.setDetail(null);
    this.setLut(this.lut);
  }

  /** Number of planes of the view. */
  get planeCount() {
    return this.mixedCount + (this.hasLookPlanes ? COMPARED_COUNT : 0);
  }

  /** @override */
  get lacksLights() {
    if (this.hasMixes) return false;
    const { loadedVersions } = this.loader;
    const lights = /** @type {any[]} */ (this.state?.lights ?? []);
    return lights.some((_, k) => !loadedVersions.has(`plane ${k}`));
  }

  /** The number of planes has changed: keep the painting and fetch all planes again. */
  setPlanes() {
    const { loader, screen } = this;
    const count = this.mixedCount;
    for (let k = count; k < screen.count; k++) loader.setWanted([[`plane ${k}`, null]]);
    screen.setCount(this.planeCount);
    this.refill();
  }

  /** Take the weights of an answer or a patch, unless a later message has arrived already.
   * @param {Message} message */
  takeAnswer(message) {
    if (message.version < this.version) return;
    this.version = message.version ?? this.version;
    this.takeWeights(message);
  }

  /** @param {Message} message */
  takePatch(message) {
    const { canvas, strokes } = this;
    this.takeAnswer(message);
    const { image, importance } = message.arrays;
    const isOwnDrop = strokes?.isDropping;
    if (strokes) strokes.isDropping = false;
    this.layers.remember(message.layers);
    if (!canvas || !image || !importance || isOwnDrop) return;
    this.layers.adopt(true);
    const { view = 0, views = [] } = message;
    if (view !== this.view) {
      // Show the view in which undo changed something.
      if (views.length && !views.includes(this.view)) this.emit('view', { view });
      return;
    }
    const region = /** @type {Region} */ (message.region);
    this.patchCount++;
    this.setPainting(region, image, importance);
    this.redraw([region]);
  }

  /** Replace the canvas by the session's, once it has all strokes. */
  async sync() {
    const { canvas, strokes } = this;
    if (!canvas || !strokes) return;
    await strokes.settle();
    if (strokes.isPending) return;
    const [{ count }, { patchCount }] = [strokes, this];
    try {
      const [image, importance] = await Promise.all(
        ['painting', 'importance'].map((name) => this.host.fetch(nameInView(name, this.view))),
      );
      await this.layers.waitForPixels();
      // Paint or undo since then is newer.
      if (strokes.isPending || canvas !== this.canvas) return;
      if (strokes.count !== count || this.patchCount !== patchCount) {
        if (!this.isReady) this.sync();
        return;
      }
      this.setPainting(canvas.wholeRegion, image, importance);
      this.isReady = true;
      this.redraw([canvas.wholeRegion]);
    } catch (error) {
      // A page without the session knows that already.
      if (this.loader.isPaused) return;
      this.emit('trouble', { text: error instanceof Error ? error.message : String(error) });
    }
  }

  /** Replace a region of the painting by the session's values. @param {Region} region
   * @param {Picture} image @param {Picture} importance */
  setPainting(region, { data: image }, { data: importance }) {
    const { canvas, layers } = this;
    const target = layers.isPlain ? canvas : layers.picture;
    target?.set(
      region,
      /** @type {Float32Array} */ (image),
      /** @type {Float32Array} */ (importance),
    );
  }

  /** @override */
  get drawnPainting() {
    return this.layers.picture ?? this.canvas;
  }

  /** Announce that the list of layers has changed, or which of them is active. */
  announceLayers() {
    this.emit('layers', {});
    // Layers lie on the current look in full precision.
    if (!this.layers.isPlain && !this.loader.wantedNames.has('ground')) this.requestPictures();
  }

  /** Tell the loader which pictures to keep up to date. */
  requestPictures() {
    const { state, display, loader, view } = this;
    if (!state) return;
    const count = this.hasMixes ? 0 : state.lights.length;
    const names = wantedPictures(count, display, view, loader.resources);
    this.mixes.follow(view, display?.clean ?? true);
    const ground = this.layers.isPlain ? null : nameInView('ground', view);
    const detail = this.hasMixes ? nameInView('detail', view) : null;
    loader.setWanted([...names, ['ground', ground], ['detail', detail]]);
    if ((display?.transform ?? 'srgb') === 'srgb') this.setLut(SRGB);
  }

  /** @param {string} slot @param {string} name @param {Picture} picture @param {boolean} [isLive]
   * whether an answer follows at once, with which it is drawn */
  takePicture(slot, name, picture, isLive = false) {
    const { view } = this.screen;
    const { canvas, state } = this;
    if (!view || !canvas || !state) return;
    const { data } = picture;
    if (slot.startsWith('plane ')) {
      const light = Number(slot.slice(6));
      if (light >= state.lights.length) return;
      view.setPlane(light, /** @type {Uint16Array} */ (data), state.lights[light].scale ?? 1);
      if (this.screen.isPresent && !this.lacksLights) this.showWeights();
    } else if (slot.startsWith('look ')) {
      const plane = this.mixedCount + Number(slot.slice(5));
      if (plane < this.screen.count) view.setPlane(plane, /** @type {Uint16Array} */ (data), 1);
    } else if (slot === 'lut') this.setLut(lutOf(name.slice(4), picture, state.lut));
    else if (slot === 'present') this.setPresent(/** @type {Uint16Array} */ (data));
    else if (slot === 'ground') this.layers.setGround(/** @type {Float32Array} */ (data));
    else if (slot === 'detail') this.mixes.setDetail(/** @type {Uint16Array} */ (data));
    else if (slot === 'albedo') canvas.albedo = /** @type {Uint16Array} */ (data);
    else if (slot === 'objects') canvas.objects = /** @type {Int16Array} */ (data);
    else if (slot === 'verified') view.setPicture('verified', /** @type {Uint16Array} */ (data));
    else if (slot === 'beyond') view.setBeyond(/** @type {Uint8Array} */ (data));
    if (!isLive) this.screen.requestDraw();
  }

  /** @param {Uint16Array} present */
  setPresent(present) {
    const { canvas, state } = this;
    if (!canvas || !state) return;
    canvas.setPresent(present);
    this.knowsPresent = true;
    // The answer begins with it, and its own picture follows.
    if (this.hasMixes && this.screen.planeSize.join() === this.screen.size.join())
      this.screen.view?.setPlane(SOLUTION_SLOT, present.slice(), 1);
    this.showWeights();
    this.showPresent();
    if (!this.isReady && state.first) this.isReady = true;
    else if (!this.isReady) this.sync();
    this.redraw([canvas.wholeRegion]);
  }

  /** Set all pictures again, in a new view or one that has lost them. */
  refill() {
    this.setLut(this.lut);
    this.mixes.forget();
    this.showWeights();
    this.showPresent();
    if (this.canvas) this.redraw([this.canvas.wholeRegion]);
    this.loader.forget(
      (slot) => /^(plane|look) /.test(slot) || slot === 'verified' || slot === 'beyond',
    );
    this.requestPictures();
  }

  /** @param {Display} display */
  show(display) {
    const { display: previous } = this;
    this.display = display;
    this.screen.params = { ...display, live: false };
    if (display.lookPictures && !this.hasLookPlanes) {
      this.hasLookPlanes = true;
      if (this.screen.view) this.setPlanes();
    }
    if (
      previous?.transform !== display.transform ||
      previous?.clean !== display.clean ||
      String(previous?.lookPictures) !== String(display.lookPictures)
    )
      this.requestPictures();
    this.showWeights();
    if (showsPresent(display) !== showsPresent(previous)) this.showPresent();
    this.screen.requestDraw();
  }
}

export class LightDrafts {
  /** Drafts by slot. @type {Map<string, {name: string, picture: Picture}>} */
  waiting = new Map();

  /** @param {PictureLoader} loader */
  constructor(loader) {
    this.loader = loader;
  }

  /** Keep a draft until its answer. The message about all new pictures comes before that: nothing
   * is fetched that is here.
   * @param {import("./messages.js").Events["dragged"]} draft
   * @param {[height: number, width: number]} size of the planes */
  add({ light, step, resources, arrays }, size) {
    const slot = `plane ${light}`;
    const name = this.loader.notePicture(slot, resources);
    if (name === null) return;
    const halves = /** @type {Uint16Array} */ (arrays.data.data);
    const data = repeatPixels(halves, step, size);
    this.waiting.set(slot, { name, picture: { ...arrays.data, data } });
  }

  /** Show the drafts that wait. */
  show() {
    for (const [slot, { name, picture }] of this.waiting)
      this.loader.use(slot, name, picture, true);
    this.waiting.clear();
  }

  /** Drop the drafts that wait, since all pictures are listed anew. */
  clear() {
    this.loader.forget((slot) => this.waiting.has(slot));
    this.waiting.clear();
  }
}
