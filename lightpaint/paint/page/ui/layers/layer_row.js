/** A row of the list of layers; a press on its name unfolds its controls. */

import { html, useLayoutEffect, useRef } from '../../vendor/preact.js';
import { renamed } from '../../engine/layers/layer_names.js';
import { warmer } from '../../../../viewer/drawing/colour.js';
import { Button, NumberField, Slider, TextField } from '../controls.js';
import { GradientFields } from '../selection/gradient_options.js';
import { Icon } from '../icons.js';
import { chooseTool } from '../tools.js';
import {
  copiedLayers,
  groupedLayers,
  steppedLayer,
  ungroupedLayers,
  withoutLayers,
} from './layer_order.js';
import { LayerDelivery } from './layer_delivery.js';
import { t } from '../../language/language.js';

/** @import { App, RGB, Ui } from '../ui_state.js' */
/** @import { ChangeLayers, Layer } from '../../engine/messages.js' */

/** Size of the small picture of a layer, in pixels. */
const THUMBNAIL = { width: 40, height: 24 };

/** Importance is perceived as a ratio, and snaps to 1. */
const TIMES = {
  toPosition: (/** @type {number} */ x) => Math.log10(x),
  toValue: (/** @type {number} */ x) => Number((10 ** (Math.abs(x) < 0.03 ? 0 : x)).toPrecision(2)),
};

/** @param {{ui: Ui, app: App, layer: Layer, isInner: boolean, isActive: boolean,
 *   isUnfolded: boolean, isChosen: boolean}} props */
export function LayerRow({ ui, app, layer, isInner, isActive, isUnfolded, isChosen }) {
  const { store, engine } = app;
  const { id, name, is_visible: isVisible } = layer;
  const isGroup = layer.kind === 'group';
  const isOpen = ui.open[`layer ${id}`] ?? true;
  const fold = () => store.set({ open: { ...ui.open, [`layer ${id}`]: !isOpen } });
  const kind = [
    'layer',
    isInner && 'is-inner',
    isActive && 'is-active',
    isChosen && 'is-chosen',
    !isVisible && 'is-off',
  ];
  const show = () =>
    engine.changeLayers({
      layers: [{ ...layer, is_visible: !isVisible }],
      label: isVisible ? t('hide {name}', { name }) : t('show {name}', { name }),
    });
  const hover = (/** @type {number | null} */ hoveredLayer) => () => store.set({ hoveredLayer });
  const focus = (/** @type {any} */ event) =>
    event.currentTarget.matches(':focus-visible') && store.set({ hoveredLayer: id });
  return html`<li class=${kind.filter(Boolean).join(' ')} data-layer=${id}>
    <div class="layer-line" onPointerEnter=${hover(id)} onPointerLeave=${hover(null)}>
      <${Button} icon=${isVisible ? 'eye' : 'hidden'} 
        tip=${isVisible ? t('Hide {name}', { name }) : t('Show {name}', { name })} act=${show} />
      ${
        isGroup
          ? html`<button type="button" class="layer-fold" aria-expanded=${String(isOpen)}
              aria-label=${t('Layers of {name}', { name })} onClick=${fold}><${Icon} name="fold" /></button>`
          : html`<${LayerThumbnail} ui=${ui} app=${app} id=${id} />`
      }
      <button type="button" class="layer-name" aria-current=${isActive ? 'true' : undefined}
        aria-expanded=${String(isUnfolded)}
        aria-keyshortcuts="Alt+ArrowUp Alt+ArrowDown Delete" data-tip=${name.length > 24 ? name : undefined}
        onClick=${(/** @type {MouseEvent} */ event) => chooseLayer(event, app, id)} onFocus=${focus}
        onBlur=${hover(null)} onKeyDown=${(/** @type {KeyboardEvent} */ event) =>
          pressKey(event, app, layer)}>${name || t('Layer')}</button>
      ${layer.strength !== 1 && html`<span class="faint">${Math.round(100 * layer.strength)} %</span>`}
      <${LayerDelivery} ui=${ui} layer=${layer} />
      <span class="grip" aria-hidden="true" data-tip=${t('Drag to order')}><${Icon} name="grip" /></span>
    </div>
    ${isUnfolded && html`<${LayerControls} ui=${ui} app=${app} layer=${layer} />`}
  </li>`;
}

/** The small picture of a layer: its paint, or its mask. @param {{ui: Ui, app: App, id: number}} props */
function LayerThumbnail({ ui, app, id }) {
  const ref = useRef(/** @type {HTMLCanvasElement | null} */ (null));
  const { width, height } = THUMBNAIL;
  useLayoutEffect(() => {
    const context = ref.current?.getContext('2d');
    if (!context) return;
    const image = new ImageData(width, height);
    image.data.set(app.engine.layerThumbnail(id, width, height));
    context.putImageData(image, 0, 0);
  }, [id, ui.layerRevisions[id], ui.view]);
  useLayoutEffect(() => {
    // Of many layers, the pixels of those are fetched that somebody sees in the list.
    const observer = new IntersectionObserver((entries) => {
      if (entries.some(({ isIntersecting }) => isIntersecting)) app.engine.lookAtLayer(id);
    });
    if (ref.current) observer.observe(ref.current);
    return () => observer.disconnect();
  }, [id]);
  return html`<canvas class="layer-thumb" ref=${ref} width=${width} height=${height}
    aria-hidden="true"></canvas>`;
}

/** @param {{ui: Ui, app: App, layer: Layer}} props */
function LayerControls({ ui, app, layer }) {
  const { engine } = app;
  const { id, kind } = layer;
  const set = (/** @type {Partial<Layer>} */ made, /** @type {string} */ label, isFinal = true) => {
    const after = { ...layer, ...made };
    const named = { ...after, name: made.name ?? renamed(layer, after) };
    engine.changeLayers({ layers: [named], label, is_final: isFinal });
  };
  const change = (/** @type {ChangeLayers | null} */ made) => made && engine.changeLayers(made);
  const isMasked = ui.maskLayer === id;
  const mask = () => {
    if (!isMasked && !['brush', 'eraser', 'line'].includes(ui.tool)) chooseTool(app.store, 'brush');
    engine.paintMask(isMasked ? null : id);
  };
  const ids = ui.selectedLayers.includes(id) ? ui.selectedLayers : [id];
  // A slider that is let go where it was grasped has no other end.
  const release = () => setTimeout(() => engine.finishLayers());
  return html`<div class="layer-controls" onPointerUp=${release}>
    <${Slider} label=${t('Strength')} value=${100 * layer.strength} min=${0} max=${200} unit="%" resetValue=${100}
      tip=${t('100 %: as asked for; 200 %: twice the stops')}
      change=${(/** @type {number} */ to, /** @type {boolean} */ done) =>
        set({ strength: Math.round(to) / 100 }, 'strength', done)} />
    ${
      kind !== 'weigh' &&
      html`<${Slider} label=${t('Importance')} value=${layer.importance} min=${0.1} max=${10} curve=${TIMES}
      step=${0.1} digits=${2} resetValue=${1} unit="×" tip=${t('How many times as much this layer counts')}
      change=${(/** @type {number} */ importance, /** @type {boolean} */ done) =>
        set({ importance }, 'importance', done)} />`
    }
    ${layer.gradient && html`<${GradientFields} ui=${ui} gradient=${layer.gradient} set=${set} />`}
    ${(kind === 'adjust' || (layer.gradient && !layer.gradient.light)) && html`<${Adjustment} layer=${layer} set=${set} />`}
    ${
      kind === 'weigh' &&
      html`<${NumberField} label=${t('Weight')} value=${layer.times} min=${0.01} max=${100} step=${0.5}
      unit="×" change=${(/** @type {number} */ times) => set({ times }, 'importance')} />`
    }
    <${LayerName} layer=${layer} set=${set} />
    <div class="layer-acts" role="group" aria-label=${t('Actions for {name}', { name: layer.name })}>
      ${
        ['adjust', 'weigh', 'gradient'].includes(kind) &&
        html`<${Button} label=${t('Mask')} pressed=${isMasked} act=${mask}
        tip=${t('Paint where this layer applies: the brush adds, the eraser removes')} />`
      }
      ${
        kind === 'group'
          ? html`<${Button} label=${t('Ungroup')} act=${() => change(ungroupedLayers(ui.layers, id))} />`
          : html`<${Button} icon="group" tip=${ids.length > 1 ? t('Group {count} layers', { count: ids.length }) : t('Put into a group')}
              act=${() => change(groupedLayers(ui.layers, ids, ui.nextLayer))} />`
      }
      <span class="spring"></span>
      ${
        id !== 0 &&
        html`<${Button} icon="copy" tip=${t('Duplicate')}
        act=${() => change(copiedLayers(ui.layers, id, ui.nextLayer))} />`
      }
      <${Button} icon="trash" tip=${ids.length > 1 ? t('Delete {count} layers', { count: ids.length }) : t('Delete')}
        act=${() => change(withoutLayers(ui.layers, ids))} />
    </div>
  </div>`;
}

/** The wish of an adjustment, in numbers.
 * @param {{layer: Layer, set: (made: Partial<Layer>, label: string) => void}} props */
function Adjustment({ layer, set }) {
  const stops = Math.log2(layer.gain);
  const mired = miredOf(layer.tint);
  return html`<div class="layer-wish" data-numbers>
    <${NumberField} label=${t('Brighter')} value=${stops} min=${-8} max=${8} step=${0.1} unit=${t('st')}
      change=${(/** @type {number} */ to) => set({ gain: 2 ** to }, 'adjust')} />
    <${NumberField} label=${t('Warmer')} value=${mired} min=${-300} max=${300} step=${5} digits=${0}
      unit=${t('mired')} change=${(/** @type {number} */ to) => set({ tint: warmer(to) }, 'adjust')} />
  </div>`;
}

/** Return the change in mired of a tint, to the nearest. @param {RGB} tint */
function miredOf(tint) {
  const ratio = tint[0] / tint[2];
  let [low, high] = [-400, 400];
  for (let k = 0; k < 40; k += 1) {
    const middle = (low + high) / 2;
    const [r, , b] = warmer(middle);
    if (r / b < ratio) low = middle;
    else high = middle;
  }
  return Math.round(low * 10) / 10;
}

/** @param {{layer: Layer, set: (made: Partial<Layer>, label: string) => void}} props */
function LayerName({ layer, set }) {
  const take = (/** @type {string} */ name) => set({ name }, t('rename layer'));
  return html`<${TextField} class="layer-label" label=${t('Name')} value=${layer.name} maxLength=${80} take=${take}
    tip=${layer.name.length > 20 ? layer.name : undefined} />`;
}

/** Choose a layer; with Ctrl or Shift, others beside it. @param {MouseEvent} event @param {App} app
 * @param {number} id */
function chooseLayer(event, { store, engine }, id) {
  const { selectedLayers, layer, layers } = store.value;
  const before = selectedLayers.length ? selectedLayers : [layer];
  if (event.ctrlKey || event.metaKey) {
    const others = before.filter((one) => one !== id);
    store.set({ selectedLayers: before.includes(id) && others.length ? others : [...others, id] });
    if (before.includes(id) && others.length) return;
  } else if (event.shiftKey) {
    const ids = layers.map((one) => one.id);
    const [from, to] = [ids.indexOf(layer), ids.indexOf(id)].sort((a, b) => a - b);
    store.set({ selectedLayers: ids.slice(from, to + 1) });
  } else store.set({ selectedLayers: [], openLayer: store.value.openLayer === id ? null : id });
  engine.chooseLayer(id);
}

/** Keys on the name of a layer: arrows go to the next, with Alt they move it; Delete deletes it.
 * @param {KeyboardEvent} event @param {App} app @param {Layer} layer */
function pressKey(event, app, layer) {
  const { engine, store } = app;
  const way = { ArrowUp: -1, ArrowDown: 1 }[event.key];
  const { layers, selectedLayers } = store.value;
  const element = /** @type {HTMLElement} */ (event.currentTarget);
  const list = /** @type {HTMLElement} */ (element.closest('.layers'));
  const names = () => /** @type {HTMLElement[]} */ ([...list.querySelectorAll('.layer-name')]);
  if (way && event.altKey) {
    const change = steppedLayer(layers, layer.id, way);
    if (change) engine.changeLayers(change);
    store.set({
      layerNote: change
        ? way < 0
          ? t('{name} moved up', { name: layer.name })
          : t('{name} moved down', { name: layer.name })
        : '',
    });
    // An element that is moved loses the focus.
    const own = `[data-layer="${layer.id}"] .layer-name`;
    requestAnimationFrame(() => /** @type {HTMLElement} */ (list.querySelector(own))?.focus());
  } else if (way) names()[names().indexOf(element) + way]?.focus();
  else if (event.key === 'Delete' || event.key === 'Backspace') {
    const at = names().indexOf(element);
    const ids = selectedLayers.includes(layer.id) ? selectedLayers : [layer.id];
    engine.changeLayers(withoutLayers(layers, ids));
    store.set({ layerNote: t('{name} deleted', { name: layer.name }), hoveredLayer: null });
    requestAnimationFrame(() => names()[Math.min(at, names().length - 1)]?.focus());
  } else return;
  event.preventDefault();
  event.stopPropagation();
}
