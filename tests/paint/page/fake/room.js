/** A made-up room: planes of lights on walls, a floor and three balls, in closed form. */

/** @param {number} n @param {string} text "WIDTHxHEIGHT" */
export function makeRoom(n, text) {
  const [w, h] = text.split("x").map(Number);
  const surfaces = Array.from({ length: w * h }, (_, at) => seen((at % w) / w, Math.floor(at / w) / h, w / h));
  const lights = Array.from({ length: n }, (_, k) => light(k, n));
  const planes = lights.map(({ at }) => plane(surfaces, at));
  const objects = ["back wall", "left wall", "floor", "red ball", "white ball", "blue <b>ball</b>"];
  return { w, h, n, lights, planes, objects, surfaces };
}

const NAMES = ["key", "window left", "pendant", "cove", "sconce", "sun", "spot stage", "lamp"];
const WHITES = [[1, .72, .42], [.75, .87, 1], [1, .6, .3], [1, .83, .66], [1, .5, .2], [1, .95, .9]];

/** @param {number} k @param {number} n */
function light(k, n) {
  const turn = (k + 0.5) / n;
  const at = [0.08 + 0.84 * ((turn * 2.618) % 1), 0.05 + 0.35 * ((k * 0.37) % 1), 0.15 + 0.7 * ((k * 0.618) % 1)];
  const name = k < NAMES.length ? NAMES[k] : `row ${k}`;
  return { at, name, present: WHITES[k % 6].map((x) => (k === 3 ? 0 : x * (4 / n) * (0.4 + 0.5 * ((k * 0.7) % 1)))) };
}

/** What is seen at a place: its position, normal, albedo and object. */
function seen(x, y, aspect) {
  const balls = [[.3, .74, .13, [.6, .08, .06], 3], [.56, .8, .1, [.75, .75, .72], 4], [.78, .7, .15, [.1, .15, .5], 5]];
  for (const [cx, cy, r, albedo, object] of balls) {
    const [dx, dy] = [(x - cx) * aspect, y - cy];
    const d2 = (dx * dx + dy * dy) / (r * r);
    if (d2 < 1) {
      const z = Math.sqrt(1 - d2);
      return { p: [x, y - 0.02, 0.45 - 0.1 * z], n: [dx / r, dy / r, -z], albedo, object };
    }
  }
  if (y > 0.72) return { p: [x, 0.92, 1 - (y - 0.72) * 3], n: [0, -1, 0], albedo: ((Math.floor(x * 12) + Math.floor(y * 26)) % 2) ? [.4, .33, .25] : [.3, .24, .18], object: 2 };
  if (x < 0.12 + (y - 0.3) * 0.06) return { p: [0.05, y, x * 6], n: [1, 0, 0], albedo: [.42, .45, .4], object: 1 };
  const art = x > .42 && x < .62 && y > .2 && y < .48;
  return { p: [x, y, 1], n: [0, 0, -1], albedo: art ? [.55, .3 + .4 * ((x * 9) % 1), .2] : [.62, .58, .52], object: 0 };
}

function plane(surfaces, at) {
  const made = new Float32Array(surfaces.length * 3);
  surfaces.forEach(({ p, n, albedo }, i) => {
    const to = at.map((x, c) => x - p[c]);
    const far2 = to[0] ** 2 + to[1] ** 2 + to[2] ** 2 + 0.015;
    const facing = Math.max(0, (to[0] * n[0] + to[1] * n[1] + to[2] * n[2]) / Math.sqrt(far2));
    for (let c = 0; c < 3; c += 1) made[3 * i + c] = albedo[c] * (0.03 + 0.09 * facing / far2);
  });
  return made;
}
