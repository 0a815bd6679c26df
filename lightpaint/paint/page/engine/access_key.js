/**
 * The key to the painter's server: how a page gets it and presents it.
 *
 * The address that a terminal shows has a token in its fragment, which browsers never send. The
 * page takes it from there and exchanges it for the key. What a browser would attach by itself, a
 * cookie, goes to all servers of the machine; the key goes where the page sends it.
 */

/** What a socket speaks. */
export const PROTOCOL = 'lightpaint';

/** Under which name the key is kept for a page that is loaded anew: for one tab, and one origin,
 * which has its port. */
const KEPT = 'lightpaint-key';

/** How a server answers a page of an earlier start, or one that shows no key. */
export const REFUSALS = [403, 410];

/** Who shows a key, or a token. @param {string | null} key @returns {RequestInit} */
export function authorization(key) {
  return { credentials: 'omit', headers: { authorization: `Bearer ${key}` } };
}

export class AccessKey {
  /** Where the page came from. @param {string | URL} base */
  constructor(base) {
    this.url = new URL('key', new URL('.', base));
    /** Until it is exchanged, or refused. @type {string | null} */
    this.token = tokenIn(location.hash);
    // Who is given a new address in the same tab stays on the page: only its fragment changes.
    addEventListener('hashchange', () => {
      if (tokenIn(location.hash)) location.reload();
    });
  }

  /** The key, or null for who has none; fails where no server is. @returns {Promise<string | null>} */
  async key() {
    if (this.token === null) return storedKey();
    const answer = await fetch(this.url, { ...authorization(this.token), cache: 'no-store' });
    if (!answer.ok && !REFUSALS.includes(answer.status)) throw new Error(await answer.text());
    const key = answer.ok ? await answer.text() : storedKey();
    if (key !== null) storeKey(key);
    this.token = null;
    // Nobody who looks at the page, or at what its browser remembers, is to see it.
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
    return sessionStorage.getItem(KEPT);
  } catch {
    return null; // The browser is told to keep nothing.
  }
}

/** @param {string} key */
function storeKey(key) {
  try {
    sessionStorage.setItem(KEPT, key);
  } catch {
    // A page that is loaded anew then has to come by the address again.
  }
}
