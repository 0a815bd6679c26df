/**
 * The light mixer of a report: no session, no server, only planes that stand in the page.
 *
 * Every `.mixer` of the document is filled from the JSON inside it; without scripts it stays hidden.
 */
import { VALUES } from '../drawing/half.js';
import { Encoder, SRGB } from '../drawing/lut.js';
import { Mix } from '../drawing/mix.js';
import { Row, kelvinTable, luminance } from './mixer_light.js';
import { unpacked } from './unpack.js';

/** @typedef {import("./unpack.js").Compact} Compact */
/** @typedef {import("./mixer_light.js").Light} Light */
/** @typedef {import("../drawing/colour.js").RGB} RGB */

/** lights: those with a plane of their own, in the order of the planes. shown: of these, which have
 * sliders; the others are as they are in the look. rest: the others together,
 * as they are in the answer and at present: two more planes. lighting: the answer's file.
 * @typedef {{size: [number, number], planes: Compact[], lights: Light[], shown?: number[],
 *   rest: {label: string, answer: Record<string, RGB>, present: Record<string, RGB>} | null,
 *   kelvins: [number, RGB][], transform: {stops: number, low: number, high: number,
 *   curve: number[] | null, lattice: Compact | null}, painting: string | null,
 *   lighting: {target?: string, lights: Record<string, {emission: RGB, weight: RGB}>},
 *   command: string | null}} Data */

/** What a mixer of many looks begins from.
 * @typedef {{name: string, emission: Map<string, RGB>, kelvin: Map<string, number | null>,
 *   transform: Data['transform']}} Look */

/** Size of the picture of a light in its row, and which of its pixels is white there. */
const [THUMB, BRIGHT] = [88, 0.98];

class Mixer {
  /** @param {HTMLElement} root @param {Data} data @param {Uint16Array[]} planes
   * @param {import("../drawing/lut.js").Lut} lut */
  constructor(root, data, planes, lut) {
    this.data = data;
    this.planes = planes.map((halves, k) => ({ halves, scale: data.planes[k].scale }));
    this.encoder = new Encoder(lut, data.transform.stops);
    this.lut = lut;
    this.mix = new Mix(data.size);
    this.picture = canvasOf(data.size);
    this.isWaiting = false;
    this.look = /** @type {'answer' | 'present'} */ ('answer');
    const kelvins = kelvinTable(data.kelvins);
    const changed = () => this.draw();
    /** @type {Row[]} */
    this.rows = data.lights.map((light) => new Row(light, kelvins, changed));
    this.rows.forEach((row, k) => (row.plane = k));
    const { shown } = data;
    if (shown) this.rows = this.rows.filter((row) => shown.includes(row.plane));
    if (data.rest) {
      const one = /** @type {RGB} */ ([1, 1, 1]);
      const about = {
        name: data.rest.label,
        unit: '',
        isFixed: false,
        isScalar: true,
        isRest: true,
      };
      const light = {
        ...about,
        present: one,
        answer: one,
        kelvin: { present: null, answer: null },
      };
      const rest = new Row(light, kelvins, changed);
      rest.plane = this.rows.length;
      this.rows.push(rest);
    }
    const view = this.stage();
    view.append(...this.buttons());
    const list = made('div', 'mixer-lights');
    list.append(...this.rows.map((row) => row.element));
    root.append(view, list);
    for (const row of this.rows) this.thumb(row);
    this.reset('answer');
  }

  /** Painting and mix, one over the other. */
  stage() {
    const [height, width] = this.data.size;
    const { painting } = this.data;
    const view = made('div', 'mixer-view');
    const stage = made('div', 'mixer-stage');
    stage.style.aspectRatio = `${width} / ${height}`;
    this.picture.className = 'mixer-mix';
    this.picture.setAttribute('role', 'img');
    this.picture.setAttribute('aria-label', 'The mix of the lights');
    stage.append(this.picture);
    view.append(stage);
    if (!painting) return view;
    const image = /** @type {HTMLImageElement} */ (made('img', 'mixer-painting'));
    image.src = painting;
    image.alt = 'The painting';
    image.draggable = false;
    const edge = made('div', 'mixer-edge');
    edge.append(made('i'));
    stage.append(image, edge, made('span', 'mixer-tag', 'painting'));
    stage.append(made('span', 'mixer-tag is-right', 'mix'));
    // The mix is whole until somebody compares: a light may do something in one half alone.
    const wipe = range('Wipe: how much of the painting', 0, 100, 0);
    const move = () => {
      stage.style.setProperty('--p', `${wipe.value}%`);
      stage.classList.toggle('is-mix', Number(wipe.value) < 1);
      stage.classList.toggle('is-painting', Number(wipe.value) > 99);
    };
    wipe.addEventListener('input', move);
    drag(stage, (part) => {
      wipe.value = String(100 * part);
      move();
    });
    move();
    const label = made('label', 'mixer-wipe');
    label.append(made('span', '', 'Wipe'), wipe);
    view.append(label);
    return view;
  }

  /** What is done with all lights, and what has come of it. */
  buttons() {
    this.said = made('p', 'mixer-said');
    this.said.setAttribute('role', 'status');
    const buttons = made('div', 'mixer-buttons');
    buttons.append(
      button('Reset to answer', 'All lights as in the answer', () => this.reset('answer')),
      button('Reset to now', 'All lights as in the scene', () => this.reset('present')),
      button(
        'Copy as lighting.json',
        'The lights as the sliders set them; solo and mute do not count',
        () => this.copy(this.lighting(), 'lighting.json'),
      ),
    );
    const { command } = this.data;
    if (command)
      buttons.append(button('Copy command', command, () => this.copy(command, 'The command')));
    this.text = /** @type {HTMLTextAreaElement} */ (made('textarea', 'mixer-text'));
    this.text.readOnly = true;
    this.text.hidden = true;
    this.text.setAttribute('aria-label', 'To copy by hand');
    return [buttons, this.said, this.text];
  }

  /** @param {'answer' | 'present'} look */
  reset(look) {
    this.look = look;
    if (this.said) this.said.textContent = ''; // of what it was before
    for (const row of this.rows) row.reset(look);
    this.draw();
  }

  /** Weights of all planes, (n, 3): what is heard. */
  weights() {
    const isSolo = this.rows.some((row) => row.isSolo);
    const weights = new Float64Array(3 * this.planes.length);
    if (!isSolo) for (const k of this.others()) weights.set(this.data.lights[k][this.look], 3 * k);
    for (const row of this.rows) {
      const isHeard = isSolo ? row.isSolo : !row.isMute;
      // Of the rest, the plane of the look that was last gone back to.
      const plane = row.light.isRest && this.look === 'present' ? row.plane + 1 : row.plane;
      if (isHeard) weights.set(row.rgb, 3 * plane);
    }
    return weights;
  }

  /** Lights that have a plane and no sliders. @returns {number[]} */
  others() {
    const { shown, lights } = this.data;
    return shown ? lights.map((_, k) => k).filter((k) => !shown.includes(k)) : [];
  }

  draw() {
    if (this.isWaiting) return;
    this.isWaiting = true;
    requestAnimationFrame(() => {
      this.isWaiting = false;
      this.mix.weights = this.weights();
      this.mix.update(this.planes, 1, false);
      put(this.picture, this.mix.light, this.encoder);
    });
  }

  /** A small picture of what one light does alone. @param {Row} row */
  thumb(row) {
    const [height, width] = this.data.size;
    const alone = new Mix(this.data.size);
    alone.weights = new Float64Array(3 * this.planes.length);
    const { rgb } = row;
    alone.weights.set(luminance(rgb) > 0 ? rgb : [1, 1, 1], 3 * row.plane);
    alone.update(this.planes, 1, false);
    const bright = alone.light.filter((x) => x > 0).sort();
    const white = bright[Math.floor(BRIGHT * (bright.length - 1))] || 1;
    const whole = canvasOf(this.data.size);
    put(whole, alone.light, new Encoder(SRGB, -Math.log2(white)));
    const { thumb } = row;
    thumb.width = THUMB;
    thumb.height = Math.max(1, Math.round((THUMB * height) / width));
    const context = contextOf(thumb);
    context.imageSmoothingQuality = 'high';
    context.drawImage(whole, 0, 0, thumb.width, thumb.height);
  }

  /** The mix as a file that lightpaint reads. */
  lighting() {
    const file = structuredClone(this.data.lighting);
    /** @param {string} name @param {RGB} rgb */
    const set = (name, rgb) => {
      Object.assign(file.lights[name], { emission: [...rgb], weight: [...rgb] });
    };
    for (const k of this.others()) {
      const light = this.data.lights[k];
      set(light.name, light[this.look]);
    }
    for (const { light, rgb } of this.rows) {
      if (!light.isRest) set(light.name, rgb);
      else if (this.data.rest)
        for (const [name, its] of Object.entries(this.data.rest[this.look]))
          set(name, /** @type {RGB} */ (its.map((x, c) => x * rgb[c])));
    }
    for (const { light } of this.rows) if (light.isFixed) set(light.name, [1, 1, 1]);
    return JSON.stringify(file, null, 2) + '\n';
  }

  /** @param {string} text @param {string} what */
  async copy(text, what) {
    const { said, text: field } = this;
    if (!said || !field) return;
    field.hidden = true;
    field.value = text;
    try {
      await navigator.clipboard.writeText(text);
      said.textContent = `${what} is on the clipboard.`;
    } catch {
      // A page from a disk may not be let: then by hand.
      field.hidden = false;
      field.select();
      said.textContent = document.execCommand('copy')
        ? `${what} is on the clipboard.`
        : 'This browser does not allow copying here. Copy the selected text below.';
    }
  }
}

/** @param {HTMLCanvasElement} canvas @param {Float32Array} light @param {Encoder} encoder */
function put(canvas, light, encoder) {
  const image = new ImageData(canvas.width, canvas.height);
  encoder.pixels(light, image.data, 0, canvas.width * canvas.height);
  contextOf(canvas).putImageData(image, 0, 0);
}

/** @param {[height: number, width: number]} size */
function canvasOf([height, width]) {
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

/** @param {string} tag @param {string} [name] of its class @param {string} [text] */
function made(tag, name = '', text = '') {
  const element = document.createElement(tag);
  if (name) element.className = name;
  element.textContent = text;
  return element;
}

/** @param {string} label @param {number} min @param {number} max @param {number} value */
function range(label, min, max, value) {
  const input = /** @type {HTMLInputElement} */ (made('input'));
  Object.assign(input, { type: 'range', min, max, step: 'any', value });
  input.setAttribute('aria-label', label);
  return input;
}

/** @param {string} text @param {string} title @param {() => void} act */
function button(text, title, act) {
  const element = /** @type {HTMLButtonElement} */ (made('button', '', text));
  element.type = 'button';
  element.title = title;
  element.addEventListener('click', act);
  return element;
}

/** @param {HTMLElement} stage @param {(part: number) => void} hear where, of its width */
function drag(stage, hear) {
  const at = (/** @type {PointerEvent} */ event) => {
    const box = stage.getBoundingClientRect();
    hear(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)));
  };
  stage.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    stage.setPointerCapture(event.pointerId);
    at(event);
  });
  stage.addEventListener('pointermove', (event) => {
    if (stage.hasPointerCapture(event.pointerId)) at(event);
  });
}

/** @param {Data['transform']} about @returns {Promise<import("../drawing/lut.js").Lut>} */
async function lutOf({ low, high, curve, lattice }) {
  if (curve) {
    // Which lattice it is the diagonal of is not asked where there is a curve.
    const shaper = { side: curve.length, low, high };
    return { shaper, lattice: new Float32Array(1), curve: Float32Array.from(curve) };
  }
  if (!lattice) return SRGB;
  const halves = await unpacked(lattice);
  const values = Float32Array.from(halves, (bits) => VALUES[bits] * lattice.scale);
  return { shaper: { side: lattice.size[1], low, high }, lattice: values, curve: null };
}

/** What stands in a mixer, unpacked once. @type {WeakMap<HTMLElement, Promise<[Data, Uint16Array[]]>>} */
const read = new WeakMap();

/** @param {HTMLElement} root @returns {Promise<[Data, Uint16Array[]]>} */
function contents(root) {
  const known = read.get(root);
  if (known) return known;
  const text = root.querySelector('script[type="application/json"]')?.textContent ?? '';
  /** @type {Data} */
  const data = JSON.parse(text);
  const made = Promise.all(data.planes.map(unpacked)).then(
    (planes) => /** @type {[Data, Uint16Array[]]} */ ([data, planes]),
  );
  read.set(root, made);
  return made;
}

/** Show a mixer as its answer has it, or as a look has its lights; or say why there is none.
 * @param {HTMLElement} root @param {Look} [look]
 * @param {() => boolean} [isWanted] whether nothing else has been asked for while it was unpacked */
export async function begin(root, look, isWanted = () => true) {
  root.dataset.ready = '';
  const body = made('div', 'mixer-body');
  try {
    await fill(body, root, look);
  } catch (error) {
    body.append(made('p', 'mixer-said', whyNone(error)));
  }
  if (!isWanted()) return;
  root.querySelector('.mixer-body')?.remove();
  root.append(body);
  root.hidden = false;
}

/** @param {HTMLElement} body @param {HTMLElement} root @param {Look} [look] */
async function fill(body, root, look) {
  let [data, planes] = await contents(root);
  if (look) {
    const lights = data.lights.map((light) => {
      const answer = look.emission.get(light.name) ?? light.present;
      const kelvin = { ...light.kelvin, answer: look.kelvin.get(light.name) ?? null };
      return { ...light, answer, kelvin };
    });
    const lighting = { ...data.lighting, target: `${look.name}-mix` };
    data = { ...data, lights, lighting, transform: look.transform };
  }
  new Mixer(body, data, planes, await lutOf(data.transform));
}

/** @param {unknown} error */
function whyNone(error) {
  if (typeof DecompressionStream === 'undefined')
    return 'The mixer needs a newer browser, one that has DecompressionStream.';
  return `The mixer is not available: ${error instanceof Error ? error.message : error}`;
}

for (const root of document.querySelectorAll('.mixer:not([data-ready])'))
  if (root instanceof HTMLElement) begin(root);
