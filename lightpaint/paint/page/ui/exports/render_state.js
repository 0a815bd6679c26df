/** The state of the interface that is about final renders. */

import { relativePath } from '../format.js';
import { t } from '../../language/language.js';

/** @import { RenderInfo as Render } from '../../engine/messages.js' */
/** @import { Ui } from '../ui_state.js' */
/** @typedef {Pick<Ui, "renders" | "renderProgress">} RenderState */

/** Return the render that the renderer works on, or will next. @param {{renders: Render[]}} ui */
export const runningRender = ({ renders }) =>
  renders.find(({ state }) => state === 'rendering') ??
  renders.find(({ state }) => state === 'waiting');

/** Take the list of renders. @param {{renders?: readonly Render[]}} message
 * @param {RenderState} previous @returns {RenderState} */
export function rendersUpdate({ renders: list = [] }, previous) {
  const renders = [...list];
  const running = runningRender({ renders });
  if (!running) return { renders, renderProgress: null };
  const isSame = running.id === runningRender(previous)?.id && previous.renderProgress;
  const { done, total } = running;
  const progress = { task: 'final', done, total, unit: 'passes' };
  return { renders, renderProgress: isSame ? previous.renderProgress : progress };
}

/** Return what there is to say of renders that have ended since. @param {readonly Render[]} renders
 * @param {Ui} previous @returns {{text: string, tone: "info" | "warn"}[]} */
export function endedTexts(renders, { renders: before, state }) {
  const isNew = (/** @type {Render} */ { id, state: now }) =>
    before.some((render) => render.id === id && render.state !== now);
  const ended = renders.filter((render) => isNew(render) && ['done', 'failed'].includes(render.state));
  return ended.map(({ name, state: now, files, text }) => {
    if (now === 'failed')
      return { text: t('The final render of {name} failed: {text}', { name, text }), tone: 'warn' };
    const paths = files.map((file) => relativePath(file, state?.folder ?? '')).join(', ');
    return {
      text: t('The final render of {name} is done: {paths}', { name, paths }),
      tone: 'info',
    };
  });
}
