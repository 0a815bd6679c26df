/** Where a layer applies, over the pictures: what it does not cover is dimmed. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';

/** @typedef {import("../engine_interface.js").Engine} Engine */
/** @typedef {import("../engine_interface.js").Pane} Pane */
/** @typedef {import("../ui_state.js").Ui} Ui */

/** Alpha of the veil where nothing is covered: under the pointer, and while a mask is painted. */
const [SHOWN_ALPHA, PAINTED_ALPHA] = [200, 130];

/** @param {{ui: Ui, engine: Engine, panes: Pane[]}} props */
export function LayerMask({ ui, engine, panes }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const id = ui.hoveredLayer ?? ui.maskLayer;
  const isThere = id !== null && ui.layers.some((layer) => layer.id === id);
  const places = panes.map((pane) => Object.values(pane).join(' ')).join();
  useLayoutEffect(() => {
    if (!ref.current || !isThere || id === null) return undefined;
    const alpha = ui.hoveredLayer === null ? PAINTED_ALPHA : SHOWN_ALPHA;
    const paint = () => ref.current && draw(ref.current, engine.coverage(id), panes, alpha);
    paint();
    if (ui.hoveredLayer !== null) return undefined;
    // Under the brush it follows the mask.
    let frame = 0;
    const follow = () => {
      frame ||= requestAnimationFrame(() => {
        frame = 0;
        paint();
      });
    };
    engine.onMaskChange = follow;
    return () => {
      cancelAnimationFrame(frame);
      engine.onMaskChange = () => {};
    };
  }, [id, isThere, ui.hoveredLayer === null, ui.layerRevisions[id ?? -1], ui.view, places]);
  return html`<canvas class="layer-mask" ref=${ref} hidden=${!isThere} aria-hidden="true"></canvas>`;
}

/** @param {HTMLCanvasElement} canvas
 * @param {{data: Float32Array, width: number, height: number}} coverage @param {Pane[]} panes
 * @param {number} most alpha */
function draw(canvas, { data, width, height }, panes, most) {
  const ratio = Math.max(1, window.devicePixelRatio || 1);
  canvas.width = Math.round(canvas.clientWidth * ratio);
  canvas.height = Math.round(canvas.clientHeight * ratio);
  const context = canvas.getContext('2d');
  if (!context || !data.length) return;
  const veil = document.createElement('canvas');
  veil.width = width;
  veil.height = height;
  const image = new ImageData(width, height);
  for (let p = 0; p < data.length; p += 1) image.data[4 * p + 3] = most * (1 - data[p]);
  veil.getContext('2d')?.putImageData(image, 0, 0);
  for (const pane of panes) {
    context.save();
    context.beginPath();
    context.rect(pane.x * ratio, pane.y * ratio, pane.width * ratio, pane.height * ratio);
    context.clip();
    context.drawImage(
      veil,
      pane.left * ratio,
      pane.top * ratio,
      width * pane.scale * ratio,
      height * pane.scale * ratio,
    );
    context.restore();
  }
}
