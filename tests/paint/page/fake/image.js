/** An image among the lights: the last of a made-up room are its texels. */

/** @param {any} host @param {string} size "COLUMNSxROWS"
 * @param {string | null} finer "COLUMN,ROW" of a texel that is split again; null for none */
export function split(host, size, finer) {
  const [columns, rows] = size.split('x').map(Number);
  const names = finer ? finerNames(columns, rows, finer) : grid(columns, rows, nameOf);
  const distinct = [...new Set(names.flat())].sort((a, b) => Number(isFiner(a)) - Number(isFiner(b)));
  const { lights } = host.room;
  const first = lights.length - distinct.length;
  distinct.forEach((name, k) => (lights[first + k].name = name));
  const places = names.map((row) => row.map((name) => first + distinct.indexOf(name)));
  const shares = places.map((row) => row.map(() => 1 / names.flat().length));
  const { state } = host;
  host.state = () => ({
    ...state.call(host),
    images: [{ name: 'sky', places, shares, aspect: 2 }],
  });
}

/** @param {number} x @param {number} y */
const nameOf = (x, y) => `sky.x${x}.y${y}`;

/** @param {string} name */
const isFiner = (name) => name.includes('.sun1.');

/** The names of the nearest texels on the finer grid, of which those around one place are its own.
 * @param {number} columns @param {number} rows @param {string} finer */
function finerNames(columns, rows, finer) {
  const [column, row] = finer.split(',').map(Number);
  return grid(3 * columns, 3 * (rows - 1) + 1, (x, y) =>
    Math.abs(x - 3 * column - 1) <= 2 && Math.abs(y - 3 * row) <= 2
      ? `sky.sun1.x${x}.y${y}`
      : nameOf(Math.floor(x / 3), Math.floor((y + 1) / 3)),
  );
}

/** @template T @param {number} columns @param {number} rows @param {(x: number, y: number) => T} at */
const grid = (columns, rows, at) =>
  Array.from({ length: rows }, (_, y) => Array.from({ length: columns }, (_, x) => at(x, y)));
