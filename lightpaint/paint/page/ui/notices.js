/** Notices: toasts, banners about the connection, running tasks, tool tips. */

import { html, useEffect, useRef, useState } from '../vendor/preact.js';
import { Button, ProgressBar } from './controls.js';
import { runningRender } from './exports/render_state.js';
import { progressText } from './format.js';
import { Icon } from './icons.js';
import { keysText } from './key_bindings.js';
import { plural, t } from '../language/language.js';

/** @import { App, Ui } from './ui_state.js' */

/** @param {{ui: Ui, app: App}} props */
export function Toasts({ ui, app }) {
  return html`<div class="toasts" role="log" aria-live="polite" aria-label=${t('Messages')}>
    ${ui.toasts.map(
      ({ id, text, tone }) => html`<div class=${`toast is-${tone}`} key=${id}>
      ${tone === 'warn' && html`<${Icon} name="warn" />`}<span>${text}</span>
      <${Button} icon="close" tip=${t('Dismiss')} act=${() => app.session.dismiss(id)} /></div>`,
    )}
  </div>`;
}

const SILENT_TEXT = t(
  'The kernel has not answered for 10 s. If it is busy, your strokes arrive when it is free. If it was restarted, run the cell again.',
);

const LOST_TEXT = t(
  'The connection is lost; reconnecting … Finished strokes are kept. What you paint now is sent if the same painter comes back.',
);

/** @param {number} lostStrokes */
function staleText(lostStrokes) {
  const text = t(
    'This page belongs to a painter that has ended. Open the address that the terminal shows now.',
  );
  const loss = plural(lostStrokes, {
    one: '{count} stroke painted here could not be sent, and is lost.',
    other: '{count} strokes painted here could not be sent, and are lost.',
  });
  return lostStrokes ? `${text} ${loss}` : text;
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
    return html`<${Button} label=${t('Take over')} primary tip=${t('Continue here instead of in the other tab')}
      act=${() => app.session.send('take_over')} />`;
  }
  if (reason !== 'version') return null;
  return html`<${Button} label=${t('Reload the page')} primary act=${() => location.reload()} />`;
}

/** Running tasks: those that a user started, a basis that renders, and pictures that load. Short
 * while the pointer is on a picture, since the line then describes the light there.
 * @param {{ui: Ui, app: App}} props */
export function RunningTasks({ ui, app }) {
  if (!ui.ready) return null;
  return html`${runningTasks(ui, app).map(({ name, progress, text, end, stop, stopText, stopTip }) => {
    const progressLabel = progressText(progress);
    const label = [name, progressLabel].filter(Boolean).join(': ');
    return html`<div class="working" key=${name}><${ProgressBar} progress=${progress} label=${name} />
      <span>${ui.probe ? progressLabel || name : text ? `${label}. ${text}` : label}</span>
      ${
        end &&
        html`<${Button} label=${t('Stop with the best so far')} act=${end}
          tip=${t('End the search: the best that was found by now is checked and becomes a step')} />`
      }
      ${
        stop &&
        html`<${Button} icon=${stopText ? undefined : 'close'} label=${stopText}
        tip=${stopTip ?? t('Stop: {value}', { value: name.toLowerCase() })} act=${stop} />`
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
      name: t('Exporting files'),
      progress: exportProgress ?? unknownProgress,
      stop: () => void session.exportFiles([]),
    });
  const render = runningRender(ui);
  if (render && ui.dialog !== 'render')
    tasks.push({
      name: t('Final render'),
      progress: ui.renderProgress ?? unknownProgress,
      stop: () => void session.send('stop_render', { render: render.id }),
    });
  if (verificationProgress && !isOpen)
    tasks.push({
      name: t('Verifying'),
      progress: verificationProgress,
      stop: () => void session.verify(false),
    });
  if (ui.placementProgress)
    tasks.push({
      name: t('Searching for places'),
      progress: ui.placementProgress,
      text: ui.isPlacementEnding ? t('Checking the best so far') : undefined,
      end: ui.isPlacementEnding ? undefined : () => void session.endPlacing(),
      stopText: t('Stop, move nothing'),
      stopTip: t('Stop the search: every light stays where it is'),
      stop: () => void session.placeLights(false),
    });
  if (ui.planesProgress)
    tasks.push({ name: t('Measuring the planes'), progress: ui.planesProgress });
  if (ui.isExplaining && !isOpen)
    tasks.push({ name: t('Finding reasons'), progress: unknownProgress });
  if (basis)
    tasks.push({
      name: t('Rendering the lights'),
      progress: basis,
      text: ui.areLightsUnknown
        ? t('You can paint already: the answer comes with the lights.')
        : t('You can paint already.'),
    });
  else if (loadProgress && loadProgress.done < loadProgress.total)
    tasks.push({ name: t('Loading the images of the lights'), progress: loadProgress });
  else if (ui.samplingProgress)
    tasks.push({ name: t('Adding samples where you painted'), progress: ui.samplingProgress });
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
