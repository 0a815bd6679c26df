/** Where a layer applies, over the pictures: what it does not cover is dimmed. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { drawOverPanes, fitCanvas, placesOf } from '../pane_canvas.js';

/** @import { Engine, Pane, Ui } from '../ui_state.js' */

/** Alpha of the veil where nothing is covered: under the pointer, and while a mask is painted. */
const [SHOWN_ALPHA, PAINTED_ALPHA] = [200, 130];

/** @param {{ui: Ui, engine: Engine, panes: Pane[]}} props */
export function LayerMask({ ui, engine, panes }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const id = ui.hoveredLayer ?? ui.maskLayer;
  const isThere = id !== null && ui.layers.some((layer) => layer.id === id);
  const places = placesOf(panes);
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
  const { context, ratio } = fitCanvas(canvas);
  if (!context || !data.length) return;
  const veil = new ImageData(width, height);
  for (let p = 0; p < data.length; p += 1) veil.data[4 * p + 3] = most * (1 - data[p]);
  drawOverPanes(context, veil, panes, ratio);
}
