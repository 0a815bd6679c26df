/**
 * The picture engine. It holds the painting, shows the pictures, turns pointer input into strokes, and follows the
 * pixels and weights that the session sends.
 */

import { luminance } from '../../../viewer/drawing/colour.js';
import { VALUES } from '../../../viewer/drawing/half_floats.js';
import { neutralTint, pixelsAround } from './neutral.js';
import { DEFAULT_TOOL, LABELS, Stroke, adjustArea, tintArea } from './stroke.js';
import { Emitter, SocketHost } from './socket_host.js';
import { CpuView } from '../../../viewer/drawing/cpu.js';
import { union } from '../../../viewer/drawing/cpu_picture.js';
import { encoderOf } from '../../../viewer/drawing/view_transform.js';
import { maxImportance } from '../../../viewer/drawing/overlay.js';
import { Screen } from './picture_canvas.js';
import { hitTest, zoomAround } from '../../../viewer/drawing/view.js';
import { plainLayer } from './layers/layer_list.js';
import { LayerStrokes } from './layers/layer_strokes.js';
import { Selections } from './selection/selections.js';
import { SessionMirror } from './session_mirror.js';

/** @import { Point } from './brush.js' */
/** @import { ToolSettings } from './stroke.js' */
/** @import { Host } from './socket_host.js' */
/** @import { Kind, Pane, Region } from '../../../viewer/drawing/view.js' */
/** @import { ChangeLayers } from './messages.js' */
/** @import { RGB } from '../../../viewer/drawing/colour.js' */

/** Albedo below which a surface is black and shows no light. */
const MIN_ALBEDO = 0.02;

/** The tool of an adjustment by numbers. @type {ToolSettings} */
const NUMBERS_TOOL = { ...DEFAULT_TOOL, tool: 'adjust', adjustedArea: 'object' };

/** The session on the page's own server. @returns {Host} */
export function openHost() {
  const host = new SocketHost();
  void host.open();
  return host;
}

/** @param {Host} host @param {{view?: 'gl' | 'cpu' | null}} [options]
 * @returns {PictureEngine} */
export function openEngine(host, options = {}) {
  const parameter = new URLSearchParams(location.search).get('view');
  const view = options.view ?? (parameter === 'gl' || parameter === 'cpu' ? parameter : null);
  return new PictureEngine(host, { view });
}

/** What draws and paints for the interface. It emits "message": an answer to a stroke; "frame": before it
 * draws; "probed": when the light under the pointer has come; "loading": {done, total, isFirst} pictures,
 * where some of the lights have none yet; "adjustment": {stops, mired} of a drag; "send": {} before
 * the stroke in progress is sent, so that it may be moved on; "layers": {} when
 * `layerState` has changed; "selection": {} when another part is selected; "view": {view} in which
 * something was undone; "lost": {count, isStale} strokes that are not sent any more, since another page has
 * painted meanwhile, or the session is there no more; "trouble": {text}. */
export class PictureEngine extends Emitter {
  /** @param {Host} host @param {{view: 'gl' | 'cpu' | null}} options */
  constructor(host, { view }) {
    super();
    this.element = document.createElement('div');
    this.element.className = 'pictures';
    this.screen = new Screen(this.element, {
      view,
      refill: () => this.mirror.refill(),
      beforeDraw: () => this.emit('frame', {}),
    });
    this.mirror = new SessionMirror(host, this.screen, (kind, event) => this.emit(kind, event));
    this.on('lost', () => this.dropStroke());
    this.layers = new LayerStrokes(
      this.mirror.layers,
      (object) => this.mirror.state?.objects?.[object] ?? null,
    );
    this.on('layers', () => this.layers.followList());
    this.selections = new Selections(this.mirror, (kind, event) => this.emit(kind, event));
    this.mirror.selections = this.selections;
    this.on('selection', () => (this.layers.selection = this.selections.current));
    /** A stroke from before the pixels of the layers have arrived.
     * @type {{points: Point[], isEnded: boolean} | null} */
    this.earlyStroke = null;
    /** Called when a stroke changes the mask that is shown. */
    this.onMaskChange = () => {};
    /** @type {Stroke | null} */
    this.stroke = null;
    /** @type {ToolSettings} */
    this.tool = DEFAULT_TOOL;
  }

  // Display

  /** @param {number} width @param {number} height in CSS pixels */
  resize(width, height) {
    this.screen.resize(width, height);
  }

  /** @param {import("./picture_slots.js").Display} display */
  show(display) {
    this.mirror.show(display);
  }

  /** Draw the looks that are side by side on canvases of one size; none: the pictures again.
   * @param {HTMLCanvasElement[]} canvases @param {number} width @param {number} height */
  showLooks(canvases, width, height) {
    const choose = (/** @type {number} */ k) => this.mirror.chooseLook(k);
    this.screen.copyTo(canvases.length ? { canvases, width, height, choose } : null);
    if (!canvases.length) this.mirror.showWeights();
  }

  /** In CSS pixels of the element. @returns {(Omit<Pane, 'middle'>)[]} */
  panes() {
    const { ratio } = this.screen;
    return this.screen.panes().map(({ kind, ...pane }) => ({
      kind,
      x: pane.x / ratio,
      y: pane.y / ratio,
      width: pane.width / ratio,
      height: pane.height / ratio,
      scale: pane.scale / ratio,
      left: pane.left / ratio,
      top: pane.top / ratio,
    }));
  }

  /** Return the view parameters that enlarge the pictures by a factor around a place, in CSS
   * pixels.
   * @param {number} x @param {number} y @param {number} factor */
  zoomAt(x, y, factor) {
    const { ratio, params } = this.screen;
    const panes = this.screen.panes();
    const [px, py] = [x * ratio, y * ratio];
    // A small picture in a corner is always whole.
    const hit = params.layout === 'inset' ? null : hitTest(panes, px, py);
    return zoomAround(params, hit?.pane ?? panes[0], px, py, factor);
  }

  /** Return the light of a picture at a pixel. @param {Kind} kind @param {number} x
   * @param {number} y
   * @returns {RGB} */
  lightAt(kind, x, y) {
    const place = this.pixelAt(x, y);
    return place && this.screen.view ? this.screen.view.lightAt(kind, ...place) : [0, 0, 0];
  }

  /** Return the paint that gives a pixel the light of a picture there, in the current paint mode.
   * In light mode that is the incident light.
   * @param {Kind} kind @param {number} x @param {number} y @param {RGB} [light] that light, where it
   * is known: the GPU is waited for else @returns {RGB} */
  paintAt(kind, x, y, light = this.lightAt(kind, x, y)) {
    const place = this.pixelAt(x, y);
    const { albedo, width } = this.mirror.canvas ?? {};
    if (this.tool.paintMode === 'colour' || !place || !albedo || !width) return light;
    const index = 3 * (place[1] * width + place[0]);
    return /** @type {RGB} */ (
      light.map((x, c) => x / Math.max(MIN_ALBEDO, VALUES[albedo[index + c]]))
    );
  }

  /** Return the object and light at a pixel, and each light's share of the answer's luminance
   * there.
   * @param {number} x @param {number} y
   * @returns {{object: string | null, index: number, shares: number[]} | null} */
  probe(x, y) {
    const place = this.pixelAt(x, y);
    const { canvas, state, weights } = this.mirror;
    if (!place || !this.screen.view || !canvas || !state) return null;
    const planes = this.mirror.hasMixes
      ? this.lightsAt(place)
      : this.screen.view.planesAt(...place);
    const light = planes?.map((value, i) => value * weights[i]) ?? new Float32Array(weights.length);
    const levels = Array.from({ length: weights.length / 3 }, (_, k) =>
      Math.max(0, luminance(light.subarray(3 * k, 3 * k + 3))),
    );
    const total = levels.reduce((a, b) => a + b, 0);
    const index = canvas.objectAt(...place);
    const object = state.objects?.[index] ?? null;
    return { object, index, shares: levels.map((level) => (total > 0 ? level / total : 0)) };
  }

  /** Return the light of each lamp around a pixel that the session has; null until it is here. While a
   * stroke goes on it is not asked for, since its answers come first.
   * @param {[number, number]} place */
  lightsAt(place) {
    return this.isPainting ? null : this.mirror.mixes.lightsAt(...place, () => this.emit('probed', {}));
  }

  /** Return the object index of each pixel, once known.
   * @returns {{data: Int16Array, width: number, height: number} | null} */
  objects() {
    const { objects, width, height } = this.mirror.canvas ?? {};
    return objects && width && height ? { data: objects, width, height } : null;
  }

  /** Return the greatest painted importance, at least 1: full ink in the overlay. */
  maxImportance() {
    return maxImportance(this.mirror.drawnPainting?.importance ?? new Float32Array(0));
  }

  /** Return the display codes of light at an exposure. @param {RGB} rgb @param {number} stops */
  codes(rgb, stops) {
    const rgba = new Uint8ClampedArray(4);
    this.encoderAt(stops).pixels(Float32Array.from(rgb), rgba, 0, 1);
    return [...rgba.subarray(0, 3)];
  }

  /** @param {number} stops */
  encoderAt(stops) {
    return encoderOf(this.mirror.lut, stops);
  }

  /** Return the display codes of a picture as it is displayed, whole and at reduced size; null before
   * there is one. @param {'painting' | 'solution' | 'present'} kind */
  displayedCodes(kind) {
    const source = this.lightOf(kind);
    if (!source) return null;
    const { light, width, height } = sampledLight(source);
    const data = new Uint8ClampedArray(4 * width * height);
    this.encoderAt(this.mirror.display?.stops ?? 0).pixels(light, data, 0, width * height);
    return { data, width, height };
  }

  /** @param {'painting' | 'solution' | 'present'} kind
   * @returns {LightSource | null} */
  lightOf(kind) {
    const { canvas, drawnPainting, isReady } = this.mirror;
    if (!isReady || !canvas || !drawnPainting) return null;
    const { width, height, present } = canvas;
    if (kind === 'painting') return { data: drawnPainting.image, width, height, channels: 3 };
    if (this.screen.substitute(kind) === 'present')
      return { data: present, width, height, channels: 3, isHalf: true };
    return this.screen.view?.mixedLight() ?? null;
  }

  /** @param {number} x @param {number} y @returns {[number, number] | null} */
  pixelAt(x, y) {
    const [height, width] = this.screen.size;
    const [column, row] = [Math.floor(x), Math.floor(y)];
    return column >= 0 && row >= 0 && column < width && row < height ? [column, row] : null;
  }

  /** Note that a light is being dragged, or for null that it rests: its pictures are drafts until
   * then. @param {number | null} draftStep between the pixels and rows that they show */
  dragLight(draftStep) {
    this.screen.draftStep = draftStep;
  }

  /** The smallest step between the pixels and rows of drafts that are drawn in time. */
  get minDraftStep() {
    const { view } = this.screen;
    return view instanceof CpuView ? view.liveStep() : 1;
  }

  /** Switch to another view of the session. @param {number} view */
  showView(view) {
    if (this.stroke) this.end();
    this.mirror.showView(view);
  }

  // Tools and strokes

  /** @param {ToolSettings} settings */
  setTool(settings) {
    this.tool = settings;
  }

  /** Whether a stroke goes on. */
  get isPainting() {
    return this.stroke !== null;
  }

  /** The target of strokes, if painting is possible. */
  get place() {
    const { canvas, strokes, isReady } = this.mirror;
    return canvas && strokes && isReady ? { canvas, strokes } : null;
  }

  /** @param {Point} point in pixels of the picture */
  begin(point) {
    if (this.stroke) this.end();
    const { place } = this;
    if (!place || place.strokes.isSessionLost || ['pick', 'select', 'neutral'].includes(this.tool.tool)) return;
    if (!this.layers.isReadyFor(this.tool, point)) this.mirror.layers.needPixels();
    if (this.mirror.layers.isLoading) return this.beginLate(point);
    const canvas = this.layers.begin(this.tool, point);
    if (!canvas) return;
    const scale = this.panes()[0]?.scale ?? 1;
    this.stroke = new Stroke(canvas, this.tool, point, scale);
    this.mirror.isPainting = this.screen.isBrushDown = true;
    place.strokes.begin(canvas, () => this.layers.layer);
    this.drawChange(this.stroke.begin());
  }

  /** Begin a stroke once the pixels of the layers have arrived. @param {Point} point */
  beginLate(point) {
    /** @type {{points: Point[], isEnded: boolean}} */
    const early = { points: [], isEnded: false };
    this.earlyStroke = early;
    void this.mirror.layers.waitForPixels().then(() => {
      if (this.earlyStroke !== early) return;
      this.earlyStroke = null;
      this.begin(point);
      if (early.points.length) this.move(early.points);
      if (early.isEnded) this.end();
    });
  }

  /** @param {Point[]} points */
  move(points) {
    this.earlyStroke?.points.push(...points);
    if (!this.stroke) return;
    this.drawChange(this.stroke.move(points));
    if (this.stroke.settings.tool === 'adjust') this.emit('adjustment', this.stroke.adjustment);
    if (this.stroke.settings.tool === 'gradient') this.emit('layers', {}); // its ends follow
  }

  end() {
    const { stroke, place } = this;
    if (this.earlyStroke) this.earlyStroke.isEnded = true;
    if (!stroke || !place) return;
    if (stroke.isVoid) return void this.cancel();
    this.clearStroke();
    const layer = this.layers.end();
    place.strokes.end(this.layers.stepName(stroke.settings.tool, stroke.start, layer), layer);
  }

  /** Cancel the stroke that has begun. @returns {boolean} whether one had begun */
  cancel() {
    const { stroke, place } = this;
    this.earlyStroke = null;
    if (!stroke || !place) return false;
    this.clearStroke();
    const region = this.layers.cancel();
    place.strokes.drop();
    if (region) this.mirror.redraw([region]);
    return true;
  }

  /** Cancel the current stroke: it would overwrite another page's paint, or nobody would receive
   * it. */
  dropStroke() {
    if (!this.stroke) return;
    this.clearStroke();
    const region = this.layers.cancel();
    if (region) this.mirror.redraw([region]);
  }

  clearStroke() {
    this.stroke = null;
    this.mirror.isPainting = this.screen.isBrushDown = false;
  }

  /** Draw a whole straight stroke. @param {Point} start @param {Point} end */
  line(start, end) {
    this.begin(start);
    this.move([end]);
    this.end();
  }

  /** Make an object, or for null everything, brighter and warmer.
   * @param {{stops: number, mired: number, object: number | null}} adjustment */
  adjust(adjustment) {
    if (this.stroke) this.end();
    const { place } = this;
    if (!place || place.strokes.isSessionLost) return;
    const point = { x: 0, y: 0, pressure: 1 };
    const canvas = this.layers.begin(NUMBERS_TOOL, point, adjustment.object ?? -1);
    if (!canvas) return;
    place.strokes.begin(canvas, () => this.layers.layer);
    this.drawChange([adjustArea(canvas, adjustment)]);
    const layer = this.layers.end();
    place.strokes.end(layer?.name ?? LABELS.adjust, layer);
  }

  /** Make what is painted around a place neutral, by a layer over everything or over the selection.
   * @param {Point} point @returns {boolean} false where no tint does that */
  neutralize(point) {
    if (this.stroke) this.end();
    const { place, mirror, layers } = this;
    if (!place || place.strokes.isSessionLost || !mirror.drawnPainting) return true;
    const tint = neutralTint(pixelsAround(mirror.drawnPainting.image, this.screen.size, point));
    if (!tint) return false;
    const canvas = layers.begin(NUMBERS_TOOL, point, -1);
    if (!canvas) return true;
    layers.givenName = layers.neutralName(point);
    place.strokes.begin(canvas, () => layers.layer);
    this.drawChange([tintArea(canvas, tint)]);
    const layer = layers.end();
    place.strokes.end(layer?.name ?? LABELS.neutral, layer);
    return true;
  }

  // Layers

  /** Change layers: at once here, and in the session. @param {ChangeLayers} change */
  changeLayers(change) {
    if (this.stroke) this.end();
    const { place, mirror } = this;
    if (!place || place.strokes.isSessionLost) return;
    mirror.layers.change(change);
    place.strokes.change({ ...change, layers: change.layers?.map(plainLayer) ?? [] });
  }

  /** Make a layer active. @param {number} id */
  chooseLayer(id) {
    this.layers.choose(id);
  }

  /** Paint the mask of a layer from now on; for null none. @param {number | null} id */
  paintMask(id) {
    this.layers.paintMask(id);
  }

  /** End a change by a slider that has reported no end. */
  finishLayers() {
    const { strokes } = this.mirror;
    if (strokes?.isSliding) strokes.change({ ...strokes.lastChange, is_final: true });
  }

  /** The layers, the lowest first, and which of them are active. */
  layerState() {
    const { list, next, pixelRevisions, isPaintingEmpty } = this.mirror.layers;
    const { activeId, maskId } = this.layers;
    return {
      ...{ layers: list, nextLayer: next, layer: activeId, maskLayer: maskId },
      ...{ layerRevisions: pixelRevisions, isPaintingEmpty },
    };
  }

  /** Return a small picture of a layer: its paint, or its mask in white. @param {number} id
   * @param {number} width @param {number} height */
  layerThumbnail(id, width, height) {
    const { picture } = this.mirror.layers;
    const rgba = new Uint8ClampedArray(4 * width * height);
    const [rows, columns] = this.screen.size;
    const stops = this.mirror.display?.stops ?? 0;
    for (let at = 0; picture && at < width * height; at++) {
      const x = Math.floor((((at % width) + 0.5) * columns) / width);
      const y = Math.floor(((Math.floor(at / width) + 0.5) * rows) / height);
      const { colour, coverage } = picture.pixelAt(id, x, y);
      rgba.set(colour ? this.codes(colour, stops) : [255, 255, 255], 4 * at);
      rgba[4 * at + 3] = 255 * Math.min(1, coverage);
    }
    return rgba;
  }

  /** Whether a layer has pixels in the current view. @param {number} id */
  isLayerHere(id) {
    const { layers } = this.mirror;
    const isAbsent = layers.absent().some((layer) => layer.id === id);
    return isAbsent || Boolean(layers.picture?.pixels.get(id)?.bounds);
  }

  /** Fetch the pixels of a layer, or of those in a group, if they are not here. @param {number} id */
  lookAtLayer(id) {
    const { layers } = this.mirror;
    for (const layer of layers.list)
      if (layer.id === id || layer.group === id) void layers.look(layer.id);
  }

  /** Return how far a layer, or a group, covers each pixel. @param {number} id */
  coverage(id) {
    const [height, width] = this.screen.size;
    this.lookAtLayer(id);
    return { data: this.mirror.layers.coverage(id), width, height };
  }

  /** @param {Region[]} regions */
  drawChange(regions) {
    const region = regions.reduce((a, b) => /** @type {Region} */ (union(a, b)), regions[0]);
    if (!region) return;
    this.mirror.redraw([this.layers.takeChange(region)]);
    const { strokes } = this.mirror;
    // While its end moves, a gradient has the same pixels.
    if (this.stroke?.length) strokes?.touchLayer();
    else strokes?.touch(region);
    if (this.layers.maskId !== null) this.onMaskChange();
  }

  close() {
    this.mirror.strokes?.flush();
    this.mirror.strokes?.close();
    this.mirror.loader.close();
    this.screen.close();
    this.element.remove();
  }
}

/** Light of a picture: values of pixels, row by row, each of some channels; `isHalf`: by the table of
 * halves. @typedef {{data: ArrayLike<number>, width: number, height: number, channels: number,
 *   isHalf?: boolean}} LightSource */

/** Largest number of columns that are looked at. */
const MAX_COLUMNS = 384;

/** Return the light of every so manieth pixel of every so manieth row. @param {LightSource} source
 * @param {number} [maxColumns] @returns {{light: Float32Array, width: number, height: number}} */
function sampledLight({ data, width, height, channels, isHalf }, maxColumns = MAX_COLUMNS) {
  const step = Math.max(1, Math.ceil(width / maxColumns));
  const size = [Math.ceil(width / step), Math.ceil(height / step)];
  const light = new Float32Array(3 * size[0] * size[1]);
  let target = 0;
  for (let y = 0; y < height; y += step)
    for (let x = 0; x < width; x += step, target += 3) {
      const start = channels * (y * width + x);
      for (let c = 0; c < 3; c++) {
        const value = data[start + c];
        light[target + c] = isHalf ? VALUES[value] : value;
      }
    }
  return { light, width: size[0], height: size[1] };
}
