/** The dialog of all keyboard shortcuts, in which the keys of commands can be changed. */

import { t } from '../language/language.js';
import { html, useLayoutEffect, useRef, useState } from '../vendor/preact.js';
import { Button, Dialog } from './controls.js';
import {
  DEFAULT_KEYS,
  commandOf,
  isAllowed,
  keySymbols,
  keysOf,
  pressedKeys,
  withKeys,
  keyName,
} from './key_bindings.js';
import { SHORTCUTS } from './shortcuts.js';
import { startTour } from './tour.js';

/** @import { App, Ui } from './ui_state.js' */
/** @import { CommandKey } from './shortcuts.js' */
/** @import { Command } from './key_bindings.js' */

/** What is being changed: the command that waits for a key, and the one that was pressed if another
 * command has it. @typedef {{command: Command, keys?: string, other?: Command}} Recording */

/** @type {Map<Command, string>} */
const DESCRIPTIONS = new Map(
  SHORTCUTS.flatMap(({ keys }) => keys).flatMap((key) =>
    'command' in key ? [[key.command, key.description]] : [],
  ),
);

/** @param {{ui: Ui, app: App, close: () => void}} props */
export function ShortcutsDialog({ ui, app, close }) {
  const [recording, setRecording] = useState(/** @type {Recording | null} */ (null));
  const [note, setNote] = useState('');
  const set = (/** @type {Command} */ command, /** @type {string} */ keys) => {
    app.store.set((state) => withKeys(state, command, keys));
    setRecording(null);
    const names = namesOf(command, keys);
    setNote(keys ? t('{name}: {keys}', names) : t('{name} has no key.', names));
  };
  const isChanged = Object.keys(ui.keyBindings).length > 0;
  const resetAll = () => {
    app.store.set({ keyBindings: {} });
    setNote(t('All keys are those that the painter came with.'));
  };
  return html`<${Dialog} title=${t('Keyboard shortcuts')} close=${close} class="keys">
    ${SHORTCUTS.map(
      ({ title, keys }) => html`<section key=${title}><h3>${title}</h3><dl>
      ${keys.map((key) =>
        'command' in key
          ? html`<${CommandRow} key=${key.command} ui=${ui} entry=${key} recording=${recording}
            setRecording=${setRecording} setNote=${setNote} set=${set} />`
          : html`<div key=${key.description}><dt>${key.symbols.map(
              (symbol, k) => html`<kbd key=${k}>${keyName(symbol)}</kbd>`,
            )}</dt><dd>${key.description}</dd></div>`,
      )}
    </dl></section>`,
    )}
    <div class="key-foot"><p class="faint">${t('Press a key in this list, then the new one; Delete leaves the command without a key.')}</p>
      <p role="status">${note}</p>
      <${Button} label=${t('Show the tour')} act=${() => startTour(app.store)} />
      <${Button} icon="undo" label=${t('Reset all keys')} disabled=${!isChanged} act=${resetAll} /></div>
    <p class="faint">${t('On a tablet, one finger paints; two fingers pan and zoom. Pen pressure controls the flow.')}</p>
  </${Dialog}>`;
}

/** @param {Command} command @param {string} keys */
const namesOf = (command, keys) => ({
  name: DESCRIPTIONS.get(command) ?? command,
  keys: keySymbols(keys).join(' '),
});

/** A command: its key, which a press on it changes, and what it does.
 * @param {{ui: Ui, entry: CommandKey, recording: Recording | null,
 *   setRecording: (recording: Recording | null) => void, setNote: (note: string) => void,
 *   set: (command: Command, keys: string) => void}} props */
function CommandRow({ ui, entry, recording, setRecording, setNote, set }) {
  const { command, description } = entry;
  const own = recording?.command === command ? recording : null;
  const isWaiting = own !== null && !own.keys;
  const keys = keysOf(ui, command);
  const setUnlessTaken = (/** @type {string} */ newKeys) => {
    const other = commandOf(ui, newKeys);
    if (other && other !== command) setRecording({ command, keys: newKeys, other });
    else set(command, newKeys);
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (!isWaiting) return;
    if (event.key === 'Tab') return setRecording(null);
    event.preventDefault();
    event.stopPropagation();
    if (event.key === 'Escape') return setRecording(null);
    if (event.key === 'Delete' || event.key === 'Backspace') return set(command, '');
    if (['Shift', 'Control', 'Alt', 'Meta', 'AltGraph'].includes(event.key)) return;
    const [pressed] = pressedKeys(event);
    if (isAllowed(pressed)) setUnlessTaken(pressed);
    else
      setNote(
        t('{keys} cannot be set: the browser or the page needs it.', namesOf(command, pressed)),
      );
  };
  const symbols = keySymbols(keys);
  const shown = symbols.length ? symbols : [t('none')];
  return html`<div class=${own ? 'is-recorded' : ''}>
    <dt><button type="button" class="key-button" onKeyDown=${press}
      aria-label=${t('{name}: {keys}. Change the key', { name: description, keys: shown.join(' ') })}
      aria-pressed=${String(isWaiting)} onBlur=${() => isWaiting && setRecording(null)}
      onClick=${() => setRecording(own ? null : { command })}>${
        isWaiting
          ? html`<span>${t('press a key')}</span>`
          : shown.map((symbol, k) => [k > 0 && ' ', html`<kbd>${symbol}</kbd>`])
      }</button></dt>
    <dd>${description}${
      command in ui.keyBindings &&
      html`<${Button} icon="undo" tip=${t('Reset to {keys}', namesOf(command, DEFAULT_KEYS[command]))}
        act=${() => setUnlessTaken(DEFAULT_KEYS[command])} />`
    }</dd>
    ${
      own?.keys &&
      own.other &&
      html`<${Conflict} keys=${own.keys} other=${own.other}
      take=${() => set(command, own.keys ?? '')} cancel=${() => setRecording(null)} />`
    }</div>`;
}

/** The choice between two commands of one key.
 * @param {{keys: string, other: Command, take: () => void, cancel: () => void}} props */
function Conflict({ keys, other, take, cancel }) {
  const ref = useRef(/** @type {HTMLElement | null} */ (null));
  useLayoutEffect(() => ref.current?.querySelector('button')?.focus(), []);
  return html`<div class="key-conflict" role="group" ref=${ref} aria-label=${t('{keys} is: {name}', namesOf(other, keys))}>
    <p>${t('{keys} is: {name}', namesOf(other, keys))}</p>
    <${Button} label=${t('Take it')} primary act=${take} />
    <${Button} label=${t('Leave it')} act=${cancel} /></div>`;
}
