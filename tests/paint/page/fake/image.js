/** An image among the lights: the last of a made-up room are its texels. */

/** @param {any} host @param {string} size "COLUMNSxROWS" */
export function split(host, size) {
  const [columns, rows] = size.split('x').map(Number);
  const { lights } = host.room;
  const first = lights.length - columns * rows;
  const places = Array.from({ length: rows }, (_, y) =>
    Array.from({ length: columns }, (_, x) => {
      lights[first + y * columns + x].name = `sky.x${x}.y${y}`;
      return first + y * columns + x;
    }),
  );
  const shares = places.map((row) => row.map(() => 1 / (columns * rows)));
  const { state } = host;
  host.state = () => ({
    ...state.call(host),
    images: [{ name: 'sky', places, shares, aspect: 2 }],
  });
}
