/** The presets: requests for the whole scene, each with a picture of what it asks for. */

import { html, useState } from '../vendor/preact.js';
import { Button, Dialog, Select } from './controls.js';
import { sheetStyle, Thumbnail } from './thumbnail.js';
import { t } from '../language/language.js';

/** @import { App, Ui } from './ui_state.js' */

/** Value of the choice that leaves the subject to the painter. */
const CENTRAL = '';

/** @param {{ui: Ui, app: App, close: () => void}} props */
export function PresetsDialog({ ui, app, close }) {
  const [subject, setSubject] = useState(CENTRAL);
  const objects = [...new Set(/** @type {string[]} */ (ui.state?.objects ?? []))];
  const choices = [
    { value: CENTRAL, label: t('The most central object') },
    ...objects.map((name) => ({ value: name, label: name })),
  ];
  const apply = async (/** @type {string} */ preset, /** @type {boolean} */ hasSubject) => {
    close();
    app.engine.cancel();
    const { store } = app;
    store.set((state) => ({ open: { ...state.open, layers: true } }));
    const before = new Set(store.value.layers.map(({ id }) => id));
    await app.session.send('apply_preset', {
      preset,
      subject: hasSubject && subject !== CENTRAL ? subject : null,
    });
    // Its strength is what people change next.
    const group = store.value.layers.find(({ id, kind }) => kind === 'group' && !before.has(id));
    if (group) store.set({ openLayer: group.id });
  };
  return html`<${Dialog} title=${t('Presets')} close=${close} class="looks-dialog">
    <p>${t('A preset asks for light, and the lamps come as close as they can. It becomes a group of layers, whose strength you can change later.')}</p>
    ${
      objects.length > 0 &&
      html`<div class="row"><${Select} label=${t('Subject')} value=${subject} choices=${choices}
        tip=${t('For presets about one object')} change=${setSubject} /></div>`
    }
    <ul class="sheet" style=${sheetStyle(ui)}>${(ui.state?.presets ?? []).map(
      (/** @type {import("../engine/messages.js").PresetInfo} */ preset) => html`
      <li key=${preset.name}><button type="button"
        onClick=${() => void apply(preset.name, preset.has_subject)}>
        <${Thumbnail} name=${`preset/${preset.name}`} generation=${0} app=${app} />
        <span><strong>${preset.title}</strong></span><span class="faint">${preset.description}</span>
      </button></li>`,
    )}</ul>
  </${Dialog}>`;
}

/** @param {{app: App}} props */
export function PresetsButton({ app }) {
  return html`<${Button} label=${t('Presets')} class="in-head" tip=${t('Moonlight, noir, gallery and others')}
    act=${() => app.store.set({ dialog: 'presets' })} />`;
}
