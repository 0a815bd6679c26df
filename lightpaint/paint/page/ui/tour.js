/** A tour of five steps for the first visit: bubbles beside the parts that they are about. */

import { t } from '../language/language.js';
import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, useId } from './controls.js';
import { keyText } from './key_bindings.js';

/** @import { App, Ui, UiStore } from './ui_state.js' */
/** A step: the part that it is about, where its bubble is, and what is unfolded for it.
 * @typedef {{part: string, side: "inside" | "right" | "left" | "above", title: string,
 *   text: (ui: Ui) => string, fold?: string}} Step */

/** @type {Step[]} */
const STEPS = [
  {
    part: '.stage',
    side: 'inside',
    title: t('Paint how it should look'),
    text: () =>
      t('Choose a colour and drag over the picture Painting. The lights follow your brush.'),
  },
  {
    part: '.answer',
    side: 'above',
    title: t('See the answer'),
    text: () =>
      t(
        'The picture Answer shows the closest that your lights can come. This sentence says how close that is, what is missing, and why.',
      ),
  },
  {
    part: '.fold.is-ask',
    side: 'left',
    title: t('Ask by numbers'),
    text: () =>
      t(
        'Brighter by so many stops, warmer by so many mireds: for an object, a selection or the whole picture. Adjust, in the tools, does the same by dragging.',
      ),
    fold: 'ask',
  },
  {
    part: '.fold.is-lights',
    side: 'left',
    title: t('Your lights'),
    text: () =>
      t(
        'Each light with its picture and its level. Lock it, switch it off or give it a colour: the others are solved around it.',
      ),
    fold: 'lights',
  },
  {
    part: '.looks',
    side: 'above',
    title: t('Keep looks, and export'),
    text: (ui) =>
      t(
        '{key} keeps painting and answer as a look. Export, at the top right, writes the lights for your scene and other programs.',
        { key: keyText(ui, 'saveLook') },
      ),
  },
];

/** Size of a painter in pixels below which no tour starts by itself. */
const [MIN_WIDTH, MIN_HEIGHT] = [760, 480];

/** Space between a part and its bubble, and between the bubble and the edge, in pixels. */
const GAP = 10;

/** Show the tour from its beginning. @param {UiStore} store */
export function startTour(store) {
  store.set({ dialog: null, hasSeenTour: true });
  goTo(store, 0);
}

/** @param {UiStore} store */
export const endTour = (store) =>
  store.set((ui) => ({ tour: null, tourFold: null, open: foldAgain(ui) }));

/** Start the tour at the first visit, once there is a picture and room for it.
 * @param {UiStore} store @param {HTMLElement} root @returns {() => void} what stops the wait */
export function startAtFirstVisit(store, root) {
  const stop = store.listen(() => {
    if (!store.value.ready) return;
    stop();
    const hasRoom = root.clientWidth >= MIN_WIDTH && root.clientHeight >= MIN_HEIGHT;
    if (hasRoom && !store.value.hasSeenTour) startTour(store);
  });
  return stop;
}

/** Return what is unfolded without the present step of the tour. @param {Ui} ui */
const foldAgain = ({ open, tourFold }) => (tourFold ? { ...open, [tourFold]: false } : open);

/** @param {UiStore} store @param {number} tour */
function goTo(store, tour) {
  const { fold } = STEPS[tour];
  store.set((ui) => {
    const open = foldAgain(ui);
    if (!fold) return { tour, tourFold: null, open };
    const tourFold = open[fold] ? null : fold;
    return { tour, tourFold, side: true, panel: null, open: { ...open, [fold]: true } };
  });
}

/** @param {{ui: Ui, app: App, root: () => HTMLElement}} props */
export function Tour({ ui, app, root }) {
  const bubble = useRef(/** @type {HTMLElement | null} */ (null));
  const ring = useRef(/** @type {HTMLElement | null} */ (null));
  const [, setSize] = useState(0);
  const id = useId();
  const step = ui.tour === null ? null : STEPS[ui.tour];
  useLayoutEffect(() => {
    if (!step) return undefined;
    root().querySelector(step.part)?.scrollIntoView({ block: 'nearest' });
    const observer = new ResizeObserver(() => setSize(root().clientWidth + root().clientHeight));
    observer.observe(root());
    return () => observer.disconnect();
  }, [step]);
  useLayoutEffect(() => {
    if (step && bubble.current && ring.current) place(step, bubble.current, ring.current, root());
  });
  if (ui.tour === null || !step) return null;
  const { store } = app;
  const at = ui.tour;
  const isLast = at === STEPS.length - 1;
  const press = (/** @type {KeyboardEvent} */ event) => {
    const next = at + ({ ArrowRight: 1, ArrowLeft: -1 }[event.key] ?? 0);
    if (event.key === 'Escape') endTour(store);
    else if (next !== at && next in STEPS) goTo(store, next);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return html`<div class="tour-ring" ref=${ring} aria-hidden="true"></div>
    <section class="tour" ref=${bubble} aria-labelledby=${id} onKeyDown=${press}>
      <div aria-live="polite"><h2 id=${id}>${step.title}</h2>
        <p>${step.text(ui)}</p>
        <p class="faint">${t('Step {number} of {count}', { number: at + 1, count: STEPS.length })}</p></div>
      <div class="row">
        <${Button} label=${t('End the tour')} act=${() => endTour(store)} />
        <span class="spring"></span>
        <${Button} label=${t('Back')} disabled=${at === 0} act=${() => goTo(store, at - 1)} />
        <${Button} label=${isLast ? t('Done') : t('Next')} primary
          act=${() => (isLast ? endTour(store) : goTo(store, at + 1))} />
      </div></section>`;
}

/** Put the bubble beside its part and the ring around that, within the painter.
 * @param {Step} step @param {HTMLElement} bubble @param {HTMLElement} ring @param {HTMLElement} root */
function place({ part, side }, bubble, ring, root) {
  const frame = root.getBoundingClientRect();
  const box = (root.querySelector(part) ?? root).getBoundingClientRect();
  const [left, top] = [box.left - frame.left, box.top - frame.top];
  const bottom = Math.min(top + box.height, frame.height);
  const { offsetWidth: width, offsetHeight: height } = bubble;
  const places = {
    inside: [left + GAP, bottom - height - GAP],
    right: [left + box.width + GAP, top],
    left: [left - width - GAP, top],
    above: [left + GAP, top - height - GAP],
  };
  const [x, y] = places[side];
  const within = (/** @type {number} */ value, /** @type {number} */ length) =>
    `${Math.round(Math.max(GAP, Math.min(length - GAP, value)))}px`;
  Object.assign(bubble.style, {
    left: within(x, frame.width - width),
    top: within(y, frame.height - height),
  });
  Object.assign(ring.style, {
    left: `${left}px`,
    top: `${top}px`,
    width: `${box.width}px`,
    height: `${bottom - top}px`,
  });
}
