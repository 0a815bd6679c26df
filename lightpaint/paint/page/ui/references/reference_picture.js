/** The picture of a reference: its light can be picked, and places in it compared. */

import { VALUES } from '../../../../viewer/drawing/half_floats.js';
import { t } from '../../language/language.js';
import { html, useRef, useState } from '../../vendor/preact.js';
import { Thumbnail } from '../thumbnail.js';
import { pickPaint } from '../tools.js';
import { shownPairs } from './reference_state.js';
import { ARROW_STEPS } from '../key_bindings.js';

/** @import { App, Pane, RGB, Ui } from '../ui_state.js' */
/** @import { ReferenceInfo } from '../../engine/messages.js' */
/** @typedef {[number, number]} Place as shares of width and height */

/** Pixels of the reduced light on each side of a place that are picked together. */
const PICK_RADIUS = 2;

/** How far an arrow key moves the cross, as a share of the picture. */
const KEY_STEP = 0.02;

/** Use the light of a reference at a place as paint. @param {App} app @param {number} id
 * @param {Place} place */
async function pickLight({ session, store }, id, [x, y]) {
  const { data, shape } = await session.host.fetch(`reference_light/${id}`);
  const [height, width] = shape;
  const [row, column] = [Math.floor(y * height), Math.floor(x * width)];
  const sum = [0, 0, 0];
  let count = 0;
  for (let i = row - PICK_RADIUS; i <= row + PICK_RADIUS; i += 1)
    for (let j = column - PICK_RADIUS; j <= column + PICK_RADIUS; j += 1) {
      if (i < 0 || j < 0 || i >= height || j >= width) continue;
      for (let c = 0; c < 3; c += 1) sum[c] += VALUES[data[3 * (i * width + j) + c]];
      count += 1;
    }
  pickPaint(store, /** @type {RGB} */ (sum.map((value) => value / Math.max(1, count))));
}

/** @param {{reference: ReferenceInfo, ui: Ui, app: App}} props */
export function ReferencePicture({ reference, ui, app }) {
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  const [cross, setCross] = useState(/** @type {Place | null} */ (null));
  const act = (/** @type {Place} */ place, /** @type {boolean} */ isPicking) => {
    if (isPicking || ui.comparedAreas !== 'pairs') void pickLight(app, reference.id, place);
    else app.store.set({ clickAction: { mode: 'pair', reference: place, owner: reference.id } });
  };
  const press = (/** @type {PointerEvent} */ event) => {
    if (event.button !== 0 || !frame.current) return;
    const { left, top, width, height } = frame.current.getBoundingClientRect();
    const share = (/** @type {number} */ x) => Math.min(1, Math.max(0, x));
    const place = /** @type {Place} */ ([
      share((event.clientX - left) / width),
      share((event.clientY - top) / height),
    ]);
    act(place, event.altKey || ui.tool === 'pick');
  };
  const key = (/** @type {KeyboardEvent} */ event) => {
    const step = ARROW_STEPS[event.key];
    if (!step && event.key !== 'Enter') return;
    event.preventDefault();
    event.stopPropagation();
    const [x, y] = cross ?? [0.5, 0.5];
    const move = (/** @type {number} */ at, /** @type {number} */ by) =>
      Math.min(1, Math.max(0, at + KEY_STEP * by));
    if (step) setCross([move(x, step[0]), move(y, step[1])]);
    else act([x, y], ui.tool === 'pick');
  };
  const pairs = ui.comparedAreas === 'pairs' ? shownPairs(ui) : [];
  const { clickAction } = ui;
  const open = clickAction?.mode === 'pair' ? clickAction.reference : null;
  return html`<div class="reference-picture" role="application" tabindex="0" ref=${frame}
    aria-label=${t('{name}. A press takes its light as paint, or a place. Arrow keys and Enter do the same.', { name: reference.name })}
    onPointerDown=${press} onKeyDown=${key} onBlur=${() => setCross(null)}>
    <${Thumbnail} name=${`reference/${reference.id}`} generation=${0} app=${app} />
    ${pairs.map(
      (pair, k) => html`<${PairMark} key=${k} place=${pair.reference} label=${String(k + 1)} />`,
    )}
    ${open && html`<${PairMark} place=${open} label=${String(pairs.length + 1)} isOpen />`}
    ${cross && html`<${PairMark} place=${cross} label="+" isOpen />`}
  </div>`;
}

/** @param {{place: number[], label: string, isOpen?: boolean}} props */
function PairMark({ place: [x, y], label, isOpen }) {
  return html`<i class=${`pair-mark ${isOpen ? 'is-open' : ''}`} aria-hidden="true"
    style=${{ left: `${100 * x}%`, top: `${100 * y}%` }}>${label}</i>`;
}

/** The places of pairs in the pictures. @param {{ui: Ui, panes: Pane[]}} props */
export function PairMarks({ ui, panes }) {
  if (!ui.isReferenceOpen || ui.comparedAreas !== 'pairs') return null;
  const [rows, columns] = ui.state.size;
  return shownPairs(ui).flatMap((pair, k) =>
    panes.map((pane, p) => {
      const [x, y] = pair.picture;
      const left = pane.left + x * columns * pane.scale;
      const top = pane.top + y * rows * pane.scale;
      const isSeen =
        left >= pane.x && left < pane.x + pane.width && top >= pane.y && top < pane.y + pane.height;
      return (
        isSeen &&
        html`<i class="pair-mark" key=${`${k} ${p}`} aria-hidden="true"
          style=${{ left: `${left}px`, top: `${top}px` }}>${k + 1}</i>`
      );
    }),
  );
}

/** Complete a pair by its place in the picture. @param {App} app
 * @param {{mode: "pair", reference: Place, owner: number}} action
 * @param {{x: number, y: number}} point in pixels of the picture */
export function completePair({ store }, { reference, owner }, { x, y }) {
  const [rows, columns] = store.value.state.size;
  const picture = /** @type {Place} */ ([x / columns, y / rows]);
  if (picture.some((share) => share < 0 || share > 1)) return;
  store.set(({ placePairs, view }) => ({
    clickAction: null,
    placePairs: [...placePairs, { owner, view, reference, picture }],
  }));
}
