/** Windows over the painter: all keys, files to write, how a painting is answered. */

import { html, useState } from '../vendor/preact.js';
import { Bar } from './bar.js';
import { Button, Check, Choice, Dialog, Number_ } from './controls.js';
import { number } from './format.js';
import { KEYS } from './keys.js';

/** @typedef {import("./model.js").Ui} Ui */
/** @typedef {import("./keys.js").Hands} Hands */

/** @param {{ui: Ui, hands: Hands}} props */
export function Dialogs({ ui, hands }) {
  const close = () => hands.store.set({ dialog: null });
  if (ui.dialog === 'keys') return html`<${KeysDialog} close=${close} />`;
  if (ui.dialog === 'export')
    return html`<${ExportDialog} ui=${ui} hands=${hands} close=${close} />`;
  if (ui.dialog === 'settings') {
    return html`<${SettingsDialog} ui=${ui} hands=${hands} close=${close} />`;
  }
  return null;
}

/** @param {{close: () => void}} props */
function KeysDialog({ close }) {
  const isMac = /mac/i.test(navigator.platform);
  const spoken = (/** @type {string} */ key) => (isMac && key === 'Ctrl' ? '⌘' : key);
  return html`<${Dialog} title="Keys" close=${close} class="keys">
    ${KEYS.map(
      ({ title, keys }) => html`<section key=${title}><h3>${title}</h3><dl>
      ${keys.map(
        ({ shown, does }) => html`<div key=${does}>
        <dt>${shown.map((key, k) => html`<kbd key=${k}>${spoken(key)}</kbd>`)}</dt>
        <dd>${does}</dd></div>`,
      )}
    </dl></section>`,
    )}
    <p class="faint">On a tablet one finger paints, two move and zoom. A pen paints with its pressure.</p>
  </${Dialog}>`;
}

const FILES = [
  { key: 'target', label: 'Painting', about: 'painting.exr, for lightpaint solve' },
  { key: 'lighting', label: 'Lighting', about: 'lighting.json: every light, in numbers' },
  { key: 'relit', label: 'Scene', about: 'relit.xml: the scene with this lighting' },
  { key: 'report', label: 'Report', about: 'report.html: what was painted, what came of it' },
];

/** @param {{ui: Ui, hands: Hands, close: () => void}} props */
function ExportDialog({ ui, hands, close }) {
  const can = FILES.filter(
    ({ key }) =>
      (key !== 'relit' || ui.state?.can_render) &&
      (key !== 'report' || ui.state?.can_report !== false),
  );
  const [what, setWhat] = useState(can.map(({ key }) => key));
  const isBusy = ui.isWriting;
  const write = () => {
    hands.store.set({ isWriting: true, exported: null });
    hands.session.send('export', { what });
  };
  const { exported } = ui;
  return html`<${Dialog} title="Write files" close=${close} class="export">
    ${can.map(
      ({ key, label, about }) => html`<div class="export-row" key=${key}>
      <${Check} label=${label} on=${what.includes(key)} change=${(/** @type {boolean} */ on) =>
        setWhat(on ? [...what, key] : what.filter((one) => one !== key))} />
      <span class="faint">${about}</span></div>`,
    )}
    <div class="row"><span class="faint folder">into ${ui.state?.folder}</span>
      ${isBusy && ui.writing && html`<${Bar} progress=${ui.writing} label="Writing" />`}
      <${Button} label=${isBusy ? 'Writing …' : 'Write'} primary disabled=${isBusy || !what.length}
        act=${write} /></div>
    ${
      exported &&
      html`<div class="exported" role="status">
      <h3>Written</h3>
      <ul>${exported.files.map((file) => html`<li key=${file}><code>${file}</code></li>`)}</ul>
      ${
        exported.command &&
        html`<h3>The same on the command line</h3>
        <${Copied} text=${exported.command} />`
      }
    </div>`
    }
  </${Dialog}>`;
}

/** @param {{text: string}} props */
function Copied({ text }) {
  const [isDone, setDone] = useState(false);
  const copy = () =>
    navigator.clipboard?.writeText(text).then(
      () => setDone(true),
      () => undefined,
    );
  return html`<div class="command"><code tabindex="0">${text}</code>
    <${Button} label=${isDone ? 'Copied' : 'Copy'} icon=${isDone ? 'check' : 'copy'} act=${copy} />
  </div>`;
}

const SPACES = [
  { value: null, label: 'Automatic' },
  { value: 'display', label: 'As it looks', tip: 'Differences count as the display shows them' },
  { value: 'linear', label: 'As light', tip: 'Differences count as light: bright places more' },
];
const COLOURS = [
  { value: null, label: 'Automatic' },
  { value: 'free', label: 'Free', tip: 'Any colour that fits' },
  {
    value: 'gentle',
    label: 'Keep theirs',
    tip: 'Their own colour, unless the painting asks for another',
  },
  { value: 'white', label: 'Whites', tip: 'From 2200 K to 9000 K' },
];

/** @param {{ui: Ui, hands: Hands, close: () => void}} props */
function SettingsDialog({ ui, hands, close }) {
  const { settings, meant } = ui;
  const set = (/** @type {string} */ key) => (/** @type {any} */ value) =>
    hands.session.setting(key, value);
  const hold = settings.hold ?? null;
  const manner = hold === null ? 'auto' : hold === 0 ? 'go' : 'hold';
  const holds = [
    { value: 'auto', label: 'Automatic' },
    { value: 'hold', label: 'Keep', tip: 'What is not painted stays near the present look' },
    { value: 'go', label: 'Let go', tip: 'What is not painted may become anything' },
  ];
  return html`<${Dialog} title="How the painting is answered" close=${close} class="settings">
    <${Row} title="What is not painted" is=${kept(meant.hold)}>
      <${Choice} label="What is not painted" value=${manner} choices=${holds}
        change=${(/** @type {string} */ to) => set('hold')({ auto: null, hold: hold || 1, go: 0 }[to])} />
      ${
        manner === 'hold' &&
        html`<${Number_} label="Strength" value=${hold} least=${0.01} most=${100}
        step=${0.1} unit="×" change=${set('hold')} />`
      }
    </${Row}>
    <${Row} title="Compared" is=${
      { display: 'as it looks', linear: 'as light' }[/** @type {string} */ (meant.space)] ?? ''
    }>
      <${Choice} label="Compared" value=${settings.space ?? null} choices=${SPACES}
        change=${set('space')} /></${Row}>
    <${Row} title="Colours of lamps" is=${
      { free: 'are free', gentle: 'stay theirs unless asked', white: 'are whites' }[
        /** @type {string} */ (meant.colors)
      ] ?? ''
    }>
      <${Choice} label="Colours of lamps" value=${settings.colors ?? null} choices=${COLOURS}
        change=${set('colors')} /></${Row}>
    <${Row} title="How exact the paint is" is=${
      settings.literal ? 'taken at its word' : 'taken as a sketch'
    }>
      <${Check} label="Take the paint at its word" on=${Boolean(settings.literal)}
        change=${set('literal')} /></${Row}>
    <${Row} title="Lights that hardly matter" is="">
      <${Number_} label="Stay as now, strength" value=${settings.prefer_current ?? 0} least=${0}
        most=${10} step=${0.01} digits=${3} change=${set('prefer_current')} />
      <${Number_} label="Use at most" value=${settings.sparse ?? null} least=${1} digits=${0}
        most=${ui.lights.length || 1} empty="all" unit="lights" change=${set('sparse')} /></${Row}>
  </${Dialog}>`;
}

/** @param {number | null | undefined} hold */
function kept(hold) {
  if (hold === undefined || hold === null) return '';
  const much = hold === 1 ? '' : `, ${number(hold)} times as firmly as usual`;
  return hold ? `is kept near the present look${much}` : 'is let go';
}

/** @param {{title: string, is: string, children?: any}} props */
function Row({ title, is, children }) {
  return html`<section class="setting"><h3>${title}${is && html`<span class="faint">${is}</span>`}</h3>
    <div class="row">${children}</div></section>`;
}
