/**
 * Which layer a stroke paints, and how a wish becomes a layer of its own.
 *
 * Adjustments and fills are new layers. The brush paints the active layer if that is painted, else a
 * new one. The eraser takes from the layer that lies at its first point.
 */
import { gradientLayer } from './gradient.js';
import { t } from '../../language/language.js';
import {
  adjustmentName,
  areaName,
  effectText,
  importanceName,
  strokesName,
} from './layer_names.js';
import { newLayer, PAINTING_ID, plainLayer, withLayers } from './layer_list.js';
import { LayerCanvas } from './layer_canvas.js';
import { TILE_SIDE } from './layer_pixels.js';
import { LABELS } from '../stroke.js';

/** @import { Point } from '../brush.js' */
/** @import { Region } from '../../../../viewer/drawing/view.js' */
/** @import { Layer } from '../messages.js' */
/** @import { PaintCanvas } from '../paint_canvas.js' */
/** @import { Selection } from '../selection/selection_mirror.js' */
/** @import { Tool, ToolSettings } from '../stroke.js' */
/** @import { LayerMirror } from './layer_mirror.js' */
/** @import { LayerPicture } from './layer_picture.js' */

/** Tiles that are looked at to say what a layer does. */
const LOOKED_AT = 12;

export class LayerStrokes {
  /** @param {LayerMirror} mirror @param {(object: number) => string | null} objectName */
  constructor(mirror, objectName) {
    this.mirror = mirror;
    this.objectName = objectName;
    /** Id of the active layer. */
    this.activeId = PAINTING_ID;
    /** Whether the brush begins a new layer, since the active one is a finished wish. */
    this.isWishDone = false;
    /** Id of the layer whose mask is painted. @type {number | null} */
    this.maskId = null;
    /** Pixels under the stroke in progress. @type {PaintCanvas | null} */
    this.canvas = null;
    /** Whether it makes a layer. */
    this.isNew = false;
    /** Name of the layer that it makes; null for one that says what it does. @type {string | null} */
    this.givenName = null;
    /** What was active before it. */
    this.previous = { activeId: PAINTING_ID, isWishDone: false };
    /** Ids of all layers, as they were last. @type {Set<number>} */
    this.ids = new Set();
    /** The canvas of the last stroke on a layer, for the next one. @type {LayerCanvas | null} */
    this.lastCanvas = null;
    /** What strokes keep to; null for everything. @type {Selection | null} */
    this.selection = null;
  }

  /** Whether the page has all pixels that a stroke needs. @param {ToolSettings} tool
   * @param {Point} point where it begins */
  isReadyFor(tool, point) {
    const { mirror } = this;
    if (!mirror.absent().length || !mirror.picture) return true;
    if (tool.tool === 'eraser') return false;
    const found = this.layerFor(tool, point, undefined);
    if (!found) return true;
    // A new layer lies over what is drawn; another one has to be the page's own.
    if (!mirror.layer(found.id)) return true;
    return mirror.canCompose() && mirror.picture.shown.slice(mirror.picture.base?.count).some(
      ({ id }) => id === found.id,
    );
  }

  /** Make a layer active, for the brush to paint. @param {number} id */
  choose(id) {
    this.activeId = id;
    this.isWishDone = false;
    this.maskId = null;
    this.mirror.listener.onChange();
  }

  /** Paint the mask of a layer from now on; for null none. @param {number | null} id */
  paintMask(id) {
    this.maskId = id;
    if (id !== null) this.activeId = id;
    this.mirror.listener.onChange();
  }

  /** Choose another layer if the active one is gone, or if others lie over it, as from a file or when
   * a session is opened again: the brush would paint below them. */
  followList() {
    const { list } = this.mirror;
    const top = list[list.length - 1];
    const isOther = !this.ids.has(top.id) && top.id !== this.activeId && !this.canvas;
    if (isOther && (!this.ids.size || top.kind === 'paint' || top.kind === 'pixels')) {
      this.activeId = top.id;
      this.isWishDone = true;
    }
    this.ids = new Set(list.map(({ id }) => id));
    if (!this.mirror.layer(this.activeId)) {
      this.activeId = list[list.length - 1].id;
      this.isWishDone = this.activeId !== PAINTING_ID;
    }
    if (this.maskId !== null && !this.mirror.layer(this.maskId)) this.maskId = null;
  }

  /** Prepare a stroke. @param {ToolSettings} tool @param {Point} point where it begins
   * @param {number} [object] that it is about, -1 for none, where no point says so
   * @returns {PaintCanvas | null} what it paints */
  begin(tool, point, object) {
    const { picture } = this.mirror;
    if (!picture) return null;
    this.previous = { activeId: this.activeId, isWishDone: this.isWishDone };
    const found = this.layerFor(tool, point, object);
    if (!found) return null;
    const isWish = ['adjust', 'fill', 'gradient'].includes(tool.tool);
    // Importance lies over what is painted, and the brush goes on below it.
    if (tool.tool !== 'weight') {
      this.activeId = found.id;
      this.isWishDone = isWish && this.maskId === null;
    }
    this.isNew = !this.mirror.layer(found.id);
    if (this.isNew && this.mirror.absent().length) picture.capture();
    if (this.isNew) this.mirror.change({ layers: [found] });
    this.canvas = found.id === PAINTING_ID ? picture.painting : this.canvasOf(found);
    this.canvas.selection = this.selection;
    return this.canvas;
  }

  /** @param {Layer} layer @returns {LayerCanvas} */
  canvasOf(layer) {
    const pixels = this.mirror.pixelsOf(layer);
    const { lastCanvas: last } = this;
    const { painting, size } = /** @type {LayerPicture} */ (
      this.mirror.picture
    );
    if (last && last.layer.id === layer.id && last.pixels === pixels) last.layer = layer;
    else this.lastCanvas = new LayerCanvas(size, layer, pixels, painting);
    return /** @type {LayerCanvas} */ (this.lastCanvas);
  }

  /** Return the layer that a stroke paints, which may be new; null for none.
   * @param {ToolSettings} settings @param {Point} place @param {number | undefined} object
   * @returns {Layer | null} */
  layerFor(settings, place, object) {
    const { tool, importance, adjustedArea } = settings;
    const { x, y } = place;
    const { mirror } = this;
    if (tool === 'gradient') return this.layerNew('gradient', gradientLayer(settings, place));
    const masked = this.maskId === null ? undefined : mirror.layer(this.maskId);
    if (masked && tool !== 'adjust' && tool !== 'fill') return masked;
    const { painting } = /** @type {LayerPicture} */ (mirror.picture);
    const area = areaName(this.objectName(object ?? painting.objectAt(x, y)));
    const isSelection = adjustedArea === 'selection' && this.selection !== null;
    if (tool === 'adjust') {
      const spot = area ? t('Spot on {area}', { area }) : t('Spot');
      const whole = this.selection ? t('Selection') : t('Whole picture');
      const isSpot = object === undefined && (adjustedArea !== 'object' || !area);
      const name = isSelection ? whole : isSpot ? spot : area || whole;
      return this.layerNew('adjust', { name });
    }
    if (tool === 'fill')
      return this.layerNew('paint', { name: isSelection ? t('Selection') : area || t('Fill') });
    if (tool === 'weight') return this.weighing(importance);
    return tool === 'eraser' ? this.erased(x, y) : this.painted();
  }

  /** @param {Layer["kind"]} kind @param {Partial<Layer>} properties */
  layerNew(kind, properties) {
    return newLayer(this.mirror.next, kind, properties);
  }

  /** Return the layer that the brush paints. @returns {Layer} */
  painted() {
    const active = this.mirror.layer(this.activeId);
    const isOwn = active?.kind === 'paint' || (active?.kind === 'pixels' && this.isPaintingLowest());
    if (active && isOwn && this.isShown(active) && !this.isWishDone) return active;
    return this.layerNew('paint', {});
  }

  /** Whether nothing lies below the painting that is always there, so that its strokes mix with the
   * present look. */
  isPaintingLowest() {
    return this.mirror.list[0].id === PAINTING_ID;
  }

  /** @param {Layer} layer */
  isShown(layer) {
    const group = layer.group === null ? undefined : this.mirror.layer(layer.group);
    return layer.is_visible && layer.strength > 0 && group?.is_visible !== false;
  }

  /** Return the topmost layer of importance by this factor, or a new one. The painting that is alone
   * has its own. @param {number} times @returns {Layer | null} */
  weighing(times) {
    const { list } = this.mirror;
    const found = [...list]
      .reverse()
      .find((layer) => layer.kind === 'weigh' && layer.times === times && this.isShown(layer));
    if (found) return found;
    if (list.length === 1) return list[0];
    return this.layerNew('weigh', { times, name: importanceName(times) });
  }

  /** Return the layer that the eraser takes from: the active one if it covers the place, else the
   * topmost that covers it but not everything. @param {number} x @param {number} y
   * @returns {Layer | null} */
  erased(x, y) {
    const { list } = this.mirror;
    const active = this.mirror.layer(this.activeId);
    if (list.length === 1) return list[0];
    const candidates = [...list].reverse().filter((layer) => this.isShown(layer));
    const found = [...(active && this.isShown(active) ? [active] : []), ...candidates].find(
      (layer) => this.covers(layer, Math.floor(x), Math.floor(y)) && !this.coversAll(layer),
    );
    return found ?? (active?.kind === 'group' ? null : (active ?? null));
  }

  /** @param {Layer} layer @param {number} x @param {number} y */
  covers({ id }, x, y) {
    const { picture } = this.mirror;
    if (!picture) return false;
    const { painting, pixels } = picture;
    if (x < 0 || y < 0 || x >= painting.width || y >= painting.height) return false;
    if (id === PAINTING_ID) return painting.importance[y * painting.width + x] > 0;
    return (pixels.get(id)?.coverageAt(x, y) ?? 0) > 0;
  }

  /** @param {Layer} layer */
  coversAll({ id }) {
    const { picture } = this.mirror;
    const tiles = picture?.pixels.get(id)?.tiles;
    if (!picture || !tiles) return false;
    const count = Math.ceil(picture.size[0] / TILE_SIDE) * Math.ceil(picture.size[1] / TILE_SIDE);
    return tiles.size === count && [...tiles.values()].every(({ coverage }) => coverage[0] > 0);
  }

  /** The layer of the stroke in progress; null for the painting that is always there.
   * @returns {Layer | null} */
  get layer() {
    return this.canvas instanceof LayerCanvas ? this.canvas.layer : null;
  }

  /** Take what the stroke has changed into the picture. @param {Region} region
   * @returns {Region} what has to be drawn */
  takeChange(region) {
    const { picture, list } = this.mirror;
    const { canvas } = this;
    if (!picture || !canvas) return region;
    if (canvas instanceof LayerCanvas) {
      const { layer } = canvas;
      if (layer !== this.mirror.layer(layer.id))
        this.mirror.show(withLayers(list, [layer]));
      canvas.pixels.put(region, { image: canvas.image, coverage: canvas.importance });
    }
    const changed = canvas instanceof LayerCanvas ? canvas.layer.id : PAINTING_ID;
    return picture.compose(region, [changed]) ?? region;
  }

  /** Finish the stroke. @returns {Layer | null} the properties of its layer; null for the painting
   * that is always there */
  end() {
    const { canvas, isNew } = this;
    canvas?.end();
    this.canvas = null;
    if (!(canvas instanceof LayerCanvas)) return null;
    const layer = { ...canvas.layer, name: this.givenName ?? this.nameOf(canvas.layer, isNew) };
    this.givenName = null;
    canvas.layer = layer;
    this.mirror.show(withLayers(this.mirror.list, [layer]));
    this.mirror.listener.onChange();
    return plainLayer(layer);
  }

  /** Return the name of a layer that makes a place neutral. @param {Point} place */
  neutralName({ x, y }) {
    const whole = this.selection ? t('Selection') : t('Whole picture');
    const area = areaName(this.objectName(this.mirror.picture?.painting.objectAt(x, y) ?? -1));
    return area
      ? t('{whole}, neutral at {area}', { whole, area })
      : t('{whole}, neutral', { whole });
  }

  /** Return the name of the step that a stroke makes: what it asks for, or where it paints.
   * @param {Tool} tool @param {Point} start @param {Layer | null} layer */
  stepName(tool, { x, y }, layer) {
    if (layer?.name && this.maskId === null && ['adjust', 'fill'].includes(tool)) return layer.name;
    const area = areaName(this.objectName(this.mirror.picture?.painting.objectAt(x, y) ?? -1));
    return area ? t('{value} on {area}', { value: LABELS[tool], area }) : LABELS[tool];
  }

  /** Cancel the stroke. @returns {Region | null} what has to be drawn */
  cancel() {
    const { canvas, mirror, isNew } = this;
    const { picture } = mirror;
    const region = canvas?.drop() ?? null;
    this.canvas = null;
    Object.assign(this, this.previous);
    if (!picture || !canvas) return region;
    if (!(canvas instanceof LayerCanvas)) return picture.compose(region, [PAINTING_ID]);
    if (region) canvas.pixels.put(region, { image: canvas.image, coverage: canvas.importance });
    if (isNew) {
      mirror.show(mirror.list.filter(({ id }) => id !== canvas.layer.id));
      picture.pixels.delete(canvas.layer.id);
    }
    mirror.listener.onChange();
    return picture.compose(region);
  }

  /** @param {Layer} layer @param {boolean} isNew @returns {string} */
  nameOf(layer, isNew) {
    const isAdjustment = layer.kind === 'adjust' || (layer.gradient && !layer.gradient.light);
    if (isAdjustment) return isNew ? adjustmentName(layer.name, layer) : layer.name;
    if (layer.gradient && isNew)
      return [layer.name, this.effectOf(layer)].filter(Boolean).join(', ');
    if (layer.kind !== 'paint' || this.maskId !== null) return layer.name;
    if (!isNew || !layer.name) return strokesName(layer.name, this.effectOf(layer), isNew);
    return [layer.name, this.effectOf(layer) || t('filled')].join(', ');
  }

  /** Return what a layer does to the light below and above it, in words. @param {Layer} layer */
  effectOf({ id }) {
    const { picture } = this.mirror;
    const all = [...(picture?.pixels.get(id)?.tiles ?? [])];
    const [before, after] = [[0, 0, 0], [0, 0, 0]];
    const known = picture?.knownBelow([id]);
    const step = Math.max(1, Math.floor(all.length / LOOKED_AT));
    for (let k = 0; picture && k < all.length; k += step) {
      const [key, { coverage }] = all[k];
      const [without, whole] = [id, null].map((left) => picture.tile(key, left, known).light);
      for (let p = 0; p < coverage.length; p += 3)
        for (let c = 0; c < 3; c++) {
          before[c] += coverage[p] * without[3 * p + c];
          after[c] += coverage[p] * whole[3 * p + c];
        }
    }
    return effectText(before, after);
  }
}
