/** The language that was chosen for the page, and its sentences. The code has them in English, and they
 * are the keys of translations: what a translation lacks is shown in English. */

import { LANGUAGES } from './languages.js';

/** @import { Forms } from './languages.js' */
/** @typedef {string | number | undefined} Value */
/** The names in the braces of a sentence.
 * @template {string} S
 * @typedef {S extends `${string}{${infer Name}}${infer Rest}` ? Name | Names<Rest> : never} Names */

/** Where the browser keeps the chosen language. */
const LANGUAGE_KEY = 'lightpaint.language';

/** The code of the language that the page has: the chosen one, else the browser's, else English. */
export const language = chooseLanguage();

const translation = LANGUAGES[language];

const rules = new Intl.PluralRules(language);

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

/** Return a sentence in the language of the page, with values in place of its names in braces.
 * A `context` tells one meaning of an English word from another: its key is `Light (theme)`.
 * @template {string} S @param {S} sentence a literal, since translators are given those
 * @param {[Names<S>] extends [never] ? [{context: string}?] : [Record<Names<S>, Value>]} values */
export function t(sentence, ...[values]) {
  const { context, ...names } = /** @type {Record<string, Value>} */ (values ?? {});
  const text = (context && translation[`${sentence} (${context})`]) ?? translation[sentence];
  return fill(String(text ?? sentence), names);
}

/** Return the form of a sentence for a number, which replaces `{count}`. Its form `one` is its key.
 * @param {number} count @param {{one: string, other: string}} english literals
 * @param {Record<string, Value>} [values] */
export function plural(count, english, values) {
  /** @type {string | Forms} */
  const forms = translation[english.one] ?? english;
  const text = typeof forms === 'string' ? forms : (forms[rules.select(count)] ?? forms.other);
  return fill(text, { count, ...values });
}

/** @param {string} text @param {Record<string, Value>} values */
const fill = (text, values) =>
  text.replace(/\{(\w+)\}/g, (braces, name) => String(values[name] ?? braces));
