/** The toolbar, and the options of the current tool above the pictures. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { toHex } from './paint_colour.js';
import { displayColour } from './colour_panel.js';
import { Button, Choice, NumberField, Select, Slider, reveal } from './controls.js';
import { signedText } from './format.js';
import { GradientOptions } from './selection/gradient_options.js';
import { SelectOptions } from './selection/select_options.js';
import { chooseSelect } from './selection/selection_settings.js';
import {
  chooseTool,
  flowOf,
  MIN_BRUSH_SIZE,
  MAX_BRUSH_SIZE,
  setFlow,
  swapColours,
  TOOLS,
} from './tools.js';
import { fill, words } from '../language/language.js';
import { shortcutsOf } from './key_bindings.js';

/** @typedef {import("./ui_state.js").Ui} Ui */
/** @typedef {import("./shortcuts.js").App} App */

/** Sizes are perceived as ratios. */
const RATIO_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.log2(x),
  toValue: (/** @type {number} */ t) => Math.round(2 ** t),
};

/** Symmetric around 1, and snapped to 1 near it. */
const FACTOR_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.log10(x),
  toValue: (/** @type {number} */ t) => Number((10 ** (Math.abs(t) < 0.02 ? 0 : t)).toPrecision(2)),
};

const AREAS = [
  { value: 'spot', label: words.toolbar.spot, tip: words.toolbar.aSoftSpotWhereTheDrag },
  {
    value: 'object',
    label: words.toolbar.object,
    tip: words.toolbar.theWholeObjectUnderThePointer,
  },
];
const SELECTED = {
  value: 'selection',
  label: words.toolbar.selection,
  tip: words.toolbar.allThatIsSelected,
};

/** Return the areas that a drag may adjust. @param {Ui} ui */
const areasOf = ({ state, selection }) => [
  ...(selection.current ? [SELECTED] : []),
  ...AREAS.filter(({ value }) => value === 'spot' || state?.objects?.length > 0),
];
const PAINT_MODES = [
  {
    value: 'light',
    label: words.toolbar.light,
    tip: words.toolbar.paintTheLightOnASurface,
  },
  { value: 'colour', label: words.toolbar.colour, tip: words.toolbar.paintTheFinalColourAsIt },
];

/** @param {{ui: Ui, app: App}} props */
export function ToolBar({ ui, app }) {
  const { store } = app;
  const second = { ...ui, ...ui.second };
  const style = {
    '--first': toHex(ui.colour),
    '--first-shown': displayColour(ui, app),
    '--second': toHex(second.colour),
    '--second-shown': displayColour(second, app),
  };
  return html`<nav class="tools" aria-label=${words.toolbar.tools}>
    ${TOOLS.map(
      ({ tool, icon, tip }) => html`<${Button} key=${tool} icon=${icon} tip=${tip}
      keys=${shortcutsOf(ui, tool)} pressed=${ui.tool === tool}
      act=${() => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool))}
      disabled=${tool === 'fill' && !ui.state?.objects?.length && !ui.selection.current} />`,
    )}
    <div class="spring"></div>
    <${Button} icon="photo" tip=${words.references.button}
      pressed=${ui.isReferenceOpen}
      act=${() => store.set({ isReferenceOpen: !ui.isReferenceOpen, clickAction: null })} />
    ${
      ui.state?.can_render &&
      html`<${Button} icon="lamp" tip=${words.toolbar.lightsInThePictureMarkAnd} keys=${shortcutsOf(ui, 'lights')}
      pressed=${ui.areLampsMarked} act=${() => app.session.toggleLamps()} />`
    }
    <button type="button" class="two-colours" style=${style} data-tip=${words.toolbar.swapColours} data-keys=${shortcutsOf(ui, 'swap')}
      aria-keyshortcuts=${shortcutsOf(ui, 'swap')} aria-label=${fill(words.toolbar.swapColoursTheCurrentOneIs, { colour: toHex(ui.colour), signed: signedText(ui.stops) })}
      onClick=${() => swapColours(store)}><i></i><i></i></button>
  </nav>`;
}

/** @param {{ui: Ui, app: App}} props */
export function ToolOptions({ ui, app }) {
  const { store } = app;
  const label = TOOLS.find(({ tool }) => tool === ui.tool)?.label ?? '';
  const isStrokeTool = ['brush', 'eraser', 'weight', 'line'].includes(ui.tool);
  const isPaintTool =
    ['brush', 'fill', 'line'].includes(ui.tool) ||
    (ui.tool === 'gradient' && !ui.gradient.isAdjusting);
  const isPanelOpen = ui.side && !ui.panel && Boolean(ui.open.ask);
  const togglePanel = () =>
    store.set({ side: true, panel: null, open: { ...ui.open, ask: !isPanelOpen } });
  return html`<div class="options" role="group" aria-label=${fill(words.toolbar.settings, { label })}>
    <strong>${label}</strong>
    ${
      isPaintTool &&
      ui.resources[nameInView('albedo', ui.view)] !== undefined &&
      html`<${Choice} label=${words.toolbar.paintAs}
      value=${ui.paintMode} choices=${PAINT_MODES} change=${(/** @type {any} */ paintMode) => store.set({ paintMode })} />`
    }
    ${
      ui.tool === 'weight' &&
      html`<${Slider} label=${words.toolbar.weight} value=${ui.importance} min=${0.1}
      max=${10} curve=${FACTOR_CURVE} step=${0.1} digits=${2} resetValue=${1} unit="×"
      tip=${words.toolbar.howManyTimesAsMuchThe}
      change=${(/** @type {number} */ importance) => store.set({ importance })} />`
    }
    ${ui.tool === 'gradient' && html`<${GradientOptions} ui=${ui} app=${app} />`}
    ${ui.tool === 'select' && html`<${SelectOptions} ui=${ui} app=${app} />`}
    ${
      ui.tool === 'adjust' &&
      (ui.state?.objects?.length > 0 || ui.selection.current) &&
      html`<${Choice} label=${words.toolbar.area} value=${ui.adjustedArea} choices=${areasOf(ui)} change=${(
        /** @type {any} */ adjustedArea,
      ) => store.set({ adjustedArea })} />`
    }
    ${
      (isStrokeTool || (ui.tool === 'adjust' && ui.adjustedArea === 'spot')) &&
      html`<${Slider} label=${words.toolbar.size}
      value=${ui.size} min=${MIN_BRUSH_SIZE} curve=${RATIO_CURVE} max=${MAX_BRUSH_SIZE} unit=${words.toolbar.px} keys=${shortcutsOf(ui, 'smaller', 'larger')}
      tip=${words.toolbar.size} change=${(/** @type {number} */ size) => store.set({ size })} />`
    }
    ${
      isStrokeTool &&
      html`<${Slider} label=${words.toolbar.hardness} value=${100 * ui.hardness} min=${0} max=${100} unit="%"
        keys=${shortcutsOf(ui, 'softer', 'harder')} tip=${words.toolbar.hardnessOfTheEdge}
        change=${(/** @type {number} */ percent) => store.set({ hardness: percent / 100 })} />`
    }
    ${
      ui.tool === 'fill' &&
      ui.selection.current &&
      html`<${Choice} label=${words.toolbar.area} value=${ui.adjustedArea === 'selection' ? 'selection' : 'object'}
        choices=${areasOf(ui).filter(({ value }) => value !== 'spot')}
        change=${(/** @type {any} */ adjustedArea) => store.set({ adjustedArea })} />`
    }
    ${
      (isStrokeTool || ui.tool === 'fill') &&
      html`<${Slider} label=${words.toolbar.flow} value=${100 * flowOf(ui)}
      min=${1} max=${100} unit="%" keys="1 … 0" tip=${
        isStrokeTool
          ? words.toolbar.flowHowMuchPaintEachDab
          : words.toolbar.flow100CoversTheObjectCompletely
      }
      change=${(/** @type {number} */ flow) => setFlow(store, flow / 100)} />`
    }
    ${
      ui.tool === 'adjust' &&
      html`<${Button} label=${words.toolbar.byNumbers} pressed=${isPanelOpen}
      tip=${words.toolbar.typeStopsAndMiredForAn} act=${togglePanel} />`
    }
  </div>`;
}

/** The value of this choice; names of objects are not empty. */
const WHOLE_PICTURE = '';

/** The adjustment of a drag in numbers, for one object or the whole picture. Also used in a panel.
 * @param {{ui: Ui, app: App}} props */
export function AdjustPanel({ ui, app }) {
  const { store, engine } = app;
  const { stops, mired, object } = ui.typedAdjustment;
  const objects = /** @type {string[]} */ (ui.state?.objects ?? []);
  // By its name, since another view numbers its objects differently and may not show this one.
  const isMissing = object !== null && !objects.includes(object);
  const choices = [
    {
      value: WHOLE_PICTURE,
      label: ui.selection.current ? words.toolbar.selection : words.toolbar.wholePicture,
    },
    ...(isMissing ? [{ value: object, label: fill(words.toolbar.notInThisView, { object }) }] : []),
    ...[...objects]
      .sort((a, b) => a.localeCompare(b))
      .map((name) => ({ value: name, label: name })),
  ];
  const set = (/** @type {Partial<Ui['typedAdjustment']>} */ changes) =>
    store.set((state) => ({ typedAdjustment: { ...state.typedAdjustment, ...changes } }));
  const adjust = (/** @type {MouseEvent} */ event) => {
    store.set({ hint: false });
    engine.adjust({ stops, mired, object: object === null ? null : objects.indexOf(object) });
    // Return the focus to the pictures, for their keys.
    if (event.detail) reveal(/** @type {HTMLElement} */ (event.currentTarget), '.stage', true);
  };
  return html`<div class="ask" data-numbers>
    <${Select} label=${words.toolbar.area} value=${object ?? WHOLE_PICTURE} choices=${choices}
      change=${(/** @type {string} */ area) => set({ object: area === WHOLE_PICTURE ? null : area })} />
    <${NumberField} label=${words.toolbar.brighter} value=${stops} min=${-8} max=${8} step=${0.1} unit=${words.toolbar.st}
      change=${(/** @type {number} */ value) => set({ stops: value })} />
    <${NumberField} label=${words.toolbar.warmer} value=${mired} min=${-300} max=${300} step=${5} digits=${0}
      unit=${words.toolbar.mired} change=${(/** @type {number} */ value) => set({ mired: value })} />
    <${Button} label=${words.toolbar.apply} disabled=${isMissing || (!stops && !mired)} act=${adjust}
      tip=${words.toolbar.appliedAsOneStrokeWhichCan} />
  </div>`;
}
