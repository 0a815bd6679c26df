/** The texts of the page in the language that was chosen, and what puts numbers and names into them. */

import { LANGUAGES } from './languages.js';

/** @typedef {import("./languages.js").Words} Words */
/** Forms of a text by number, as `Intl.PluralRules` names them.
 * @typedef {{other: string, zero?: string, one?: string, two?: string, few?: string, many?: string}} Forms */

/** Where the browser keeps the chosen language. */
const LANGUAGE_KEY = 'lightpaint.language';

/** The code of the language that the page has: the chosen one, else that of the browser, else English. */
export const language = chooseLanguage();

/** @type {Words} */
export const words = LANGUAGES[language];

const pluralRules = new Intl.PluralRules(language);

/** @returns {string} */
function chooseLanguage() {
  const codes = [storedLanguage(), ...navigator.languages.map((code) => code.split('-')[0])];
  return codes.find((code) => code in LANGUAGES) ?? 'en';
}

/** @returns {string} */
function storedLanguage() {
  try {
    return localStorage.getItem(LANGUAGE_KEY) ?? '';
  } catch {
    return '';
  }
}

/** Have the page in another language when it opens next. @param {string} code */
export function storeLanguage(code) {
  try {
    localStorage.setItem(LANGUAGE_KEY, code);
  } catch {
    // Private windows and frames of some notebooks store nothing.
  }
}

/** All languages, each with its own name for itself. */
export const languageChoices = Object.keys(LANGUAGES).map((code) => ({
  value: code,
  label: new Intl.DisplayNames([code], { type: 'language' }).of(code) ?? code,
}));

/** Return a text with its placeholders, such as `{name}`, replaced.
 * @param {string} text @param {Record<string, string | number | undefined>} values */
export const fill = (text, values) =>
  text.replace(/\{(\w+)\}/g, (placeholder, name) => String(values[name] ?? placeholder));

/** Return the form of a text for a number, which replaces `{count}`.
 * @param {Forms} forms @param {number} count @param {Record<string, string | number>} [values] */
export const fillCount = (forms, count, values = {}) =>
  fill(forms[pluralRules.select(count)] ?? forms.other, { count, ...values });
