/** The list of steps, the last on top: a click goes to one, and undone ones stay until a new one. */

import { html, useEffect, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Checkbox } from './controls.js';
import { capitalized, clockText, dateText, durationText } from './format.js';
import { Thumbnail } from './thumbnail.js';
import { t } from '../language/language.js';
import { Icon } from './icons.js';

/** @import { App, Ui } from './ui_state.js' */
/** @import { SearchInfo as Search, StepInfo as Step } from '../engine/messages.js' */

/** @typedef {import("../engine/messages.js").Events["steps"]} StepList */

/** Steps listed at first, and added each time that more are requested. */
const LISTED_COUNT = 100;

/** Steps above which a list can be reduced to milestones. */
const MIN_FILTERED_COUNT = 12;

/** The state before all steps. @type {Step} */
const BEGINNING = { id: 0, label: t('Beginning'), stamp: null, is_milestone: true };

/** Request the list, and again whenever the history has changed.
 * @param {Ui} ui @param {App} app @param {number} count @returns {StepList | null} */
function useSteps(ui, { session }, count) {
  const [list, setList] = useState(/** @type {StepList | null} */ (null));
  useEffect(() => {
    let isOutdated = false;
    if (ui.ready && ui.closure === null)
      void session.send('list_steps', { count }).then((reply) => {
        if (reply?.kind === 'steps' && !isOutdated) setList(/** @type {any} */ (reply));
      });
    return () => {
      isOutdated = true;
    };
  }, [ui.history, ui.ready, ui.closure, ui.searchCount, count]);
  return list;
}

/** @param {{ui: Ui, app: App}} props */
export function HistoryPanel({ ui, app }) {
  const [count, setCount] = useState(LISTED_COUNT);
  const [hasMilestonesOnly, setMilestonesOnly] = useState(false);
  const list = useSteps(ui, app, count);
  const element = useRef(/** @type {HTMLElement | null} */ (null));
  const { steps = [], earlier = 0, done = 0, searches = [] } = list ?? {};
  const all = earlier ? steps : [BEGINNING, ...steps];
  const doneIndex = all.findIndex(({ id }) => id === done);
  const rows = all
    .map((step, k) => ({ step, isUndone: k > doneIndex, isCurrent: step.id === done }))
    .filter(({ step, isCurrent }) => !hasMilestonesOnly || step.is_milestone || isCurrent)
    .reverse();
  useLayoutEffect(() => {
    element.current?.querySelector('[aria-current]')?.scrollIntoView({ block: 'nearest' });
  }, [done, list === null]);
  if (!ui.history.count && !ui.history.redo.length && !searches.length)
    return html`<p class="faint panel-note">${t('Every step is listed here, with its picture. Click one to go back to it.')}</p>`;
  return html`<ul class="steps" ref=${element} aria-label=${t('Steps, the last on top')}>
      ${rows.map(({ step, isUndone, isCurrent }) => [
        ...searches
          .filter(({ after }) => after === step.id)
          .map((search) => html`<${SearchRow} key=${`search ${search.id}`} search=${search} />`)
          .reverse(),
        html`<${StepRow} key=${step.id} step=${step} ui=${ui}
          app=${app} isUndone=${isUndone} isCurrent=${isCurrent} />`,
        ],
      )}
      ${
        earlier > 0 &&
        html`<li><${Button} label=${t('Earlier steps ({earlier})', { earlier })} class="is-flat"
          act=${() => setCount(count + LISTED_COUNT)} /></li>`
      }
    </ul>
    <div class="history-actions">
      ${
        (hasMilestonesOnly || all.length > MIN_FILTERED_COUNT) &&
        html`<${Checkbox} label=${t('Milestones only')} checked=${hasMilestonesOnly}
          change=${setMilestonesOnly}
          tip=${t('The steps before a pause or a new start, and every twentieth')} />`
      }
      <${NewStart} ui=${ui} app=${app} />
    </div>`;
}

/** @param {{ui: Ui, app: App}} props */
function NewStart({ ui, app }) {
  const { session, engine } = app;
  const hasPaint = ui.layers.length > 1 || !ui.isPaintingEmpty;
  const send = (/** @type {"clear_painting" | "start_over"} */ kind) => {
    engine.cancel();
    void session.send(kind);
  };
  return html`<${Button} label=${t('Clear painting')} disabled=${!hasPaint} act=${() => send('clear_painting')}
      tip=${t('Delete all paint and layers. Lights keep what you asked of them.')} />
    <${Button} label=${t('Start over')} disabled=${!ui.history.count} act=${() => send('start_over')}
      tip=${t('Back to the scene as it was. Looks stay, and undo goes back.')} />`;
}

/** @param {{step: Step, ui: Ui, app: App, isUndone: boolean, isCurrent: boolean}} props */
function StepRow({ step, ui, app, isUndone, isCurrent }) {
  const { id, label, stamp, is_milestone: isMilestone } = step;
  const text = capitalized(label);
  const goTo = () => {
    // As undo: the stroke in progress is the last action.
    app.engine.cancel();
    if (!isCurrent) void app.session.send('go_to_step', { step: id });
  };
  // The answer to the last step gets better while nobody paints.
  const generation = isCurrent ? 2 * ui.version + (ui.isLive ? 0 : 1) : 0;
  const kind = ['step', isCurrent && 'is-current', isUndone && 'is-undone'].filter(Boolean);
  return html`<li><button type="button" class=${kind.join(' ')} onClick=${goTo}
      aria-current=${isCurrent ? 'step' : undefined}
      data-tip=${stamp === null ? undefined : `${text}, ${dateText(stamp)}`}>
    <${Thumbnail} name=${`step/${id}`} generation=${generation} app=${app} />
    <span class=${`step-label ${isMilestone ? 'is-milestone' : ''}`}>${text}</span>
    ${isUndone && html`<span class="only-read">${t(', undone')}</span>`}
    <span class="faint">${stamp === null ? '' : clockText(stamp)}</span>
  </button></li>`;
}

/** @param {{search: Search}} props */
function SearchRow({ search }) {
  const [isOpen, setOpen] = useState(false);
  const { title, text, tried, stamp, seconds } = search;
  return html`<li class="search-note"><button type="button" aria-expanded=${String(isOpen)}
      onClick=${() => setOpen(!isOpen)}><${Icon} name="search" />
      <span class="step-label"><strong>${capitalized(title)}</strong><span>${text}</span></span>
      <span class="faint">${clockText(stamp)}</span></button>
    ${
      isOpen &&
      html`<div class="search-tried"><p>${t('Took {time}. Tried:', { time: durationText(seconds) })}</p>
      ${tried.map((sentence) => html`<p key=${sentence}>${sentence}</p>`)}</div>`
    }
  </li>`;
}
