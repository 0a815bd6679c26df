/** How true the answer is: in sentences, laid over the pictures, and by a render of it. */

import { html, useEffect, useLayoutEffect, useRef } from '../vendor/preact.js';
import { Bar } from './bar.js';
import { Button, Choice } from './controls.js';
import { number } from './format.js';
import { Icon } from './icons.js';
import { HINTS, look } from './tools.js';

/** @typedef {import("./model.js").Ui} Ui */
/** @typedef {import("./keys.js").Hands} Hands */
/** @typedef {import("./engine.js").Pane} Pane */

const OVERLAYS = [
  { value: null, label: 'None' },
  { value: 'missed', label: 'Missed', tip: 'Where the answer is not what was painted' },
  { value: 'beyond', label: 'Out of reach', tip: 'What no setting of these lights can do' },
  { value: 'falsecolor', label: 'False colour', tip: 'How bright, in stops' },
  { value: 'importance', label: 'Painted', tip: 'What counts, and how much' },
];

/** What colours of an overlay mean; hatches say the same. @type {Record<string, string[]>} */
const MEANINGS = {
  missed: ['too dark', 'fits', 'too bright'],
  beyond: ['in reach', 'out of reach'],
  falsecolor: ['−6 stops', 'grey', '+6'],
  importance: ['free', 'counts'],
};

/** @param {{ui: Ui, hands: Hands}} props */
export function TruthPanel({ ui, hands }) {
  const { session, store } = hands;
  const choose = (/** @type {any} */ overlay) => look(store, { overlay });
  // The first of them stands below the pictures, too.
  const sentences = (ui.explained.length ? ui.explained : ui.sentences).filter(
    (text) => text !== ui.headline,
  );
  return html`<div class="truth">
    <${Choice} label="Over the pictures" value=${ui.show.overlay} choices=${OVERLAYS}
      change=${choose} />
    ${sentences.map((text) => html`<p key=${text}>${text}</p>`)}
    ${
      !ui.readonly &&
      html`<div class="row">
      <${Button} label="Why not closer?" act=${() => session.explain()}
        tip="What keeps the lights from what was painted" />
      ${ui.state?.can_render && html`<${Verify} ui=${ui} hands=${hands} />`}
    </div>`
    }
    ${ui.verified && html`<${Verified} ui=${ui} hands=${hands} />`}
  </div>`;
}

/** What the colours over a picture mean, on that picture. What is out of reach is found anew when it
 * is looked at and the answer is another one.
 * @param {{ui: Ui, hands: Hands, panes: Pane[]}} props */
export function Legend({ ui, hands, panes }) {
  const { overlay } = ui.show;
  const isSought = overlay === 'beyond' && ui.deltaE !== null && !ui.isLive && !ui.explained.length;
  useEffect(() => {
    if (isSought && !ui.explaining) hands.session.explain();
  }, [isSought, ui.explaining]);
  const on = overlay === 'importance' ? 'painting' : 'solution';
  const pane =
    panes.find(({ kind }) => kind === on) ?? (overlay === 'falsecolor' ? panes[0] : undefined);
  if (!overlay || !pane) return null;
  const { label } = OVERLAYS.find(({ value }) => value === overlay) ?? OVERLAYS[0];
  const isOld = overlay === 'beyond' && !ui.explained.length;
  const bottom = Math.min(pane.y + pane.height, pane.top + ui.state.size[0] * pane.scale);
  return html`<div class="legend" style=${{
    top: `${bottom - 8}px`,
    left: `${Math.max(pane.x, pane.left) + 8}px`,
  }}>
    <b>${label}${isOld && ui.deltaE !== null ? ', being found …' : ''}</b>
    <i class=${`is-${overlay}`}></i>
    ${MEANINGS[overlay].map((text) => html`<span key=${text}>${text}</span>`)}
  </div>`;
}

/** @param {{ui: Ui, hands: Hands}} props */
function Verify({ ui, hands }) {
  const { session } = hands;
  if (!ui.verifying) {
    return html`<${Button} label="Verify" icon="camera" act=${() => session.verify()}
      tip="Render the scene with this lighting, and compare" />`;
  }
  return html`<${Button} label="Stop the render" icon="close" act=${() => session.verify(false)} />
    <${Bar} progress=${ui.verifying} label="Verifying" />`;
}

/** @param {{ui: Ui, hands: Hands}} props */
function Verified({ ui, hands }) {
  const { verified, show } = ui;
  const frame = useRef(/** @type {HTMLElement | null} */ (null));
  // It may have come below what there is room for.
  useLayoutEffect(() => frame.current?.scrollIntoView?.({ block: 'nearest' }), [verified]);
  if (!verified) return null;
  const isShown = show.left === 'solution' && show.right === 'verified';
  const compare = () => {
    hands.store.set({ mix: null });
    look(
      hands.store,
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

const DELTA_E =
  'Mean difference to what was painted, as seen: 1 is just visible, 5 is clear; and of the light as it was';

/** Below the pictures, in one sentence: how close the answer comes.
 * @param {{ui: Ui, hands: Hands}} props */
export function AnswerLine({ ui, hands }) {
  const { store, session } = hands;
  const text = ui.headline || (ui.ready ? 'Finding the lighting …' : '');
  const isOpen = ui.side && ui.open.truth;
  return html`<div class="answer">
    <p class="headline" role="status">
      ${
        ui.isLive
          ? html`<span class="live" data-tip=${'A quick answer while you paint, without what takes longer; the exact one follows'}>live</span>`
          : null
      }
      <span class="said" data-tip=${text.length > 100 ? text : undefined}>${text}</span>
      ${
        ui.deltaE !== null &&
        html`<span class="faint" data-tip=${DELTA_E}>ΔE ${number(ui.deltaE, 2)}${
          ui.deltaAsked !== null && `, was ${number(ui.deltaAsked, 2)}`
        }</span>`
      }
    </p>
    ${
      !ui.readonly &&
      ui.ready &&
      html`<${Button} label="Keep look" icon="plus" keys="Control+S"
      tip="Keep painting and answer under a name"
      act=${() => session.send('save_look', { name: `Look ${ui.looks.length + 1}` })} />`
    }
    ${
      // It stays where it is when it is pressed: nothing else slides under the pointer.
      ui.ready &&
      html`<${Button} label="How true?" on=${isOpen} act=${() =>
        store.set({ side: true, open: { ...ui.open, truth: !isOpen } })} />`
    }
  </div>`;
}

/** Which lights make up what is under the pointer; else what the tool does. @param {{ui: Ui}}
 * props */
export function Here({ ui }) {
  if (!ui.pointed) {
    const text = ui.readonly ? '' : HINTS[ui.tool];
    return html`<p class="here" id="lp-status"><span class="hint-text">${text}</span></p>`;
  }
  const { object, shares } = ui.pointed;
  const most = shares
    .map((share, k) => ({ share, k }))
    .filter(({ share }) => share >= 0.01)
    .sort((a, b) => b.share - a.share)
    .slice(0, 5);
  return html`<p class="here" id="lp-status">${object && html`<span class="object">${object}</span>`}
    ${most.map(
      ({ share, k }) => html`<span key=${k}>${ui.lights[k]?.label}
      <b>${Math.round(100 * share)} %</b></span>`,
    )}</p>`;
}
