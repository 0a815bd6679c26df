/** Notices: toasts, banners about the connection, running tasks, tool tips. */

import { html, useEffect, useRef, useState } from '../vendor/preact.js';
import { Button } from './controls.js';
import { runningRender } from './exports/render_state.js';
import { progressText } from './format.js';
import { Icon } from './icons.js';
import { keysText } from './key_names.js';
import { ProgressBar } from './progress_bar.js';
import { fill, fillCount, words } from '../language/language.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {{ui: Ui, app: App}} props */
export function Toasts({ ui, app }) {
  return html`<div class="toasts" role="log" aria-live="polite" aria-label=${words.notices.messages}>
    ${ui.toasts.map(
      ({ id, text, tone }) => html`<div class=${`toast is-${tone}`} key=${id}>
      ${tone === 'warn' && html`<${Icon} name="warn" />`}<span>${text}</span>
      <${Button} icon="close" tip=${words.notices.dismiss} act=${() => app.session.dismiss(id)} /></div>`,
    )}
  </div>`;
}

const SILENT_TEXT = words.notices.theKernelHasNotAnsweredFor;

const LOST_TEXT = words.notices.theConnectionIsLostReconnecting;

/** @param {number} lostStrokes */
function staleText(lostStrokes) {
  const loss = lostStrokes ? ` ${fillCount(words.notices.lostStrokes, lostStrokes)}` : '';
  return words.notices.thisPageBelongsToAPainter + loss;
}

/** A banner over the pictures; centred if there are none. @param {{ui: Ui, app: App}} props */
export function Banner({ ui, app }) {
  const { closure, connection, isSilent } = ui;
  const banner = (/** @type {string} */ text, /** @type {any} */ extra = null) =>
    html`<div class=${`banner ${ui.ready ? '' : 'is-alone'}`} role="alert">
      <${Icon} name="warn" /><span>${text}</span>${extra}</div>`;
  if (isSilent) return banner(SILENT_TEXT);
  if (closure && connection !== 'stale')
    return banner(closure.text, html`<${ReconnectButton} ui=${ui} app=${app} />`);
  if (connection === 'lost') return banner(LOST_TEXT);
  if (connection === 'stale') return banner(staleText(ui.lostStrokes));
  return null;
}

/** The button that brings the session back, if that is possible.
 * @param {{ui: Ui, app: App}} props */
function ReconnectButton({ ui, app }) {
  const reason = ui.closure?.reason;
  if (reason === 'taken') {
    return html`<${Button} label=${words.notices.takeOver} primary tip=${words.notices.continueHereInsteadOfInThe}
      act=${() => app.session.send('take_over')} />`;
  }
  if (reason !== 'version') return null;
  return html`<${Button} label=${words.notices.reloadThePage} primary act=${() => location.reload()} />`;
}

/**
 * Running tasks: those that a user started, a basis that renders, and pictures that load. Short
 * while the pointer is on a picture, since the line then describes the light there.
 * @param {{ui: Ui, app: App}} props
 */
export function RunningTasks({ ui, app }) {
  if (!ui.ready) return null;
  return html`${runningTasks(ui, app).map(({ name, progress, text, end, stop, stopText, stopTip }) => {
    const progressLabel = progressText(progress);
    const label = [name, progressLabel].filter(Boolean).join(': ');
    return html`<div class="working" key=${name}><${ProgressBar} progress=${progress} label=${name} />
      <span>${ui.probe ? progressLabel || name : text ? `${label}. ${text}` : label}</span>
      ${end && html`<${Button} label=${words.searches.keepBest} tip=${words.searches.keepBestTip} act=${end} />`}
      ${
        stop &&
        html`<${Button} icon=${stopText ? undefined : 'close'} label=${stopText}
        tip=${stopTip ?? fill(words.notices.stop, { value: name.toLowerCase() })} act=${stop} />`
      }</div>`;
  })}`;
}

/** @typedef {{name: string, progress: {done: number, total: number, remainingSeconds?: number},
 *   text?: string, end?: () => void, stop?: () => void, stopText?: string, stopTip?: string}} Task */

/** Return the tasks that no panel shows, and at most one of those that start by themselves.
 * @param {Ui} ui
 * @param {App} app @returns {Task[]} */
function runningTasks(ui, { session }) {
  const { basis, loadProgress, exportProgress, verificationProgress } = ui;
  const isOpen = ui.side && !ui.panel && ui.open.truth;
  const unknownProgress = { done: 0, total: 0 };
  /** @type {Task[]} */
  const tasks = [];
  if ((ui.isExporting || exportProgress) && ui.dialog !== 'export')
    tasks.push({
      name: words.notices.exportingFiles,
      progress: exportProgress ?? unknownProgress,
      stop: () => void session.exportFiles([]),
    });
  const render = runningRender(ui);
  if (render && ui.dialog !== 'render')
    tasks.push({
      name: words.finalRender.rendering,
      progress: ui.renderProgress ?? unknownProgress,
      stop: () => void session.send('stop_render', { render: render.id }),
    });
  if (verificationProgress && !isOpen)
    tasks.push({
      name: words.notices.verifying,
      progress: verificationProgress,
      stop: () => void session.verify(false),
    });
  if (ui.placementProgress)
    tasks.push({
      name: words.notices.searchingForPlaces,
      progress: ui.placementProgress,
      text: ui.isPlacementEnding ? words.searches.judging : undefined,
      end: ui.isPlacementEnding ? undefined : () => void session.endPlacing(),
      stopText: words.notices.stopMoveNothing,
      stopTip: words.notices.stopTheSearchEveryLightStays,
      stop: () => void session.placeLights(false),
    });
  if (ui.isExplaining && !isOpen)
    tasks.push({ name: words.notices.findingReasons, progress: unknownProgress });
  if (basis)
    tasks.push({
      name: words.notices.renderingTheLights,
      progress: basis,
      text: words.notices.youCanPaintAlready,
    });
  else if (loadProgress && loadProgress.done < loadProgress.total)
    tasks.push({ name: words.notices.loadingTheImagesOfTheLights, progress: loadProgress });
  else if (ui.samplingProgress)
    tasks.push({ name: words.notices.addingSamplesWhereYouPainted, progress: ui.samplingProgress });
  return tasks;
}

/** Milliseconds that a pointer rests before a tip appears. */
const TIP_DELAY_MS = 500;

/** The tip of all elements with `data-tip`, with their keys.
 * @param {{root: () => HTMLElement | null}} props */
export function Tips({ root }) {
  const [tip, setTip] = useState(/** @type {any} */ (null));
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    const element = root();
    if (!element) return undefined;
    let timer = 0;
    let pressedAt = ''; // where the pointer was pressed last
    const controller = new AbortController();
    const hide = (/** @type {Event} */ event) => {
      clearTimeout(timer);
      setTip(null);
      if (event.type === 'pointerdown') pressedAt = placeOf(event);
    };
    const show = (/** @type {Event} */ event) => {
      const target = /** @type {HTMLElement} */ (event.composedPath()[0]);
      const owner = /** @type {HTMLElement | null} */ (target.closest?.('[data-tip], [data-keys]'));
      hide(event);
      // What a press moves below a pointer that rests asks for no tip, which would lie over more.
      if (event.type === 'pointerover' && placeOf(event) === pressedAt) return;
      if (!owner || (event.type === 'focusin' && !owner.matches(':focus-visible'))) return;
      timer = window.setTimeout(() => setTip(placeTip(owner, element)), TIP_DELAY_MS);
    };
    for (const name of ['pointerover', 'focusin']) {
      element.addEventListener(name, show, { signal: controller.signal });
    }
    for (const name of ['pointerdown', 'focusout', 'keydown', 'pointerleave']) {
      element.addEventListener(name, hide, { signal: controller.signal });
    }
    return () => {
      controller.abort();
      clearTimeout(timer);
    };
  }, []);
  if (!tip) return null;
  return html`<div class=${`tip ${tip.isAbove ? 'is-above' : ''}`} ref=${ref} aria-hidden="true"
    style=${{ left: `${tip.x}px`, top: `${tip.y}px` }}><span>${tip.text}</span>
    ${tip.keys && html`<kbd>${keysText(tip.keys)}</kbd>`}</div>`;
}

/** @param {any} event of a pointer */
const placeOf = ({ clientX, clientY }) => `${clientX} ${clientY}`;

/** @param {HTMLElement} owner @param {HTMLElement} root */
function placeTip(owner, root) {
  const [a, b] = [owner.getBoundingClientRect(), root.getBoundingClientRect()];
  const isAbove = a.bottom + 60 > b.bottom;
  const x = Math.min(b.width - 150, Math.max(150, (a.left + a.right) / 2 - b.left));
  return {
    text: owner.dataset.tip ?? '',
    keys: owner.dataset.keys,
    isAbove,
    x: owner.closest('.tools') ? a.right - b.left + 158 : x,
    y: owner.closest('.tools') ? a.top - b.top : (isAbove ? a.top - 6 : a.bottom + 6) - b.top,
  };
}
