/** The toolbar, and the options of the current tool above the pictures. */

import { inView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { toHex } from './paint_colour.js';
import { shownAs } from './colour_panel.js';
import { Button, Choice, NumberField, Select, Slider, reveal } from './controls.js';
import { signed } from './format.js';
import {
  chooseTool,
  flowOf,
  MIN_BRUSH_SIZE,
  MAX_BRUSH_SIZE,
  setFlow,
  swapColours,
  TOOLS,
} from './tools.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** Sizes are perceived as ratios. */
const RATIO = {
  to: (/** @type {number} */ x) => Math.log2(x),
  of: (/** @type {number} */ t) => Math.round(2 ** t),
};

/** Symmetric around 1, and snapped to 1 near it. */
const TIMES = {
  to: (/** @type {number} */ x) => Math.log10(x),
  of: (/** @type {number} */ t) => Number((10 ** (Math.abs(t) < 0.02 ? 0 : t)).toPrecision(2)),
};

const ABOUT = [
  { value: 'spot', label: 'Spot', tip: 'A soft spot where the drag begins' },
  { value: 'object', label: 'Object', tip: 'The whole object under the pointer' },
];
const PAINT_AS = [
  {
    value: 'light',
    label: 'Light',
    tip: 'Paint the light on a surface: its own colour stays visible',
  },
  { value: 'colour', label: 'Colour', tip: 'Paint the final colour, as it should appear' },
];

/** @param {{ui: Ui, app: App}} props */
export function ToolBar({ ui, app }) {
  const { store } = app;
  const second = { ...ui, ...ui.second };
  const style = {
    '--first': toHex(ui.colour),
    '--first-shown': shownAs(ui, app),
    '--second': toHex(second.colour),
    '--second-shown': shownAs(second, app),
  };
  return html`<nav class="tools" aria-label="Tools">
    ${TOOLS.map(
      ({ tool, icon, keys, tip }) => html`<${Button} key=${tool} icon=${icon} tip=${tip}
      keys=${keys} on=${ui.tool === tool} act=${() => chooseTool(store, tool)}
      disabled=${tool === 'fill' && !ui.state?.objects?.length} />`,
    )}
    <div class="spring"></div>
    ${
      ui.state?.can_render &&
      html`<${Button} icon="lamp" tip="Lights in the picture: mark and move them" keys="D"
      on=${ui.lamps} act=${() => app.session.toggleLamps()} />`
    }
    <button type="button" class="two-colours" style=${style} data-tip="Swap colours" data-keys="X"
      aria-keyshortcuts="X" aria-label=${`Swap colours: the current one is ${toHex(ui.colour)}, ${signed(ui.stops)} stops`}
      onClick=${() => swapColours(store)}><i></i><i></i></button>
  </nav>`;
}

/** @param {{ui: Ui, app: App}} props */
export function ToolOptions({ ui, app }) {
  const { store } = app;
  const label = TOOLS.find(({ tool }) => tool === ui.tool)?.label ?? '';
  const strokes = ['brush', 'eraser', 'weight', 'line'].includes(ui.tool);
  const paints = ['brush', 'fill', 'line'].includes(ui.tool);
  const isAsking = ui.side && !ui.panel && Boolean(ui.open.ask);
  const numbers = () =>
    store.set({ side: true, panel: null, open: { ...ui.open, ask: !isAsking } });
  return html`<div class="options" role="group" aria-label=${`${label} settings`}>
    <strong>${label}</strong>
    ${
      paints &&
      ui.resources[inView('albedo', ui.view)] !== undefined &&
      html`<${Choice} label="Paint as"
      value=${ui.as} choices=${PAINT_AS} change=${(/** @type {any} */ as) => store.set({ as })} />`
    }
    ${
      ui.tool === 'weight' &&
      html`<${Slider} label="Weight" value=${ui.importance} least=${0.1}
      most=${10} curve=${TIMES} step=${0.1} digits=${2} rest=${1} unit="×"
      tip="How many times as much the area counts: above 1 the answer matches better there"
      change=${(/** @type {number} */ importance) => store.set({ importance })} />`
    }
    ${
      ui.tool === 'adjust' &&
      ui.state?.objects?.length > 0 &&
      html`<${Choice} label="Area"
      value=${ui.about} choices=${ABOUT} change=${(/** @type {any} */ about) =>
        store.set({ about })} />`
    }
    ${
      (strokes || (ui.tool === 'adjust' && ui.about === 'spot')) &&
      html`<${Slider} label="Size"
      value=${ui.size} least=${MIN_BRUSH_SIZE} curve=${RATIO} most=${MAX_BRUSH_SIZE} unit="px" keys="[ ]"
      tip="Size" change=${(/** @type {number} */ size) => store.set({ size })} />`
    }
    ${
      strokes &&
      html`<${Slider} label="Hardness" value=${100 * ui.hardness} least=${0} most=${100} unit="%"
        keys="Shift [ ]" tip="Hardness of the edge"
        change=${(/** @type {number} */ hard) => store.set({ hardness: hard / 100 })} />`
    }
    ${
      (strokes || ui.tool === 'fill') &&
      html`<${Slider} label="Flow" value=${100 * flowOf(ui)}
      least=${1} most=${100} unit="%" keys="1 … 0" tip=${
        strokes ? 'Flow: how much paint each dab adds' : 'Flow: 100 % covers the object completely'
      }
      change=${(/** @type {number} */ flow) => setFlow(store, flow / 100)} />`
    }
    ${
      ui.tool === 'adjust' &&
      html`<${Button} label="By numbers" on=${isAsking}
      tip="Type stops and mired, for an object or the whole picture" act=${numbers} />`
    }
  </div>`;
}

/** The value of this choice; names of objects are not empty. */
const WHOLE = '';

/** The adjustment of a drag in numbers, for one object or the whole picture. Also used in a panel.
 * @param {{ui: Ui, app: App}} props */
export function Ask({ ui, app }) {
  const { store, engine } = app;
  const { stops, mired, object } = ui.inNumbers;
  const objects = /** @type {string[]} */ (ui.state?.objects ?? []);
  // By its name, since another view numbers its objects differently and may not show this one.
  const isMissing = object !== null && !objects.includes(object);
  const choices = [
    { value: WHOLE, label: 'Whole picture' },
    ...(isMissing ? [{ value: object, label: `${object}: not in this view` }] : []),
    ...[...objects]
      .sort((a, b) => a.localeCompare(b))
      .map((name) => ({ value: name, label: name })),
  ];
  const set = (/** @type {Partial<Ui['inNumbers']>} */ changed) =>
    store.set((now) => ({ inNumbers: { ...now.inNumbers, ...changed } }));
  const adjust = (/** @type {MouseEvent} */ event) => {
    store.set({ hint: false });
    engine.adjust({ stops, mired, object: object === null ? null : objects.indexOf(object) });
    // Return the focus to the pictures, for their keys.
    if (event.detail) reveal(/** @type {HTMLElement} */ (event.currentTarget), '.stage', true);
  };
  return html`<div class="ask" data-numbers>
    <${Select} label="Area" value=${object ?? WHOLE} choices=${choices}
      change=${(/** @type {string} */ to) => set({ object: to === WHOLE ? null : to })} />
    <${NumberField} label="Brighter" value=${stops} least=${-8} most=${8} step=${0.1} unit="st"
      change=${(/** @type {number} */ to) => set({ stops: to })} />
    <${NumberField} label="Warmer" value=${mired} least=${-300} most=${300} step=${5} digits=${0}
      unit="mired" change=${(/** @type {number} */ to) => set({ mired: to })} />
    <${Button} label="Apply" disabled=${isMissing || (!stops && !mired)} act=${adjust}
      tip="Applied as one stroke, which can be undone" />
  </div>`;
}
