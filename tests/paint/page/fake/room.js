/** A made-up room: planes of lights on walls, a floor and three balls, in closed form. */

/** @param {number} n @param {string} text "WIDTHxHEIGHT" */
export function makeRoom(n, text) {
  const [w, h] = text.split('x').map(Number);
  const surfaces = Array.from({ length: w * h }, (_, at) =>
    seen((at % w) / w, Math.floor(at / w) / h, w / h),
  );
  const lights = Array.from({ length: n }, (_, k) => light(k, n));
  const planes = lights.map(({ at }) => plane(surfaces, at));
  const objects = ['back wall', 'left wall', 'floor', 'red ball', 'white ball', 'blue <b>ball</b>'];
  return { w, h, n, lights, planes, objects, surfaces };
}

const NAMES = ['key', 'window left', 'pendant', 'cove', 'sconce', 'sun', 'spot stage', 'lamp'];
const WHITES = [
  [1, 0.72, 0.42],
  [0.75, 0.87, 1],
  [1, 0.6, 0.3],
  [1, 0.83, 0.66],
  [1, 0.5, 0.2],
  [1, 0.95, 0.9],
];

/** @param {number} k @param {number} n */
function light(k, n) {
  const turn = (k + 0.5) / n;
  const at = [
    0.08 + 0.84 * ((turn * 2.618) % 1),
    0.05 + 0.35 * ((k * 0.37) % 1),
    0.15 + 0.7 * ((k * 0.618) % 1),
  ];
  const name = k < NAMES.length ? NAMES[k] : `row ${k}`;
  return {
    at,
    name,
    present: WHITES[k % 6].map((x) => (k === 3 ? 0 : x * (4 / n) * (0.4 + 0.5 * ((k * 0.7) % 1)))),
  };
}

/** What is seen at a place: its position, normal, albedo and object. */
function seen(x, y, aspect) {
  const balls = [
    [0.3, 0.74, 0.13, [0.6, 0.08, 0.06], 3],
    [0.56, 0.8, 0.1, [0.75, 0.75, 0.72], 4],
    [0.78, 0.7, 0.15, [0.1, 0.15, 0.5], 5],
  ];
  for (const [cx, cy, r, albedo, object] of balls) {
    const [dx, dy] = [(x - cx) * aspect, y - cy];
    const d2 = (dx * dx + dy * dy) / (r * r);
    if (d2 < 1) {
      const z = Math.sqrt(1 - d2);
      return { p: [x, y - 0.02, 0.45 - 0.1 * z], n: [dx / r, dy / r, -z], albedo, object };
    }
  }
  if (y > 0.72)
    return {
      p: [x, 0.92, 1 - (y - 0.72) * 3],
      n: [0, -1, 0],
      albedo: (Math.floor(x * 12) + Math.floor(y * 26)) % 2 ? [0.4, 0.33, 0.25] : [0.3, 0.24, 0.18],
      object: 2,
    };
  if (x < 0.12 + (y - 0.3) * 0.06)
    return { p: [0.05, y, x * 6], n: [1, 0, 0], albedo: [0.42, 0.45, 0.4], object: 1 };
  const art = x > 0.42 && x < 0.62 && y > 0.2 && y < 0.48;
  return {
    p: [x, y, 1],
    n: [0, 0, -1],
    albedo: art ? [0.55, 0.3 + 0.4 * ((x * 9) % 1), 0.2] : [0.62, 0.58, 0.52],
    object: 0,
  };
}

function plane(surfaces, at) {
  const made = new Float32Array(surfaces.length * 3);
  surfaces.forEach(({ p, n, albedo }, i) => {
    const to = at.map((x, c) => x - p[c]);
    const far2 = to[0] ** 2 + to[1] ** 2 + to[2] ** 2 + 0.015;
    const facing = Math.max(0, (to[0] * n[0] + to[1] * n[1] + to[2] * n[2]) / Math.sqrt(far2));
    for (let c = 0; c < 3; c += 1) made[3 * i + c] = albedo[c] * (0.03 + (0.09 * facing) / far2);
  });
  return made;
}
