/** The dark and the light theme: as the system or the notebook has it, or as chosen. */

/** @import { UiStore } from './ui_state.js' */
/** @typedef {"system" | "dark" | "light"} Theme */

/** @type {Theme[]} */
export const THEMES = ['system', 'dark', 'light'];

/** Attributes by which notebooks say what theme they have: JupyterLab, VS Code, marimo. */
const NOTEBOOK_ATTRIBUTES = ['data-jp-theme-light', 'data-vscode-theme-kind', 'class'];

/** Return the theme of the notebook around the painter; null if there is none, or it does not say.
 * @returns {"dark" | "light" | null} */
function notebookTheme() {
  const { classList, dataset } = document.body;
  if (dataset.jpThemeLight) return dataset.jpThemeLight === 'true' ? 'light' : 'dark';
  const kind = dataset.vscodeThemeKind;
  if (kind) return kind.endsWith('light') ? 'light' : 'dark';
  if (classList.contains('dark-theme')) return 'dark';
  return classList.contains('light-theme') ? 'light' : null;
}

/** Give an element the theme from now on, also when the system, the notebook or the choice changes.
 * @param {HTMLElement} root of the painter @param {UiStore} store
 * @returns {() => void} what ends it */
export function followTheme(root, store) {
  const lightSystem = matchMedia('(prefers-color-scheme: light)');
  const update = () => {
    const { theme } = store.value;
    const system = lightSystem.matches ? 'light' : 'dark';
    root.dataset.theme = theme === 'system' ? (notebookTheme() ?? system) : theme;
  };
  update();
  lightSystem.addEventListener('change', update);
  const observer = new MutationObserver(update);
  observer.observe(document.body, { attributeFilter: NOTEBOOK_ATTRIBUTES });
  const stopListening = store.listen(update);
  return () => {
    lightSystem.removeEventListener('change', update);
    observer.disconnect();
    stopListening();
  };
}
