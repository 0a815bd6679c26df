/** All languages of the page, by their codes. To add one, write a file like `en.js` and list it here. */

import { en } from './en.js';

/** @typedef {typeof en} Words */

/** @type {Record<string, Words>} */
export const LANGUAGES = { en };
