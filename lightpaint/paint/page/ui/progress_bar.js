/** A progress bar. */

import { html } from '../vendor/preact.js';

/** @param {{progress: {done: number, total: number, unit?: string}, label: string}} props */
export function ProgressBar({ progress, label }) {
  const { done, total } = progress;
  const isKnown = total > 0;
  return html`<span class=${`bar ${isKnown ? '' : 'is-endless'}`} role="progressbar"
    aria-label=${label} aria-valuemin="0" aria-valuemax=${isKnown ? total : undefined}
    aria-valuenow=${isKnown ? done : undefined}>
    <i style=${{ '--share': String(isKnown ? Math.min(1, done / total) : 1) }}></i></span>`;
}
