/** The panel that shows where and why the answer differs, and verifies it with a render. */

import { html, useEffect, useLayoutEffect, useMemo, useRef } from '../vendor/preact.js';
import { ProgressBar } from './progress_bar.js';
import { Button, Choice } from './controls.js';
import { number, progressText, unbroken } from './format.js';
import { Icon } from './icons.js';
import { overlayOf } from './ui_state.js';
import { updateShow } from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */
/** @typedef {import("./engine_interface.js").Pane} Pane */

const OVERLAYS = [
  { value: null, label: 'None' },
  { value: 'missed', label: 'Difference', tip: 'Where the answer differs from the painting' },
  { value: 'beyond', label: 'Out of reach', tip: 'What no setting of these lights can do' },
  { value: 'falsecolor', label: 'False colour', tip: 'Brightness in stops' },
  { value: 'importance', label: 'Importance', tip: 'What is painted, and how much it counts' },
];

const PAINTED = 'painted';

/** Legends of the overlays: colours and hatches. @type {Record<string, string[]>} */
const MEANINGS = {
  missed: ['too dark', 'matches', 'too bright'],
  beyond: ['in reach', 'out of reach'],
  falsecolor: ['−6 stops', 'grey', '+6'],
  importance: ['unpainted', PAINTED],
};

/** @param {{ui: Ui, app: App}} props */
export function AnalysisPanel({ ui, app }) {
  const { session, store } = app;
  const choose = (/** @type {any} */ overlay) => updateShow(store, { overlay });
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  // The reasons need more room than the text before them.
  useLayoutEffect(() => {
    const panel = /** @type {HTMLElement | null | undefined} */ (frame.current?.closest('.fold'));
    if (panel && ui.explained.length && isInSight(panel))
      panel.scrollIntoView({ block: 'nearest' });
  }, [ui.explained]);
  // The first reason is also below the pictures.
  const sentences = (ui.explained.length ? ui.explained : ui.sentences).filter(
    (text) => text !== ui.headline,
  );
  return html`<div class="truth" ref=${frame}>
    <${Choice} label="Overlay" value=${ui.show.overlay} choices=${OVERLAYS}
      change=${choose} />
    ${sentences.map((text) => html`<p key=${text}>${unbroken(text)}</p>`)}
    <div class="row">
      <${Button} label=${ui.explaining ? 'Finding reasons …' : 'Why not closer?'}
        disabled=${ui.explaining} act=${() => session.explain()}
        tip="What keeps the answer from matching the painting" />
      ${ui.explaining && html`<${ProgressBar} progress=${{ done: 0, total: 0 }} label="Finding reasons" />`}
      ${ui.state?.can_render && html`<${Verify} ui=${ui} app=${app} />`}
    </div>
    ${ui.verified && html`<${Verified} ui=${ui} app=${app} />`}
  </div>`;
}

/** Return whether part of a panel is visible in the side bar. @param {HTMLElement} panel */
function isInSight(panel) {
  const [its, room] = [panel, /** @type {HTMLElement} */ (panel.parentElement)].map((one) =>
    one.getBoundingClientRect(),
  );
  return its.top < room.bottom - 60 && its.bottom > room.top + 60;
}

/** CSS pixels: height of a legend, of one on a single line, and the gap to its picture. */
const LEGEND = { width: 210, height: 60, low: 22, gap: 8 };

/** Place it where it covers nothing: below the picture, else beside it; without room for either, on
 * the picture, as a single line. @param {Pane} pane
 * @param {[height: number, width: number]} size */
function placed(pane, [rows, columns]) {
  const { width, height, low, gap } = LEGEND;
  const left = Math.max(pane.x, pane.left);
  // The handle of the wipe lies there.
  const inside = left > Math.max(0, pane.left) ? 3 * gap : gap;
  const right = Math.min(pane.x + pane.width, pane.left + columns * pane.scale);
  const bottom = Math.min(pane.y + pane.height, pane.top + rows * pane.scale);
  const below = pane.y + pane.height - bottom;
  if (below >= height + gap) return { left: left + inside, top: bottom + gap };
  if (below >= low + 4) return { left: left + inside, top: bottom + 2, isLow: true };
  const room = width + 2 * gap;
  if (pane.x + pane.width - right >= room) return { left: right + gap, top: bottom - height };
  if (left - pane.x >= room) return { left: left - gap - width, top: bottom - height };
  return { left: left + inside, top: bottom - low - gap, isLow: true };
}

/** The legend at a picture with an overlay. The overlay of what is out of reach is requested again
 * when it is visible and the answer has changed.
 * @param {{ui: Ui, app: App, panes: Pane[]}} props */
export function Legend({ ui, app, panes }) {
  const overlay = overlayOf(ui);
  const isSought = overlay === 'beyond' && ui.deltaE !== null && !ui.isLive && !ui.explained.length;
  useEffect(() => {
    if (isSought && !ui.explaining) app.session.explain();
  }, [isSought, ui.explaining]);
  const isCounted = overlay === 'importance';
  const most = useMemo(
    () => (isCounted ? app.engine.greatest() : 1),
    [isCounted, ui.version, ui.weights, ui.view],
  );
  const on = overlay === 'importance' ? 'painting' : 'solution';
  const pane =
    panes.find(({ kind }) => kind === on) ?? (overlay === 'falsecolor' ? panes[0] : undefined);
  if (!overlay || !pane) return null;
  const { label } = OVERLAYS.find(({ value }) => value === overlay) ?? OVERLAYS[0];
  const isOld = overlay === 'beyond' && !ui.explained.length;
  const { left, top, isLow } = placed(pane, ui.state.size);
  const words = MEANINGS[overlay].map((text) =>
    text === PAINTED && most > 1 ? `weight ${number(most, 2)} ×` : text,
  );
  return html`<div class=${`legend ${isLow ? 'is-low' : ''}`}
    style=${{ top: `${top}px`, left: `${left}px` }}>
    <b>${label}${isOld && ui.deltaE !== null ? ': computing …' : ''}</b>
    <i class=${`is-${overlay}`}></i>
    ${words.map((text, k) => html`<span key=${k}>${text}</span>`)}
  </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function Verify({ ui, app }) {
  const { session } = app;
  if (!ui.verifying) {
    // Ignore the second click of a double click on "Analysis", under which the button appears.
    const begin = (/** @type {MouseEvent} */ { detail }) => detail < 2 && session.verify();
    return html`<${Button} label="Verify" icon="camera" act=${begin}
      tip="Render the scene with this lighting, and compare" />`;
  }
  return html`<${Button} label="Stop" icon="close" act=${() => session.verify(false)} />
    <${ProgressBar} progress=${ui.verifying} label="Verifying" />
    <span class="faint">${progressText(ui.verifying)}</span>`;
}

/** @param {{ui: Ui, app: App}} props */
function Verified({ ui, app }) {
  const { verified, show } = ui;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  // Scroll to it: it may be outside the visible part.
  useLayoutEffect(() => frame.current?.scrollIntoView?.({ block: 'nearest' }), [verified]);
  if (!verified) return null;
  const isShown = show.left === 'solution' && show.right === 'verified';
  const compare = () => {
    app.store.set({ mix: null });
    updateShow(
      app.store,
      isShown
        ? { left: 'painting', right: 'solution', layout: 'side' }
        : { left: 'solution', right: 'verified', layout: 'wipe', instead: null },
    );
  };
  return html`<div ref=${frame} class=${`verified ${verified.agrees ? 'is-good' : 'is-bad'}`}>
    <p><${Icon} name=${verified.agrees ? 'check' : 'warn'} /><span>${verified.text}${
      verified.isOld ? ' (of an earlier answer)' : ''
    }</span></p>
    <${Button} label="Answer | Render" icon="wipe" on=${isShown} act=${compare} />
  </div>`;
}
