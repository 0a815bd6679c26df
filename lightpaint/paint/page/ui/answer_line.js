/** The lines below the pictures: how close the answer is, and the light under the pointer. */

import { html } from '../vendor/preact.js';
import { AdviceButton } from './advice.js';
import { Button, TruncatedText, reveal } from './controls.js';
import { lightText, number, shortened } from './format.js';
import { pointingHint } from './lamp_fields.js';
import { isAnswerHidden, saveLook } from './look_actions.js';
import { toolHint } from './tools.js';
import { exposureOf } from './ui_state.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

const DELTA_E =
  'Mean colour difference from the painting (ΔE 2000), and what it was with the current lighting. 1 is just visible, 5 is obvious.';

const STATES = {
  live: 'A quick answer while you paint. The exact one follows.',
  analysing: 'The lights are solved. The sentence still describes the previous answer.',
  'answer not shown': 'The sentence describes the answer, which is neither of the looks compared.',
};

/** One sentence below the pictures: how close the answer is.
 * @param {{ui: Ui, app: App}} props */
export function AnswerLine({ ui, app }) {
  const { store } = app;
  const text = ui.headline || (ui.ready ? 'Solving …' : '');
  const isOpen = ui.side && !ui.panel && ui.open.truth;
  const isOld = ui.headline !== '' && !ui.isJudged;
  const busy = ui.isLive ? 'live' : isOld ? 'analysing' : null;
  const isApart = isAnswerHidden(ui);
  const state = isApart && text ? 'answer not shown' : busy;
  const turn = (/** @type {MouseEvent} */ event) => {
    const button = /** @type {HTMLElement} */ (event.currentTarget);
    store.set({ side: true, panel: null, open: { ...ui.open, truth: !isOpen } });
    if (!isOpen) reveal(button, '.is-truth');
  };
  return html`<div class="answer">
    <p class=${`headline ${isOld || isApart ? 'is-old' : ''}`} role="status">
      <${TruncatedText} class="said" text=${text} most=${100} />
      ${
        // Always in the same place, so that the sentence does not rewrap.
        state && html`<span class="live" data-tip=${STATES[state]}><b>${state}</b></span>`
      }
      ${
        !state &&
        ui.deltaE !== null &&
        html`<span class="faint" data-tip=${DELTA_E}>ΔE ${number(ui.deltaE, 2)}${
          ui.deltaPresent !== null && html`<span class="was">, was ${number(ui.deltaPresent, 2)}</span>`
        }</span>`
      }
    </p>
    <${AdviceButton} ui=${ui} app=${app} />
    ${
      ui.ready &&
      html`<${Button} label="Save look" icon="plus" keys="Control+S"
      tip="Save painting and answer as a look"
      act=${() => saveLook(app)} />`
    }
    ${
      // The button keeps its place when pressed, so that nothing else slides under the pointer.
      ui.ready && html`<${Button} label="Analysis" on=${isOpen} act=${turn} />`
    }
  </div>`;
}

/** The light under the pointer and the lights that contribute to it, or else the tool's hint.
 * @param {{ui: Ui}} props */
export function PointerStatus({ ui }) {
  if (ui.pointing) {
    const text = pointingHint(ui.pointing, ui.lights);
    return html`<p class="here" id="lp-status" role="status"><strong>${text}</strong></p>`;
  }
  if (!ui.pointed) {
    const text = ui.ready ? toolHint(ui.tool) : ''; // there is nothing to drag on yet
    return html`<p class="here" id="lp-status"><span class="hint-text">${text}</span></p>`;
  }
  const { object, shares, light } = ui.pointed;
  const exposed = light.map((x) => x * 2 ** exposureOf(ui.state));
  const most = (isAnswerHidden(ui) ? [] : shares)
    .map((share, k) => ({ share, k }))
    .filter(({ share }) => share >= 0.01)
    .sort((a, b) => b.share - a.share)
    .slice(0, 5);
  return html`<p class="here" id="lp-status">${object && html`<span class="object">${shortened(object, 40)}</span>`}
    <span class="light-here">${lightText(exposed)}${
      ui.tool === 'pick' && html` · RGB ${exposed.map((x) => number(x, 3)).join(' ')}`
    }</span>
    ${most.map(
      ({ share, k }) => html`<span key=${k}>${shortened(ui.lights[k]?.label ?? '', 24)}
      <b>${Math.round(100 * share)} %</b></span>`,
    )}</p>`;
}
