/** What a person has to know now: toasts, a session that is elsewhere, a render in progress, tips. */

import { html, useEffect, useRef, useState } from '../vendor/preact.js';
import { Button } from './controls.js';
import { Icon } from './icons.js';
import { Bar } from './bar.js';

/** @typedef {import("./model.js").Ui} Ui */
/** @typedef {import("./keys.js").Hands} Hands */

/** @param {{ui: Ui, hands: Hands}} props */
export function Toasts({ ui, hands }) {
  return html`<div class="toasts" role="log" aria-live="polite" aria-label="Messages">
    ${ui.toasts.map(
      ({ id, text, tone }) => html`<div class=${`toast is-${tone}`} key=${id}>
      ${tone === 'warn' && html`<${Icon} name="warn" />`}<span>${text}</span>
      <${Button} icon="close" tip="Dismiss" act=${() => hands.session.dismiss(id)} /></div>`,
    )}
  </div>`;
}

const SILENT =
  'The kernel has not answered for 10 s: it is busy, or it has ended. What you paint is heard when it is free; if it was restarted, run the cell again.';

/** @param {{ui: Ui, hands: Hands}} props */
export function Banner({ ui, hands }) {
  const { closed, connection, isSilent } = ui;
  if (isSilent) {
    return html`<div class="banner" role="alert"><${Icon} name="warn" />
      <span>${SILENT}</span></div>`;
  }
  if (closed && connection !== 'stale') {
    const canTake = closed.reason === 'taken';
    return html`<div class="banner" role="alert"><${Icon} name="warn" /><span>${closed.text}</span>
      ${
        canTake &&
        html`<${Button} label="Take over" primary
        act=${() => hands.session.send('take_over')} />`
      }
      ${
        closed.reason === 'version' &&
        html`<${Button} label="Load the page anew" primary
        act=${() => location.reload()} />`
      }
    </div>`;
  }
  if (connection !== 'lost' && connection !== 'stale') return null;
  const text =
    connection === 'lost'
      ? 'The connection is lost. Finished strokes are safe; trying again …'
      : 'This page is of an earlier start of the painter: open the address that its terminal shows.';
  return html`<div class="banner" role="alert"><${Icon} name="warn" />
    <span>${text}</span></div>`;
}

/** A basis that still renders, pictures that still load. @param {{ui: Ui}} props */
export function Working({ ui }) {
  const { basis, loading } = ui;
  const work = basis ?? (loading && loading.done < loading.total ? loading : null);
  if (!work || !ui.ready) return null;
  const count = work.total ? ` ${work.done} of ${work.total}` : '';
  const text = basis
    ? `Rendering the lights:${count} ${basis.unit ?? ''}. You can paint already.`
    : `Loading pictures of the lights:${count}`;
  return html`<div class="working"><${Bar} progress=${work} label=${text} /><span>${text}</span></div>`;
}

/** How long a pointer rests before a tip is shown. */
const REST_MS = 500;

/** One tip for all that has `data-tip`, with its keys. @param {{root: () => HTMLElement | null}}
 * props */
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
