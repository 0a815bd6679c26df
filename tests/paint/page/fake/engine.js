import { newLayer, PAINTING, withLayers } from '../engine/layers/layer_list.js';

/** A picture engine of a few lines, on a 2D canvas: enough to look at the interface, and to test it. */

const encode = (x) =>
  255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(1, x) ** (1 / 2.4) - 0.055);

export class FakeEngine {
  constructor(host, room) {
    Object.assign(this, {
      host,
      room,
      hearers: {},
      calls: [],
      strokes: 0,
      size: [1, 1],
      image: null,
    });
    this.element = document.createElement('canvas');
    this.weights = room.lights.map(({ present }) => present);
    this.image = this.mix(this.weights);
    this.original = this.image.slice();
    for (const kind of ['state', 'answer', 'patch']) host.on(kind, (message) => this.hear(message));
  }

  on(name, hear) {
    (this.hearers[name] ??= []).push(hear);
  }
  tell(name, event) {
    for (const hear of this.hearers[name] ?? []) hear(event);
  }
  close() {}
  setTool(settings) {
    this.tool = settings;
  }
  resize(width, height) {
    this.size = [width, height];
    this.element.width = width * devicePixelRatio;
    this.element.height = height * devicePixelRatio;
    this.draw();
  }
  show(show) {
    this.shown = show;
    this.draw();
  }

  /** The looks that are side by side, at once, each whole. */
  showLooks(canvases, width, height) {
    this.calls.push(['showLooks', canvases.length, width, height]);
    this.wall = canvases.length ? { canvases, width, height } : null;
    this.draw();
  }
  drawLooks({ canvases, width, height }) {
    canvases.forEach((canvas, k) => {
      const weights = this.shown.lookMixes?.[k];
      if (!weights) return;
      Object.assign(canvas, { width, height });
      const pane = this.panes()[0];
      const { w, h } = this.room;
      const picture = this.toCanvas(this.mix(weights));
      canvas
        .getContext('2d')
        .drawImage(picture, pane.left, pane.top, w * pane.scale, h * pane.scale);
    });
  }

  hear(message) {
    const data = message.arrays?.weights?.data;
    if (data) this.weights = this.room.lights.map((_, k) => [...data.slice(3 * k, 3 * k + 3)]);
    this.draw();
  }

  mix(weights, gains) {
    const made = new Float32Array(this.room.w * this.room.h * 3);
    this.room.planes.forEach((plane, k) => {
      const rgb = gains && !gains[k] ? [0, 0, 0] : weights[k];
      if (rgb[0] + rgb[1] + rgb[2])
        for (let i = 0; i < made.length; i += 1) made[i] += plane[i] * rgb[i % 3];
    });
    return made;
  }

  panes() {
    const { layout, wipe, left, right, blink, zoom = 1, pan = [0, 0] } = this.shown ?? {};
    const { w, h } = this.room;
    const [width, height] = this.wall ? [this.wall.width, this.wall.height] : this.size;
    const placed = (kind, x, y, across, down, area = [x, y, across, down]) => {
      const scale = Math.min(area[2] / w, area[3] / h) * zoom;
      return {
        kind,
        x,
        y,
        width: across,
        height: down,
        scale,
        left: area[0] + area[2] / 2 - (w / 2 + pan[0]) * scale,
        top: area[1] + area[3] / 2 - (h / 2 + pan[1]) * scale,
      };
    };
    if (layout === 'blink') return [placed(blink === 'left' ? left : right, 0, 0, width, height)];
    if (layout === 'wipe') {
      const cut = width * wipe;
      const all = [0, 0, width, height];
      return [
        placed(right, cut, 0, width - cut, height, all),
        placed(left, 0, 0, cut, height, all),
      ];
    }
    if (layout === 'inset') {
      const { large, corner = 'bottom-right' } = this.shown;
      const [big, small] = large === 'left' ? [left, right] : [right, left];
      const [across, down] = [0.3 * width, (0.3 * width * h) / w];
      const x = corner.endsWith('left') ? 12 : width - 12 - across;
      const y = corner.startsWith('top') ? 12 : height - 12 - down;
      const whole = { ...placed(small, x, y, across, down), scale: across / w, left: x, top: y };
      return [placed(big, 0, 0, width, height), whole];
    }
    const [half, low] = [(width - 4) / 2, (height - 4) / 2];
    if (Math.min(half / w, height / h) >= Math.min(width / w, low / h)) {
      return [placed(left, 0, 0, half, height), placed(right, half + 4, 0, half, height)];
    }
    return [placed(left, 0, 0, width, low), placed(right, 0, low + 4, width, low)];
  }

  layerState() {
    const { layers = [PAINTING], layer = 0, maskLayer = null } = this;
    const nextLayer = 1 + Math.max(...layers.map(({ id }) => id));
    return { layers, nextLayer, layer, maskLayer, layerRevisions: {}, isPaintingEmpty: false };
  }
  changeLayers(change) {
    this.calls.push(['changeLayers', change]);
    this.layers = withLayers(this.layers ?? [PAINTING], change.layers ?? [], change.order);
    this.tell('layers', {});
  }
  finishLayers() {}
  /** Have some layers of each kind. */
  makeLayers(count = 4) {
    const kinds = ['adjust', 'paint', 'weigh', 'group'];
    const layers = Array.from({ length: count }, (_, k) =>
      newLayer(k + 1, kinds[k % 4], { name: `Pedestal with a long name ${k + 1}, +1.2 stops, warmer` }),
    );
    this.changeLayers({ layers });
  }
  chooseLayer(id) {
    Object.assign(this, { layer: id, maskLayer: null });
    this.tell('layers', {});
  }
  paintMask(id) {
    this.maskLayer = id;
    this.tell('layers', {});
  }
  isLayerHere() {
    return true;
  }
  coverage() {
    const { w: width, h: height } = this.room;
    return { data: Float32Array.from({ length: width * height }, (_, p) => p % 2), width, height };
  }
  lookAtLayer() {}
  layerThumbnail(id, width, height) {
    return new Uint8ClampedArray(4 * width * height).fill(180);
  }

  /** What is selected: whole rectangles alone. */
  selections = {
    current: null,
    width: 0,
    revision: 0,
    summary: () => this.selections.current && { revision: this.selections.revision, ...this.selections.about },
    select: async (part, options = {}) => {
      this.calls.push(['select', part, options]);
      const { w, h } = this.room;
      const mask = new Uint8Array(w * h);
      const [[x0, y0], [x1, y1]] = part.kind === 'rectangle' ? part.corners : [[0, 0], [w, h]];
      for (let y = y0; y < Math.min(h, y1); y += 1) mask.fill(255, y * w + x0, y * w + Math.min(w, x1));
      const bounds = [y0, Math.min(h, y1), x0, Math.min(w, x1)];
      this.setSelection({ mask, bounds }, { bounds, share: 0.25, isFaint: false });
    },
    change: (change) => {
      this.calls.push(['changeSelection', change]);
      if (change.kind === 'none') this.setSelection(null);
    },
  };
  setSelection(current, about = {}) {
    Object.assign(this.selections, { current, about, width: this.room.w });
    this.selections.revision += 1;
    this.tell('selection', {});
  }

  zoomAt(x, y, factor) {
    const { zoom, pan } = this.shown;
    const pane =
      this.panes().find((one) => x >= one.x && x < one.x + one.width && y >= one.y) ??
      this.panes()[0];
    const made = Math.min(64, Math.max(0.25, zoom * factor));
    const kept = (1 - zoom / made) / pane.scale;
    const mid = [
      pane.left + (this.room.w / 2 + pan[0]) * pane.scale,
      pane.top + (this.room.h / 2 + pan[1]) * pane.scale,
    ];
    return { zoom: made, pan: [pan[0] + (x - mid[0]) * kept, pan[1] + (y - mid[1]) * kept] };
  }

  picture(kind) {
    const { visibleLights, solutionWeights, otherWeights } = this.shown;
    if (kind === 'painting') return this.image;
    if (kind === 'present') return this.original;
    return this.mix(
      (kind === 'other' ? otherWeights : kind === 'solution' ? solutionWeights : null) ?? this.weights,
      kind === 'verified' ? null : visibleLights,
    );
  }

  draw() {
    if (this.waiting || !this.shown) return;
    this.waiting = requestAnimationFrame(() => {
      this.waiting = 0;
      if (this.wall) return this.drawLooks(this.wall);
      const context = this.element.getContext('2d');
      const ratio = devicePixelRatio;
      context.fillStyle = '#18181a';
      context.fillRect(0, 0, this.element.width, this.element.height);
      for (const pane of this.panes()) {
        context.save();
        context.beginPath();
        context.rect(pane.x * ratio, pane.y * ratio, pane.width * ratio, pane.height * ratio);
        context.clip();
        context.imageSmoothingQuality = 'high';
        context.drawImage(
          this.toCanvas(this.picture(pane.kind)),
          pane.left * ratio,
          pane.top * ratio,
          this.room.w * pane.scale * ratio,
          this.room.h * pane.scale * ratio,
        );
        context.restore();
      }
    });
  }

  toCanvas(image) {
    const { w, h } = this.room;
    const canvas = new OffscreenCanvas(w, h);
    const pixels = new ImageData(w, h);
    const gain = 2 ** this.shown.stops;
    for (let at = 0; at < w * h; at += 1) {
      for (let c = 0; c < 3; c += 1) pixels.data[4 * at + c] = encode(image[3 * at + c] * gain);
      pixels.data[4 * at + 3] = 255;
    }
    canvas.getContext('2d').putImageData(pixels, 0, 0);
    return canvas;
  }

  begin(point) {
    this.calls.push(['begin', this.tool.tool, point]);
    this.strokes += 1;
    this.drawn = 0;
    this.before = this.image.slice();
    this.started = point;
    this.move([point]);
  }

  move(points) {
    if (!this.before) return;
    this.calls.push(['move', points.length]);
    const last = points.at(-1);
    if (this.tool.tool === 'adjust') {
      return this.tell('adjustment', {
        stops: (this.started.y - last.y) / 30,
        mired: last.x - this.started.x,
      });
    }
    for (const point of points) this.stamp(point);
    this.send(false);
    this.draw();
  }

  stamp({ x, y, pressure }) {
    const { w, h, surfaces } = this.room;
    const { size, hardness, flow, rgb, tool, paintMode } = this.tool;
    const r = size / 2;
    for (let j = Math.max(0, Math.floor(y - r)); j < Math.min(h, y + r); j += 1) {
      for (let i = Math.max(0, Math.floor(x - r)); i < Math.min(w, x + r); i += 1) {
        const far = Math.hypot(i + 0.5 - x, j + 0.5 - y) / r;
        if (far >= 1) continue;
        const t = Math.min(1, Math.max(0, (1 - far) / Math.max(1e-3, 1 - hardness)));
        const amount = t * t * (3 - 2 * t) * flow * pressure * 0.5;
        const at = j * w + i;
        for (let c = 0; c < 3; c += 1) {
          const to =
            tool === 'eraser'
              ? this.original[3 * at + c]
              : tool === 'weight'
                ? this.image[3 * at + c]
                : rgb[c] * (paintMode === 'light' ? surfaces[at].albedo[c] : 1);
          this.image[3 * at + c] += amount * (to - this.image[3 * at + c]);
        }
      }
    }
  }

  async send(isFinal) {
    if (this.busy && !isFinal) return;
    this.busy = true;
    await this.host.send(
      'paint',
      {
        stroke: this.strokes,
        region: [0, this.room.h, 0, this.room.w],
        is_final: isFinal,
        label: this.tool.tool,
      },
      { image: { data: this.image, shape: [this.room.h, this.room.w, 3] } },
    );
    this.busy = false;
  }

  end() {
    if (!this.before) return;
    this.calls.push(['end']);
    this.before = null;
    this.send(true);
  }

  cancel() {
    if (!this.before) return false;
    this.calls.push(['cancel']);
    this.image = this.before;
    this.before = null;
    this.host.send('drop_stroke', { stroke: this.strokes });
    this.draw();
    return true;
  }

  line(from, to) {
    this.calls.push(['line', from, to]);
    this.strokes += 1;
    for (let t = 0; t <= 1; t += 0.02)
      this.stamp({ x: from.x + t * (to.x - from.x), y: from.y + t * (to.y - from.y), pressure: 1 });
    this.send(true);
  }

  adjust(adjustment) {
    this.calls.push(['adjust', adjustment]);
    this.strokes += 1;
    this.send(true);
  }
  neutralize(point) {
    this.calls.push(['neutralize', point]);
    this.strokes += 1;
    this.send(true);
    return this.image[3 * this.at(point.x, point.y)] > 0;
  }
  at(x, y) {
    return (
      Math.min(this.room.h - 1, Math.max(0, Math.floor(y))) * this.room.w +
      Math.min(this.room.w - 1, Math.max(0, Math.floor(x)))
    );
  }
  lightAt(kind, x, y) {
    const at = this.at(x, y);
    return [...this.picture(kind).slice(3 * at, 3 * at + 3)];
  }

  paintAt(kind, x, y) {
    return this.lightAt(kind, x, y);
  }

  objects() {
    const { w: width, h: height, surfaces } = this.room;
    this.numbers ??= Int16Array.from(surfaces, ({ object }) => object);
    return { data: this.numbers, width, height };
  }

  maxImportance() {
    return this.importance ?? 1;
  }

  displayedCodes(kind) {
    this.calls.push(['displayedCodes', kind]);
    const { w: width, h: height } = this.room;
    const gain = 2 ** this.shown.stops;
    const data = new Uint8ClampedArray(4 * width * height).fill(255);
    this.picture(kind).forEach((value, i) => (data[4 * Math.floor(i / 3) + (i % 3)] = encode(value * gain)));
    return { data, width, height };
  }
  codes(rgb, stops) {
    return rgb.map((x) => Math.round(encode(x * 2 ** stops)));
  }

  probe(x, y) {
    if (x < 0 || y < 0 || x >= this.room.w || y >= this.room.h) return null;
    const at = this.at(x, y);
    const each = this.room.planes.map((plane, k) =>
      this.weights[k].reduce((sum, rgb, c) => sum + rgb * plane[3 * at + c], 0),
    );
    const total = each.reduce((a, b) => a + b, 1e-9);
    const index = this.room.surfaces[at].object;
    return {
      object: this.room.objects[index],
      index,
      shares: each.map((one) => one / total),
    };
  }
}
