/** Sums of weighted planes, Σ weights[k] · plane[k], without a GPU. */
import { VALUES } from './half_floats.js';

/** step: between the pixels and rows that halves hold.
 * @typedef {{halves: Uint16Array | null, scale: number, step: number}} Plane (h, w, 3), light at
 *   unit emission over scale */

/** The mix of planes with weights, at every step-th pixel of every step-th row. If possible, an update
 * adds only planes whose weights have changed. */
export class Mix {
  /** @param {[height: number, width: number]} size */
  constructor(size) {
    this.size = size;
    this.weights = new Float64Array();
    /** Weights that `light` holds. @type {Float64Array | null} */
    this.appliedWeights = null;
    this.step = 1;
    this.isExact = true;
    this.fullLight = new Float32Array(0);
    this.halfLight = new Float32Array(0);
  }

  /** (h, w, 3) linear, at the step of the last update. */
  get light() {
    return this.step === 1 ? this.fullLight : this.halfLight;
  }

  /** Note that planes have changed. */
  invalidate() {
    this.appliedWeights = null;
  }

  /** Update the mix. live: whether to update sums incrementally, which accumulates round-off.
   * @param {Plane[]} planes @param {number} step as `stepFor` in coarse_planes.js returns it @param {boolean} live
   * @returns {boolean} whether `light` is another one */
  update(planes, step, live) {
    const weights = this.weights;
    const previous = step === this.step ? this.appliedWeights : null;
    const isSame = previous !== null && weights.every((w, i) => w === previous[i]);
    if (isSame && (live || this.isExact)) return false;
    const changedPlanes = previous
      ? [...planes.keys()].filter((k) => [0, 1, 2].some((c) => weights[3 * k + c] !== previous[3 * k + c]))
      : [];
    this.step = step;
    const isIncremental = live && previous !== null && 2 * changedPlanes.length <= planes.length;
    if (isIncremental) {
      const differences = weights.map((w, i) => w - previous[i]);
      this.add(planes, changedPlanes, differences, false);
    } else this.add(planes, [...planes.keys()], weights, true);
    this.isExact = !isIncremental;
    this.appliedWeights = weights.slice();
    return true;
  }

  /** @param {Plane[]} planes @param {number[]} indices @param {Float64Array} weights
   * @param {boolean} startsFromBlack */
  add(planes, indices, weights, startsFromBlack) {
    const [height, width] = this.size.map((length) => Math.ceil(length / this.step));
    const name = this.step === 1 ? 'fullLight' : 'halfLight';
    if (this[name].length !== height * width * 3) this[name] = new Float32Array(height * width * 3);
    const terms = [];
    for (const k of indices) {
      const { halves, scale, step } = planes[k];
      const [r, g, b] = [0, 1, 2].map((c) => weights[3 * k + c] * scale);
      if (halves && (r || g || b)) terms.push({ halves, step, weights: [r, g, b] });
    }
    addPlanes(this[name], terms, this.size[1], width, this.step, startsFromBlack);
  }

  memory() {
    return this.fullLight.byteLength + this.halfLight.byteLength;
  }
}

/** @typedef {{halves: Uint16Array, step: number, weights: number[]}} Term */

/** Add planes to light, four at a time in all pixels.
 * @param {Float32Array} light @param {Term[]} terms @param {number} planeWidth width of the planes
 * @param {number} width of the light @param {number} step @param {boolean} startsFromBlack whether light
 * starts from black */
function addPlanes(light, terms, planeWidth, width, step, startsFromBlack) {
  let isFresh = startsFromBlack;
  const whole = terms.filter((term) => term.step === 1);
  let next = 0;
  for (; next + 4 <= whole.length; next += 4) {
    addFour(light, whole.slice(next, next + 4), planeWidth, width, step, isFresh);
    isFresh = false;
  }
  if (isFresh) light.fill(0);
  const others = [...whole.slice(next), ...terms.filter((term) => term.step > 1)];
  for (const term of others)
    addOne(light, term, Math.ceil(planeWidth / term.step), width, step / term.step);
}

/** @param {Float32Array} light @param {Term[]} terms @param {number} planeWidth
 * @param {number} width @param {number} step @param {boolean} startsFromBlack */
function addFour(light, terms, planeWidth, width, step, startsFromBlack) {
  const [a, b, c, d] = terms.map((term) => term.halves);
  const [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2], [d0, d1, d2]] = terms.map((x) => x.weights);
  const values = VALUES;
  const [stride, row] = [3 * step, 3 * width];
  for (let p = 0, y = 0; p < light.length; y += step) {
    const end = p + row;
    for (let i = 3 * planeWidth * y; p < end; i += stride, p += 3) {
      const j = i + 1;
      const k = i + 2;
      const r = a0 * values[a[i]] + b0 * values[b[i]] + c0 * values[c[i]] + d0 * values[d[i]];
      const g = a1 * values[a[j]] + b1 * values[b[j]] + c1 * values[c[j]] + d1 * values[d[j]];
      const e = a2 * values[a[k]] + b2 * values[b[k]] + c2 * values[c[k]] + d2 * values[d[k]];
      if (startsFromBlack) {
        light[p] = r;
        light[p + 1] = g;
        light[p + 2] = e;
      } else {
        light[p] += r;
        light[p + 1] += g;
        light[p + 2] += e;
      }
    }
  }
}

/** @param {Float32Array} light @param {Term} term @param {number} planeWidth @param {number} width
 * @param {number} step */
function addOne(light, { halves, weights }, planeWidth, width, step) {
  const [r, g, b] = weights;
  const values = VALUES;
  const [stride, row] = [3 * step, 3 * width];
  for (let p = 0, y = 0; p < light.length; y += step) {
    const end = p + row;
    for (let i = 3 * planeWidth * y; p < end; i += stride, p += 3) {
      light[p] += r * values[halves[i]];
      light[p + 1] += g * values[halves[i + 1]];
      light[p + 2] += b * values[halves[i + 2]];
    }
  }
}
