/**
 * The key to the painter's server, which a page obtains and presents.
 *
 * The address that a terminal shows has a token in its fragment, which browsers never send. The
 * page takes it from there and exchanges it for the key. Browsers attach a cookie to requests to
 * every server of the machine; the key goes only where the page sends it.
 */

/** WebSocket subprotocol. */
export const PROTOCOL = 'lightpaint';

/** Storage name of the key, which survives a reload. Storage belongs to one tab and one origin,
 * port included. */
const STORAGE_KEY = 'lightpaint-key';

/** HTTP statuses for a page from an earlier start of the server, or one without a key. */
export const REFUSALS = [403, 410];

/** Return request options that present a key or a token. @param {string | null} key
 * @returns {RequestInit} */
export function authorization(key) {
  return { credentials: 'omit', headers: { authorization: `Bearer ${key}` } };
}

export class AccessKey {
  /** Where the page came from. @param {string | URL} base */
  constructor(base) {
    this.url = new URL('key', new URL('.', base));
    /** Kept until it is exchanged or refused. @type {string | null} */
    this.token = tokenIn(location.hash);
    // A new address opened in the same tab does not reload the page, since only its fragment
    // changes.
    addEventListener('hashchange', () => {
      if (tokenIn(location.hash)) location.reload();
    });
  }

  /** Return the key, or null without one. Rejects if no server answers.
   * @returns {Promise<string | null>} */
  async key() {
    if (this.token === null) return storedKey();
    const answer = await fetch(this.url, { ...authorization(this.token), cache: 'no-store' });
    if (!answer.ok && !REFUSALS.includes(answer.status)) throw new Error(await answer.text());
    const key = answer.ok ? await answer.text() : storedKey();
    if (key !== null) storeKey(key);
    this.token = null;
    // Hide the token from onlookers and from the browser's history.
    history.replaceState(history.state, '', location.pathname + location.search);
    return key;
  }
}

/** @param {string} fragment of an address */
function tokenIn(fragment) {
  return new URLSearchParams(fragment.slice(1)).get('token');
}

function storedKey() {
  try {
    return sessionStorage.getItem(STORAGE_KEY);
  } catch {
    return null; // The browser may refuse to store anything.
  }
}

/** @param {string} key */
function storeKey(key) {
  try {
    sessionStorage.setItem(STORAGE_KEY, key);
  } catch {
    // Then a reloaded page needs the address with the token again.
  }
}
