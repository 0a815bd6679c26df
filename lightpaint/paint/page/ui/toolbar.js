/** The toolbar, and the options of the current tool above the pictures. */

import { nameInView } from '../engine/message_frames.js';
import { html } from '../vendor/preact.js';
import { toHex } from '../../../viewer/drawing/colour.js';
import { displayColour } from './colour_panel.js';
import { Button, Choice, NumberField, Select, Slider, reveal, option } from './controls.js';
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
import { t } from '../language/language.js';
import { shortcutsOf } from './key_bindings.js';

/** @import { App, Ui } from './ui_state.js' */

/** Sizes are perceived as ratios. */
const RATIO_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.log2(x),
  toValue: (/** @type {number} */ x) => Math.round(2 ** x),
};

/** Symmetric around 1, and snapped to 1 near it. */
const FACTOR_CURVE = {
  toPosition: (/** @type {number} */ x) => Math.log10(x),
  toValue: (/** @type {number} */ x) => Number((10 ** (Math.abs(x) < 0.02 ? 0 : x)).toPrecision(2)),
};

const AREAS = [
  { value: 'spot', label: t('Spot'), tip: t('A soft spot where the drag begins') },
  { value: 'object', label: t('Object'), tip: t('The whole object under the pointer') },
];
const SELECTED = { value: 'selection', label: t('Selection'), tip: t('All that is selected') };

/** Return the areas that a drag may adjust. @param {Ui} ui */
const areasOf = ({ state, selection }) => [
  ...(selection.current ? [SELECTED] : []),
  ...AREAS.filter(({ value }) => value === 'spot' || state?.objects?.length > 0),
];
const PAINT_MODES = [
  option('light', t('Light'), t('Paint the light on a surface: its own colour stays visible')),
  option('colour', t('Colour'), t('Paint the final colour, as it should appear')),
];

/** @param {{ui: Ui, app: App}} props */
export function ToolBar({ ui, app }) {
  const { store } = app;
  // A copy of the state would read all of it, and the bar would render for every change.
  const second = Object.assign(Object.create(ui), ui.second);
  const style = {
    '--first': toHex(ui.colour),
    '--first-shown': displayColour(ui, app),
    '--second': toHex(second.colour),
    '--second-shown': displayColour(second, app),
  };
  return html`<nav class="tools" aria-label=${t('Tools')}>
    ${TOOLS.map(
      ({ tool, icon, tip }) => html`<${Button} key=${tool} icon=${icon} tip=${tip}
      keys=${shortcutsOf(ui, tool)} pressed=${ui.tool === tool}
      act=${() => (tool === 'select' ? chooseSelect(store) : chooseTool(store, tool))}
      disabled=${tool === 'fill' && !ui.state?.objects?.length && !ui.selection.current} />`,
    )}
    <div class="spring"></div>
    <${Button} icon="photo" tip=${t('References: pictures whose light you want here')}
      pressed=${ui.isReferenceOpen}
      act=${() => store.set({ isReferenceOpen: !ui.isReferenceOpen, clickAction: null })} />
    ${
      ui.state?.can_render &&
      html`<${Button} icon="lamp" tip=${t('Lights in the picture: mark and move them')} keys=${shortcutsOf(ui, 'lights')}
      pressed=${ui.areLampsMarked} act=${() => app.session.toggleLamps()} />`
    }
    <button type="button" class="two-colours" style=${style} data-tip=${t('Swap colours')} data-keys=${shortcutsOf(ui, 'swap')}
      aria-keyshortcuts=${shortcutsOf(ui, 'swap')}
      aria-label=${t('Swap colours: the current one is {colour}, {signed} stops', {
        colour: toHex(ui.colour),
        signed: signedText(ui.stops),
      })}
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
  return html`<div class="options" role="group" aria-label=${t('{label} settings', { label })}>
    <strong>${label}</strong>
    ${
      isPaintTool &&
      ui.resources[nameInView('albedo', ui.view)] !== undefined &&
      html`<${Choice} label=${t('Paint as')}
      value=${ui.paintMode} choices=${PAINT_MODES} change=${(/** @type {any} */ paintMode) => store.set({ paintMode })} />`
    }
    ${
      ui.tool === 'weight' &&
      html`<${Slider} label=${t('Weight')} value=${ui.importance} min=${0.1}
      max=${10} curve=${FACTOR_CURVE} step=${0.1} digits=${2} resetValue=${1} unit="×"
      tip=${t('How many times as much the area counts: above 1 the answer matches better there')}
      change=${(/** @type {number} */ importance) => store.set({ importance })} />`
    }
    ${ui.tool === 'gradient' && html`<${GradientOptions} ui=${ui} app=${app} />`}
    ${ui.tool === 'select' && html`<${SelectOptions} ui=${ui} app=${app} />`}
    ${
      ui.tool === 'adjust' &&
      (ui.state?.objects?.length > 0 || ui.selection.current) &&
      html`<${Choice} label=${t('Area')} value=${ui.adjustedArea} choices=${areasOf(ui)} change=${(
        /** @type {any} */ adjustedArea,
      ) => store.set({ adjustedArea })} />`
    }
    ${
      (isStrokeTool || (ui.tool === 'adjust' && ui.adjustedArea === 'spot')) &&
      html`<${Slider} label=${t('Size')}
      value=${ui.size} min=${MIN_BRUSH_SIZE} curve=${RATIO_CURVE} max=${MAX_BRUSH_SIZE} unit=${t('px')} keys=${shortcutsOf(ui, 'smaller', 'larger')}
      tip=${t('Size')} change=${(/** @type {number} */ size) => store.set({ size })} />`
    }
    ${
      isStrokeTool &&
      html`<${Slider} label=${t('Hardness')} value=${100 * ui.hardness} min=${0} max=${100} unit="%"
        keys=${shortcutsOf(ui, 'softer', 'harder')} tip=${t('Hardness of the edge')}
        change=${(/** @type {number} */ percent) => store.set({ hardness: percent / 100 })} />`
    }
    ${
      ui.tool === 'fill' &&
      ui.selection.current &&
      html`<${Choice} label=${t('Area')} value=${ui.adjustedArea === 'selection' ? 'selection' : 'object'}
        choices=${areasOf(ui).filter(({ value }) => value !== 'spot')}
        change=${(/** @type {any} */ adjustedArea) => store.set({ adjustedArea })} />`
    }
    ${
      (isStrokeTool || ui.tool === 'fill') &&
      html`<${Slider} label=${t('Flow')} value=${100 * flowOf(ui)}
      min=${1} max=${100} unit="%" keys="1 … 0" tip=${
        isStrokeTool
          ? t('Flow: how much paint each dab adds')
          : t('Flow: 100 % covers the object completely')
      }
      change=${(/** @type {number} */ flow) => setFlow(store, flow / 100)} />`
    }
    ${
      ui.tool === 'adjust' &&
      html`<${Button} label=${t('By numbers')} pressed=${isPanelOpen}
      tip=${t('Type stops and mired, for an object or the whole picture')} act=${togglePanel} />`
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
    { value: WHOLE_PICTURE, label: ui.selection.current ? t('Selection') : t('Whole picture') },
    ...(isMissing ? [{ value: object, label: t('{object}: not in this view', { object }) }] : []),
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
    <${Select} label=${t('Area')} value=${object ?? WHOLE_PICTURE} choices=${choices}
      change=${(/** @type {string} */ area) => set({ object: area === WHOLE_PICTURE ? null : area })} />
    <${NumberField} label=${t('Brighter')} value=${stops} min=${-8} max=${8} step=${0.1} unit=${t('st')}
      change=${(/** @type {number} */ value) => set({ stops: value })} />
    <${NumberField} label=${t('Warmer')} value=${mired} min=${-300} max=${300} step=${5} digits=${0}
      unit=${t('mired')} change=${(/** @type {number} */ value) => set({ mired: value })} />
    <${Button} label=${t('Apply')} disabled=${isMissing || (!stops && !mired)} act=${adjust}
      tip=${t('Applied as one stroke, which can be undone')} />
  </div>`;
}
