/** Notices: toasts, banners about the connection, running tasks, tool tips. */

import { html, useEffect, useRef, useState } from '../vendor/preact.js';
import { Button } from './controls.js';
import { counted, progressText } from './format.js';
import { Icon } from './icons.js';
import { ProgressBar } from './progress_bar.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** @param {{ui: Ui, app: App}} props */
export function Toasts({ ui, app }) {
  return html`<div class="toasts" role="log" aria-live="polite" aria-label="Messages">
    ${ui.toasts.map(
      ({ id, text, tone }) => html`<div class=${`toast is-${tone}`} key=${id}>
      ${tone === 'warn' && html`<${Icon} name="warn" />`}<span>${text}</span>
      <${Button} icon="close" tip="Dismiss" act=${() => app.session.dismiss(id)} /></div>`,
    )}
  </div>`;
}

const SILENT =
  'The kernel has not answered for 10 s. If it is busy, your strokes arrive when it is free. If it was restarted, run the cell again.';

const LOST =
  'The connection is lost; reconnecting … Finished strokes are kept. What you paint now is sent if the same painter comes back.';

/** @param {number} unheard strokes */
function stale(unheard) {
  const lost = unheard
    ? ` ${counted(unheard, 'stroke')} painted here could not be sent, and ${unheard === 1 ? 'is' : 'are'} lost.`
    : '';
  return `This page belongs to a painter that has ended. Open the address that the terminal shows now.${lost}`;
}

/** A banner over the pictures; centred if there are none. @param {{ui: Ui, app: App}} props */
export function Banner({ ui, app }) {
  const { closed, connection, isSilent } = ui;
  const banner = (/** @type {string} */ text, /** @type {any} */ more = null) =>
    html`<div class=${`banner ${ui.ready ? '' : 'is-alone'}`} role="alert">
      <${Icon} name="warn" /><span>${text}</span>${more}</div>`;
  if (isSilent) return banner(SILENT);
  if (closed && connection !== 'stale')
    return banner(closed.text, html`<${ReconnectButton} ui=${ui} app=${app} />`);
  if (connection === 'lost') return banner(LOST);
  if (connection === 'stale') return banner(stale(ui.unheard));
  return null;
}

/** The button that brings the session back, if that is possible.
 * @param {{ui: Ui, app: App}} props */
function ReconnectButton({ ui, app }) {
  const reason = ui.closed?.reason;
  if (reason === 'taken') {
    return html`<${Button} label="Take over" primary tip="Continue here instead of in the other tab"
      act=${() => app.session.send('take_over')} />`;
  }
  if (reason !== 'version') return null;
  return html`<${Button} label="Reload the page" primary act=${() => location.reload()} />`;
}

/**
 * Running tasks: those that a user started, a basis that renders, and pictures that load. Short
 * while the pointer is on a picture, since the line then describes the light there.
 * @param {{ui: Ui, app: App}} props
 */
export function RunningTasks({ ui, app }) {
  if (!ui.ready) return null;
  return html`${worksOf(ui, app).map(({ name, progress, text, stop, stopText, stopTip }) => {
    const far = progressText(progress);
    const whole = [name, far].filter(Boolean).join(': ');
    return html`<div class="working" key=${name}><${ProgressBar} progress=${progress} label=${name} />
      <span>${ui.pointed ? far || name : text ? `${whole}. ${text}` : whole}</span>
      ${stop && html`<${Button} icon=${stopText ? undefined : 'close'} label=${stopText}
        tip=${stopTip ?? `Stop: ${name.toLowerCase()}`} act=${stop} />`}</div>`;
  })}`;
}

/** @typedef {{name: string, progress: {done: number, total: number, left_s?: number},
 *   text?: string, stop?: () => void, stopText?: string, stopTip?: string}} Task */

/** Return the tasks that no panel shows, and at most one of those that start by themselves.
 * @param {Ui} ui
 * @param {App} app @returns {Task[]} */
function worksOf(ui, { session }) {
  const { basis, loading, writing, verifying } = ui;
  const isOpen = ui.side && !ui.panel && ui.open.truth;
  const endless = { done: 0, total: 0 };
  /** @type {Task[]} */
  const works = [];
  if ((ui.isWriting || writing) && ui.dialog !== 'export')
    works.push({
      name: 'Exporting files',
      progress: writing ?? endless,
      stop: () => void session.write([]),
    });
  if (verifying && !isOpen)
    works.push({
      name: 'Verifying',
      progress: verifying,
      stop: () => void session.verify(false),
    });
  if (ui.placing)
    works.push({
      name: 'Searching for places',
      progress: ui.placing,
      stopText: 'Stop, move nothing',
      stopTip: 'Stop the search: every light stays where it is',
      stop: () => void session.placeLights(false),
    });
  if (ui.explaining && !isOpen) works.push({ name: 'Finding reasons', progress: endless });
  if (basis)
    works.push({ name: 'Rendering the lights', progress: basis, text: 'You can paint already.' });
  else if (loading && loading.done < loading.total)
    works.push({ name: 'Loading the images of the lights', progress: loading });
  else if (ui.sampling)
    works.push({ name: 'Adding samples where you painted', progress: ui.sampling });
  return works;
}

/** Milliseconds that a pointer rests before a tip appears. */
const REST_MS = 500;

/** The tip of all elements with `data-tip`, with their keys.
 * @param {{root: () => HTMLElement | null}} props */
export function Tips({ root }) {
  const [tip, setTip] = useState(/** @type {any} */ (null));
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useEffect(() => {
    const element = root();
    if (!element) return undefined;
    let timer = 0;
    const ends = new AbortController();
    const hide = () => {
      clearTimeout(timer);
      setTip(null);
    };
    const show = (/** @type {Event} */ event) => {
      const inner = /** @type {HTMLElement} */ (event.composedPath()[0]);
      const owner = /** @type {HTMLElement | null} */ (inner.closest?.('[data-tip], [data-keys]'));
      hide();
      if (!owner || (event.type === 'focusin' && !owner.matches(':focus-visible'))) return;
      timer = window.setTimeout(() => setTip(placed(owner, element)), REST_MS);
    };
    for (const name of ['pointerover', 'focusin']) {
      element.addEventListener(name, show, { signal: ends.signal });
    }
    for (const name of ['pointerdown', 'focusout', 'keydown', 'pointerleave']) {
      element.addEventListener(name, hide, { signal: ends.signal });
    }
    return () => {
      ends.abort();
      clearTimeout(timer);
    };
  }, []);
  if (!tip) return null;
  return html`<div class=${`tip ${tip.isAbove ? 'is-above' : ''}`} ref=${ref} aria-hidden="true"
    style=${{ left: `${tip.x}px`, top: `${tip.y}px` }}><span>${tip.text}</span>
    ${tip.keys && html`<kbd>${tip.keys.replace('Control', 'Ctrl').replaceAll('+', ' ')}</kbd>`}</div>`;
}

/** @param {HTMLElement} owner @param {HTMLElement} root */
function placed(owner, root) {
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
