/** A thumbnail from the session, on a canvas of its own. */

import { html, useEffect, useRef } from '../vendor/preact.js';

/** @import { App, Picture, Ui } from './ui_state.js' */

/** @param {{name: string, generation?: number, app: App}} props generation:
 *   undefined while there is no such picture */
export function Thumbnail({ name, generation, app }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const drawnName = useRef(/** @type {string | null} */ (null));
  useEffect(() => {
    if (generation === undefined) return undefined;
    const { session, store } = app;
    let isUnmounted = false;
    let isLoaded = false;
    // Clear the picture of something else.
    if (ref.current && drawnName.current !== null && drawnName.current !== name) clear(ref.current);
    drawnName.current = null;
    const fetch = () =>
      session.host.fetch(name).then(
        (picture) => {
          isLoaded = true;
          if (isUnmounted || !ref.current) return;
          drawPicture(ref.current, picture);
          drawnName.current = name;
        },
        () => undefined, // A missing thumbnail is not reported.
      );
    void fetch();
    // A page that has just lost the session gets no picture until it has the session again.
    let wasClosed = store.value.closure !== null;
    const stopListening = store.listen(() => {
      const isClosed = store.value.closure !== null;
      if (wasClosed && !isClosed && !isLoaded) void fetch();
      wasClosed = isClosed;
    });
    return () => {
      isUnmounted = true;
      stopListening();
    };
  }, [name, generation]);
  return html`<canvas class="thumb" ref=${ref} width="1" height="1"
    aria-hidden="true"></canvas>`;
}

/** Return the style of a sheet of pictures of a view: their places are as high before they come.
 * @param {Ui} ui */
export function sheetStyle({ views, view }) {
  const [height, width] = views[view]?.size ?? [9, 16];
  return { '--aspect': `${width} / ${height}` };
}

/** @param {HTMLCanvasElement} canvas */
function clear(canvas) {
  canvas.getContext('2d')?.clearRect(0, 0, canvas.width, canvas.height);
}

/** @param {HTMLCanvasElement} canvas @param {Picture} picture (h, w, 3) */
export function drawPicture(canvas, { data, shape: [height, width] }) {
  canvas.width = width;
  canvas.height = height;
  const pixels = new ImageData(width, height);
  for (let i = 0; i < width * height; i += 1) {
    for (let c = 0; c < 3; c += 1) pixels.data[4 * i + c] = data[3 * i + c];
    pixels.data[4 * i + 3] = 255;
  }
  canvas.getContext('2d')?.putImageData(pixels, 0, 0);
}
