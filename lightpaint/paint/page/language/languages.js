/** All languages of the page, by their codes. English has no translation: its sentences stand in the
 * code. To add a language, write its translation in a file like `de.js`, and list it here. */

/** Forms of a sentence by number, as `Intl.PluralRules` names them.
 * @typedef {{other: string, zero?: string, one?: string, two?: string, few?: string, many?: string}} Forms */
/** Translated sentences by the English ones; a sentence about a number by its form `one`.
 * @typedef {Record<string, string | Forms>} Translation */

/** @type {Record<string, Translation>} */
export const LANGUAGES = { en: {} };
