/**
 * The light mixer of a report: without session or server, from planes in the page.
 *
 * Fills each `.mixer` element from the JSON in it; without scripts the element stays hidden.
 */

import { luminance } from '../drawing/chromaticity.js';
import { Encoder, SRGB } from '../drawing/view_transform.js';
import { Mix } from '../drawing/mix.js';
import { lutOf, unpackMixer } from './mixer_data.js';
import { addGels } from './mixer_gels.js';
import { Row, kelvinTable } from './mixer_light.js';
import { Selection } from './mixer_selection.js';
import { createElement, createSlider, followDrag } from './page_elements.js';

/** @import { Data, Unpacked } from './mixer_data.js' */
/** @import { RGB } from '../drawing/colour.js' */

/** A look from which a mixer begins. start: returns its data from the data of its basis.
 * @typedef {{start: (data: Data) => Data}} Look */

/** Width of a light's picture in its row, and the share of its pixels that are at most white. */
const [THUMBNAIL_WIDTH, WHITE_SHARE] = [88, 0.98];

class Mixer {
  /** @param {HTMLElement} root @param {Unpacked} unpacked
   * @param {import("../drawing/view_transform.js").Lut} lut */
  constructor(root, [data, planes, gels], lut) {
    this.data = data;
    this.planes = planes.map((halves, k) => ({ halves, scale: data.planes[k].scale, step: 1 }));
    this.encoder = new Encoder(lut, data.transform.stops);
    this.lut = lut;
    this.mix = new Mix(data.size);
    this.picture = canvasOfSize(data.size);
    this.isDrawScheduled = false;
    this.look = /** @type {'answer' | 'present'} */ ('answer');
    const kelvins = kelvinTable(data.kelvins);
    const redraw = () => this.draw();
    /** @type {Row[]} */
    this.rows = data.lights.map((light) => new Row(light, kelvins, redraw));
    this.rows.forEach((row, k) => (row.plane = k));
    const { shown } = data;
    if (shown) this.rows = this.rows.filter((row) => shown.includes(row.plane));
    data.joint.forEach((joint, k) => {
      const { label: name, levels } = joint;
      const [answer, present] = [levels.answer, levels.present].map(
        (x) => /** @type {RGB} */ ([x, x, x]),
      );
      const kelvin = { present: null, answer: null };
      const kind = { unit: '', isFixed: false, isScalar: true };
      const row = new Row({ name, joint, answer, present, kelvin, ...kind }, kelvins, redraw);
      row.plane = data.lights.length + 2 * k;
      this.rows.push(row);
    });
    this.selection = new Selection(this.rows, redraw);
    addGels(this.selection, gels);
    const view = this.createStage();
    view.append(this.selection.element, ...this.createButtons());
    const list = createElement('div', 'mixer-lights');
    list.append(...this.rows.map((row) => row.element));
    root.append(view, list);
    for (const row of this.rows) this.drawThumb(row);
    this.reset('answer');
  }

  /** Painting and mix, separated by a wipe. */
  createStage() {
    const [height, width] = this.data.size;
    const { painting } = this.data;
    const view = createElement('div', 'mixer-view');
    const stage = createElement('div', 'mixer-stage wipe-stage');
    stage.style.aspectRatio = `${width} / ${height}`;
    this.picture.className = 'mixer-mix';
    this.picture.setAttribute('role', 'img');
    this.picture.ariaLabel = 'The mix of the lights';
    stage.append(this.picture);
    view.append(stage);
    if (!painting) return view;
    const image = createElement('img', 'mixer-painting');
    image.src = painting;
    image.alt = 'The painting';
    image.draggable = false;
    const edge = createElement('div', 'wipe-edge');
    edge.append(createElement('i'));
    stage.append(image, edge, createElement('span', 'wipe-tag', 'painting'));
    stage.append(createElement('span', 'wipe-tag is-right', 'mix'));
    // The whole mix is visible until the wipe moves, since a light may affect only one half.
    const wipe = createSlider('Wipe: how much of the painting', 0, 100);
    wipe.value = '0';
    const move = () => {
      stage.style.setProperty('--p', `${wipe.value}%`);
      stage.classList.toggle('is-mix', Number(wipe.value) < 1);
      stage.classList.toggle('is-painting', Number(wipe.value) > 99);
    };
    wipe.addEventListener('input', move);
    followDrag(stage, (share) => {
      wipe.value = String(100 * share);
      move();
    });
    move();
    const label = createElement('label', 'mixer-wipe');
    label.append(createElement('span', '', 'Wipe'), wipe);
    view.append(label);
    return view;
  }

  /** Buttons for all lights, and the line that reports their effect. */
  createButtons() {
    this.status = createElement('p', 'mixer-said');
    this.status.setAttribute('role', 'status');
    const buttons = createElement('div', 'mixer-buttons');
    buttons.append(
      createButton('Reset to answer', 'All lights as in the answer', () => this.reset('answer')),
      createButton('Reset to now', 'All lights as in the scene', () => this.reset('present')),
      createButton(
        'Copy as lighting.json',
        'The lights as the sliders set them; solo and mute do not count',
        () => this.copy(this.lighting(), 'lighting.json'),
      ),
    );
    const { command } = this.data;
    if (command)
      buttons.append(
        createButton('Copy command', command, () => this.copy(command, 'The command')),
      );
    this.text = createElement('textarea', 'mixer-text');
    this.text.readOnly = true;
    this.text.hidden = true;
    this.text.ariaLabel = 'To copy by hand';
    return [buttons, this.status, this.text];
  }

  /** @param {'answer' | 'present'} look */
  reset(look) {
    this.look = look;
    if (this.status) this.status.textContent = ''; // from an earlier look
    for (const row of this.rows) row.reset(look);
    this.selection.reset();
  }

  /** Return an emission under the master. @param {RGB} rgb @returns {RGB} */
  dimmed(rgb) {
    return /** @type {RGB} */ (rgb.map((x) => this.selection.master * x));
  }

  /** Weights of all planes, (n, 3), under solo and mute. */
  currentWeights() {
    const isSolo = this.rows.some((row) => row.isSolo);
    const weights = new Float64Array(3 * this.planes.length);
    if (!isSolo)
      for (const k of this.hiddenLights())
        weights.set(this.dimmed(this.data.lights[k][this.look]), 3 * k);
    for (const row of this.rows) {
      const isOn = isSolo ? row.isSolo : !row.isMute;
      // Joint lights have a plane per look; the last reset chose it.
      const plane = row.light.joint && this.look === 'present' ? row.plane + 1 : row.plane;
      const rgb = row.light.isFixed ? row.rgb : this.dimmed(row.rgb);
      if (!isOn) continue;
      for (const k of row.light.joint?.members ?? [])
        weights.set(product(this.data.lights[k][this.look], rgb), 3 * k);
      if (!row.light.joint?.members) weights.set(rgb, 3 * plane);
    }
    return weights;
  }

  /** Lights with a plane but without sliders. @returns {number[]} */
  hiddenLights() {
    const { shown, lights, joint } = this.data;
    if (!shown) return [];
    const rows = [...shown, ...joint.flatMap(({ members }) => members ?? [])];
    return [...lights.keys()].filter((k) => !rows.includes(k));
  }

  draw() {
    if (this.isDrawScheduled) return;
    this.isDrawScheduled = true;
    requestAnimationFrame(() => {
      this.isDrawScheduled = false;
      this.mix.weights = this.currentWeights();
      this.mix.update(this.planes, 1, false);
      drawLight(this.picture, this.mix.light, this.encoder);
    });
  }

  /** Draw the small picture of one light alone, or the map of an image as in the answer.
   * @param {Row} row */
  drawThumb({ light: { joint }, rgb, plane, thumb }) {
    let { size } = this.data;
    /** @type {Float32Array} */
    let light;
    if (joint?.columns) {
      const radiances = Object.values(joint.answer);
      light = Float32Array.from(joint.places.flatMap((k) => radiances[k]));
      size = [light.length / 3 / joint.columns, joint.columns];
    } else {
      const mix = new Mix(size);
      mix.weights = new Float64Array(3 * this.planes.length);
      mix.weights.set(luminance(rgb) > 0 ? rgb : [1, 1, 1], 3 * plane);
      mix.update(this.planes, 1, false);
      light = mix.light;
    }
    const levels = light.filter((x) => x > 0).sort();
    const white = levels[Math.floor(WHITE_SHARE * (levels.length - 1))] || 1;
    const canvas = canvasOfSize(size);
    drawLight(canvas, light, new Encoder(SRGB, -Math.log2(white)));
    thumb.width = THUMBNAIL_WIDTH;
    thumb.height = Math.max(1, Math.round((THUMBNAIL_WIDTH * size[0]) / size[1]));
    const context = contextOf(thumb);
    context.imageSmoothingQuality = 'high';
    context.drawImage(canvas, 0, 0, thumb.width, thumb.height);
  }

  /** Return the mix as a lighting file. */
  lighting() {
    const file = structuredClone(this.data.lighting);
    /** @param {string} name @param {RGB} rgb */
    const add = (name, rgb) => {
      const emission = this.dimmed(rgb);
      Object.assign(file.lights[name], { emission, weight: [...emission] });
    };
    for (const k of this.hiddenLights()) {
      const light = this.data.lights[k];
      add(light.name, light[this.look]);
    }
    for (const { light, rgb } of this.rows) {
      if (!light.joint) add(light.name, rgb);
      else
        for (const [name, emission] of Object.entries(light.joint[this.look]))
          add(name, product(emission, rgb));
    }
    for (const { light } of this.rows)
      if (light.isFixed)
        Object.assign(file.lights[light.name], { emission: [1, 1, 1], weight: [1, 1, 1] });
    return JSON.stringify(file, null, 2) + '\n';
  }

  /** @param {string} text @param {string} subject */
  async copy(text, subject) {
    const { status, text: field } = this;
    if (!status || !field) return;
    field.hidden = true;
    field.value = text;
    try {
      await navigator.clipboard.writeText(text);
      status.textContent = `${subject} is on the clipboard.`;
    } catch {
      // A page opened from a disk may have no clipboard access; then users copy by hand.
      field.hidden = false;
      field.select();
      status.textContent = document.execCommand('copy')
        ? `${subject} is on the clipboard.`
        : 'This browser does not allow copying here. Copy the selected text below.';
    }
  }
}

/** @param {RGB} a @param {RGB} b */
const product = (a, b) => /** @type {RGB} */ (a.map((x, c) => x * b[c]));

/** @param {string} text @param {string} title @param {() => void} act */
function createButton(text, title, act) {
  const element = createElement('button', '', text);
  element.type = 'button';
  element.title = title;
  element.addEventListener('click', act);
  return element;
}

/** Start a mixer from its answer or a look, or say why there is none.
 * @param {HTMLElement} root @param {Look} [look]
 * @param {() => boolean} [isWanted] whether it is still wanted once it is unpacked */
export async function begin(root, look, isWanted = () => true) {
  root.dataset.ready = '';
  const body = createElement('div', 'mixer-body');
  try {
    await buildMixer(body, root, look);
  } catch (error) {
    body.append(createElement('p', 'mixer-said', failureText(error)));
  }
  if (!isWanted()) return;
  root.querySelector('.mixer-body')?.remove();
  root.append(body);
  root.hidden = false;
}

/** @param {HTMLElement} body @param {HTMLElement} root @param {Look} [look] */
async function buildMixer(body, root, look) {
  let [data, planes, gels] = await unpackMixer(root);
  if (look) data = look.start(data);
  return new Mixer(body, [data, planes, gels], await lutOf(data.transform));
}

/** @param {unknown} error */
function failureText(error) {
  if (typeof DecompressionStream === 'undefined')
    return 'The mixer needs a newer browser, one that has DecompressionStream.';
  return `The mixer is not available: ${error instanceof Error ? error.message : error}`;
}

for (const root of document.querySelectorAll('.mixer:not([data-ready])'))
  if (root instanceof HTMLElement) begin(root);

/** Draw light on a canvas of its size. @param {HTMLCanvasElement} canvas
 * @param {Float32Array} light @param {Encoder} encoder */
function drawLight(canvas, light, encoder) {
  const image = new ImageData(canvas.width, canvas.height);
  encoder.pixels(light, image.data, 0, canvas.width * canvas.height);
  contextOf(canvas).putImageData(image, 0, 0);
}

/** @param {[height: number, width: number]} size */
function canvasOfSize([height, width]) {
  const canvas = document.createElement('canvas');
  Object.assign(canvas, { width, height });
  return canvas;
}

/** @param {HTMLCanvasElement} canvas */
function contextOf(canvas) {
  const context = canvas.getContext('2d', { alpha: false });
  if (!context) throw new Error('no canvas to draw on');
  return context;
}
