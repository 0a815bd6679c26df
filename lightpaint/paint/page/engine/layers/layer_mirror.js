/**
 * The page's copy of the layers: changed at once by what a person does, and brought to what the
 * session says as soon as it has answered everything.
 */
import { nameInView } from '../message_frames.js';
import { changedLayers, PAINTING, PAINTING_ID, plainLayer, shownLayers, withLayers } from './layer_list.js';
import { LayerPicture } from './layer_picture.js';
import { LayerPixels, splitPixels } from './layer_pixels.js';

/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { ChangeLayers, Layer, LayerInfo, LayerList } from '../messages.js' */
/** @import { PaintCanvas } from '../paint_canvas.js' */

/** Concurrent fetches. */
const MAX_FETCHES = 4;

export class LayerMirror {
  /** @param {import("../socket_host.js").Host} host
   * @param {{redraw: (region: Region) => void, onChange: () => void, onError: (text: string) => void}}
   *   listener onChange: called when the list has changed, or which of it is active */
  constructor(host, listener) {
    this.host = host;
    this.listener = listener;
    /** The layers, the lowest first, as the page shows them. @type {Layer[]} */
    this.list = [PAINTING];
    /** The last list that the session has sent. @type {LayerList | null} */
    this.known = null;
    /** @type {Map<number, number>} */
    this.accents = new Map();
    /** Revision of the pixels that the page has, by id. @type {Map<number, number>} */
    this.revisions = new Map();
    /** Id of the next new layer. */
    this.next = 1;
    /** Index of the view that the pixels are of. */
    this.view = 0;
    /** @type {LayerPicture | null} */
    this.picture = null;
    this.isLoading = false;
    /** How often the pixels of the layer that is always there have changed. */
    this.paintings = 0;
    /** Whether pixels may differ from the session's, since it has refused something. */
    this.isDoubtful = false;
    /** Whether the pixels of all layers are needed, and not only of those that were. */
    this.needsAll = false;
    /** Ids of layers that are fetched to be looked at. @type {Set<number>} */
    this.looked = new Set();
    /** @type {(() => void)[]} */
    this.waiters = [];
  }

  /** Begin with a view, whose pixels are not known yet. @param {PaintCanvas} painting
   * @param {number} view */
  open(painting, view) {
    this.view = view;
    this.revisions.clear();
    this.needsAll = false;
    this.picture = new LayerPicture(painting);
    this.accents = this.knownAccents();
    this.show(this.list);
  }

  /** Fetch all pixels again: the session has refused something. */
  distrustPixels() {
    this.isDoubtful = true;
  }

  /** @param {LayerList | undefined} list of a message */
  remember(list) {
    if (!list) return;
    this.known = list;
    this.next = Math.max(this.next, list.next);
  }

  /** Show the session's layers. isOther: their pixels may be others than the page's.
   * @param {boolean} isOther */
  adopt(isOther) {
    const { known, picture } = this;
    if (!known) return;
    if (this.isDoubtful) this.revisions.clear();
    this.needsAll ||= this.isDoubtful;
    isOther ||= this.isDoubtful;
    this.isDoubtful = false;
    this.accents = this.knownAccents();
    if (picture && !isOther)
      for (const { id, revision } of known.layers)
        if (this.revisions.has(id) || picture.pixels.has(id)) this.revisions.set(id, revision);
    const changed = this.show(known.layers.map(plainLayer));
    if (!isOther) this.composeChanged(changed);
    if (picture?.isPlain) {
      // A patch has, or will have, the pixels of a painting that is alone.
      const painting = known.layers.find(({ id }) => id === PAINTING_ID);
      if (painting) this.revisions.set(PAINTING_ID, painting.revision);
    }
    this.paintings += 1;
    this.listener.onChange();
    if (picture && !picture.isPlain) void this.load();
  }

  /** Compose where layers have changed, as soon as the pixels are there. @param {number[]} changed */
  composeChanged(changed) {
    const { picture } = this;
    const region = picture?.boundsOf(changed);
    if (!picture || (!region && this.canCompose())) return;
    if (this.canCompose()) this.redraw(picture.compose(region ?? null, changed));
    else if (changed.length) this.needPixels();
  }

  /** Whether the pixels of all layers are here, or what those come to whose are not. */
  canCompose() {
    return !this.absent().length || Boolean(this.picture?.isBaseCurrent);
  }

  /** Fetch the pixels of all layers, then draw them. */
  needPixels() {
    this.needsAll = true;
    if (this.picture && !this.picture.isPlain) this.picture.isPartial = true;
    void this.load();
  }

  /** Fetch the pixels of a layer that somebody looks at. @param {number} id */
  async look(id) {
    const { picture } = this;
    const layer = this.absent().find((one) => one.id === id);
    if (!picture || !layer || this.looked.has(id)) return;
    this.looked.add(id);
    await this.fetch(layer, picture).catch(() => {});
    this.looked.delete(id);
    this.listener.onChange();
  }

  knownAccents() {
    const layers = this.known?.layers ?? [];
    return new Map(layers.map(({ id, accents }) => [id, accents[this.view] ?? 1]));
  }

  /** Show other layers. @param {Layer[]} list @returns {number[]} ids of those that differ */
  show(list) {
    this.list = list;
    const { picture } = this;
    if (!picture) return [];
    const before = picture.shown;
    picture.show(shownLayers(list, this.accents), list);
    return changedLayers(before, picture.shown);
  }

  /** Change layers at once; the session hears of it otherwise. @param {ChangeLayers} change */
  change({ layers = [], order = null, copies = {} }) {
    const { picture } = this;
    for (const [id, source] of Object.entries(copies)) {
      const pixels = picture?.pixels.get(source);
      if (pixels) picture?.pixels.set(Number(id), pixels.copy());
      this.next = Math.max(this.next, Number(id) + 1);
    }
    for (const { id } of layers) this.next = Math.max(this.next, id + 1);
    if (picture && order && !order.includes(PAINTING_ID)) clear(picture.painting);
    const changed = this.show(withLayers(this.list, layers, order));
    if (order && !order.includes(PAINTING_ID)) changed.push(PAINTING_ID);
    this.composeChanged(changed);
    this.listener.onChange();
  }

  /** Numbers that grow when the pixels of a layer change, by id. @returns {Record<number, number>} */
  get pixelRevisions() {
    const all = [...(this.picture?.pixels ?? [])].map(([id, { revision }]) => [id, revision]);
    return { ...Object.fromEntries(all), [PAINTING_ID]: this.paintings };
  }

  /** Whether the painting that is always there is drawn alone. */
  get isPlain() {
    return this.picture?.isPlain ?? true;
  }

  /** Whether nothing is on the layer that is always there. */
  get isPaintingEmpty() {
    return !this.absent().some(({ id }) => id === PAINTING_ID) && !this.picture?.painting.importance.some((x) => x > 0);
  }

  /** @param {number} id @returns {Layer | undefined} */
  layer(id) {
    return this.list.find((layer) => layer.id === id);
  }

  /** Return the pixels of a layer, new ones if it has none. @param {Layer} layer */
  pixelsOf(layer) {
    const { picture } = this;
    const size = picture?.size ?? [1, 1];
    const pixels = picture?.pixels.get(layer.id) ?? new LayerPixels(size, hasColour(layer));
    picture?.pixels.set(layer.id, pixels);
    return pixels;
  }

  /** Return how far a layer, or a group, covers each pixel. @param {number} id
   * @returns {Float32Array} (h, w) */
  coverage(id) {
    const { picture } = this;
    const covered = new Float32Array(picture?.painting.importance.length ?? 0);
    if (!picture) return covered;
    const members = this.list.filter((layer) => layer.id === id || layer.group === id);
    for (const layer of members) {
      const one = covered.slice().fill(0);
      if (layer.id === PAINTING_ID) one.set(picture.painting.importance);
      else picture.pixels.get(layer.id)?.writeTo({ image: null, coverage: one });
      for (let p = 0; p < one.length; p++) covered[p] = Math.max(covered[p], Math.min(1, one[p]));
    }
    return covered;
  }

  // Pixels of the session

  /** Return the layers whose pixels the page does not have. @returns {LayerInfo[]} */
  missing() {
    const layers = this.known?.layers ?? [];
    return layers.filter(
      ({ id, kind, revision }) => kind !== 'group' && this.revisions.get(id) !== revision,
    );
  }

  /** Return the layers of whose pixels the page has none. @returns {LayerInfo[]} */
  absent() {
    return this.missing().filter(({ id, regions }) => {
      const [top, bottom] = regions[this.view] ?? [0, 0];
      return bottom > top && !this.revisions.has(id) && !this.picture?.pixels.has(id);
    });
  }

  /** Return the layers whose pixels are to be fetched: those that changed, or all.
   * @returns {LayerInfo[]} */
  needed() {
    const absent = this.needsAll ? [] : this.absent();
    return this.missing().filter((layer) => !absent.includes(layer));
  }

  /** Fetch the pixels that are needed, then draw them. */
  async load() {
    const { picture } = this;
    if (this.isLoading || !picture) return;
    this.isLoading = true;
    /** @type {number[]} */
    const loaded = [];
    try {
      for (let missing = this.needed(); missing.length; missing = this.needed()) {
        const some = missing.slice(0, MAX_FETCHES);
        await Promise.all(some.map((layer) => this.fetch(layer, picture)));
        if (picture !== this.picture) break;
        loaded.push(...some.map(({ id }) => id));
      }
    } catch (error) {
      this.listener.onError(error instanceof Error ? error.message : String(error));
    }
    this.isLoading = false;
    if (picture !== this.picture) return void this.load();
    if (!this.absent().length) {
      picture.base = null;
      const whole = picture.ground && picture.complete();
      this.redraw(whole ?? picture.compose(picture.boundsOf(loaded)));
    }
    for (const resolve of this.waiters.splice(0)) resolve();
    if (loaded.length) this.listener.onChange();
  }

  /** Resolve once no pixels are being fetched. @returns {Promise<void>} */
  waitForPixels() {
    return new Promise((resolve) => {
      if (this.isLoading) this.waiters.push(resolve);
      else resolve();
    });
  }

  /** @param {LayerInfo} layer @param {LayerPicture} picture */
  async fetch({ id, revision, regions, ...rest }, picture) {
    const { view } = this;
    const region = regions[view] ?? [0, 0, 0, 0];
    const layer = { id, ...rest };
    const [rows, columns] = [region[1] - region[0], region[3] - region[2]];
    const count = Math.max(0, rows * columns);
    const { data } = count ? await this.host.fetch(nameInView(`layer/${id}`, view)) : EMPTY;
    if (picture !== this.picture || view !== this.view) return;
    this.revisions.set(id, revision);
    const depth = hasColour(layer) ? 4 : 1;
    // If it has changed meanwhile, a newer revision follows.
    if (data.length !== depth * count) return;
    const pixels = splitPixels(/** @type {Float32Array} */ (data), depth);
    picture.keepingBase(() => {
      if (id === PAINTING_ID) {
        clear(picture.painting);
        picture.painting.set(region, /** @type {Float32Array} */ (pixels.image), pixels.coverage);
        picture.painting.setPresent(picture.painting.present);
      } else {
        const made = new LayerPixels(picture.size, depth === 4);
        made.put(region, pixels, region);
        picture.pixels.set(id, made);
      }
    });
  }

  /** @param {Float32Array} ground the present look */
  setGround(ground) {
    const { picture } = this;
    if (!picture) return;
    picture.ground = ground;
    picture.groundRevision += 1;
    picture.isPartial = !picture.isPlain;
    if (!this.isLoading && !this.missing().length) this.redraw(picture.complete());
  }

  /** @param {Region | null} region */
  redraw(region) {
    if (region) this.listener.redraw(region);
  }
}

const EMPTY = { data: new Float32Array(0) };

/** @param {{kind: Layer["kind"]}} layer */
const hasColour = ({ kind }) => kind === 'paint' || kind === 'pixels';

/** @param {PaintCanvas} painting */
function clear(painting) {
  painting.importance.fill(0);
  painting.setPresent(painting.present);
}
