/**
 * The session behind a WebSocket and HTTP.
 *
 * Every message has a number, which its reply repeats. After a lost connection the host reconnects and
 * begins with `hello`.
 */
import { AccessKey, PROTOCOL, REFUSALS, authorization } from './access_key.js';
import { VERSION, encodeFrame, pictureOf, decodeFrame } from './message_frames.js';
import { t } from '../language/language.js';

/** @import { Arrays, Message } from './message_frames.js' */
/** @import { Events, Requests } from './messages.js' */
/** @import { Picture } from '../../../viewer/drawing/lattice.js' */

/** The page's link to its session. `on` hears messages of a kind, asked for or not, and `connection`
 * with {state: 'open' | 'lost' | 'stale'}; stale: the server runs, but does not know this page; and
 * `silence` with {isSilent} when an answer is late. `send` is answered by the reply, which may be
 * `failed`, and rejects where there is no connection. `fetch` is the newest picture of a name.
 * @typedef {object} Host
 * @property {<K extends keyof Requests>(kind: K, fields?: Requests[K], arrays?: Arrays) =>
 *   Promise<Message>} send
 * @property {<K extends keyof HostEvents>(kind: K, listener: (message: HostEvents[K]) => void) => void} on
 * @property {(name: string) => Promise<Picture>} fetch
 * @property {() => void} close
 * @property {() => Promise<void>} [gate] is waited for before messages that follow strokes */

/** Messages to a page: from the session, and from its host about the connection.
 * @typedef {Events & {connection: {kind: 'connection', state: 'open' | 'lost' | 'stale'},
 *   silence: {kind: 'silence', isSilent: boolean}}} HostEvents */

/** Requests that do not wait for pending strokes. */
export const UNQUEUED = [
  ...['paint', 'drop_stroke', 'change_layers', 'select'],
  ...['hello', 'take_over', 'fetch', 'mix'],
];

/** Listeners by message kind: the part that all hosts share. */
export class Emitter {
  constructor() {
    /** Resolves once finished strokes have been answered; other requests follow them.
     * @type {() => Promise<void>} */
    this.gate = async () => {};
    /** @type {Map<string, ((message: any) => void)[]>} */
    this.listeners = new Map();
  }

  /** @param {string} kind @param {(message: any) => void} listener */
  on(kind, listener) {
    this.listeners.set(kind, [...(this.listeners.get(kind) ?? []), listener]);
  }

  /** An error in one listener does not keep the message from the others. @param {string} kind
   * @param {any} message */
  emit(kind, message) {
    for (const listener of this.listeners.get(kind) ?? [])
      try {
        listener(message);
      } catch (error) {
        console.error(error);
      }
  }
}

/** Milliseconds before a lost connection is retried: the first and the longest delay. */
const RETRY_DELAYS_MS = { first: 250, max: 5000 };

/** @implements {Host} */
export class SocketHost extends Emitter {
  /** The page's origin, and the holder of the server's key.
   * @param {string | URL} [base] @param {{key: () => Promise<string | null>}} [keySource] */
  constructor(base = document.baseURI, keySource = new AccessKey(base)) {
    super();
    this.base = new URL('.', base);
    this.keySource = keySource;
    /** Without the key the server answers nothing. @type {string | null} */
    this.key = null;
    /** Identifies this page to the session after a reconnection. */
    this.page = crypto.randomUUID?.() ?? String(Math.random());
    this.seq = 0;
    /** @type {Map<number, {resolve: (message: Message) => void, reject: (error: Error) => void}>} */
    this.requests = new Map();
    /** @type {Record<string, number>} */
    this.generations = {};
    /** @type {WebSocket | null} */
    this.socket = null;
    this.retryDelay = RETRY_DELAYS_MS.first;
    this.isOver = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    this.timer = undefined;
  }

  /** Connect, now and whenever the connection is lost. */
  async open() {
    try {
      this.key ??= await this.keySource.key();
    } catch {
      return this.retry(); // The server is not running.
    }
    if (this.isOver) return;
    if (this.key === null) this.stopAsStale();
    else this.connect(this.key);
  }

  /** @param {string} key */
  connect(key) {
    const url = new URL(`live?page=${this.page}`, this.base);
    url.protocol = url.protocol === 'https:' ? 'wss:' : 'ws:';
    const socket = new WebSocket(url, [PROTOCOL, `${PROTOCOL}-key.${key}`]);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    let wasOpen = false;
    socket.onopen = () => {
      wasOpen = true;
      this.send('hello', { version: VERSION }).catch(() => {});
    };
    socket.onmessage = ({ data }) => this.receive(decodeFrame(data));
    socket.onclose = () => {
      this.handleDrop(socket);
      // Browsers do not tell a page why a socket was refused.
      if (!wasOpen && !this.isOver) void this.checkRefusal();
    };
  }

  /** @param {WebSocket} socket */
  handleDrop(socket) {
    if (socket !== this.socket) return;
    this.socket = null;
    const error = new Error(t('the connection to the painter is lost'));
    for (const { reject } of this.requests.values()) reject(error);
    this.requests.clear();
    this.retry();
  }

  /** Reconnect after a delay. */
  retry() {
    if (this.isOver) return;
    this.emit('connection', { kind: 'connection', state: 'lost' });
    this.timer = setTimeout(() => void this.open(), this.retryDelay);
    this.retryDelay = Math.min(RETRY_DELAYS_MS.max, 2 * this.retryDelay);
  }

  /** Report that the server does not know this page, and stop asking. */
  stopAsStale() {
    this.close();
    this.emit('connection', { kind: 'connection', state: 'stale' });
  }

  /** Return whether a server runs that does not know this page. Asking it again would take the
   * session from the page at the new address. */
  async checkRefusal() {
    try {
      const options = /** @type {RequestInit} */ ({ method: 'HEAD', cache: 'no-store' });
      const url = new URL('key', this.base);
      const { status } = await fetch(url, { ...options, ...authorization(this.key) });
      if (!REFUSALS.includes(status) || this.socket?.readyState === WebSocket.OPEN) return;
      this.stopAsStale();
    } catch {
      // The server is not running.
    }
  }

  /** @param {Message} message */
  receive(message) {
    const { kind, reply } = message;
    // By which a picture is fetched anew, and not taken from the browser's cache.
    this.generations = { ...this.generations, ...message.resources };
    const isAlive = kind === 'state' || kind === 'waiting';
    if (isAlive) this.retryDelay = RETRY_DELAYS_MS.first;
    if (kind === 'state') this.generations = { ...message.resources };
    // A page of another version, or one that was dismissed, does not reconnect by itself.
    if (kind === 'closed' && message.reason === 'version') this.isOver = true;
    this.emit(kind, message);
    if (isAlive) this.emit('connection', { kind: 'connection', state: 'open' });
    if (reply === undefined) return;
    this.requests.get(reply)?.resolve(message);
    this.requests.delete(reply);
  }

  /** @template {keyof Requests} K @param {K} kind @param {Requests[K]} [fields]
   * @param {Arrays} [arrays] @returns {Promise<Message>} */
  async send(kind, fields, arrays = {}) {
    const isOpen = this.socket?.readyState === WebSocket.OPEN;
    if (isOpen && !UNQUEUED.includes(kind)) await this.gate();
    return new Promise((resolve, reject) => {
      if (this.socket?.readyState !== WebSocket.OPEN)
        return reject(new Error(t('there is no connection to the painter')));
      const seq = ++this.seq;
      this.requests.set(seq, { resolve, reject });
      this.socket.send(encodeFrame({ kind, seq, ...fields }, arrays));
    });
  }

  /** @param {string} name @returns {Promise<Picture>} */
  async fetch(name) {
    const path = name.split('/').map(encodeURIComponent).join('/');
    const url = new URL(`data/${path}`, this.base);
    const generation = this.generations[name];
    if (generation !== undefined) url.searchParams.set('g', String(generation));
    const response = await fetch(url, authorization(this.key));
    if (!response.ok) throw new Error(`${name}: ${await response.text()}`);
    const shape = (response.headers.get('x-shape') ?? '').split(',').map(Number);
    const dtype = response.headers.get('x-dtype') ?? '';
    return pictureOf(dtype, shape, await response.arrayBuffer());
  }

  close() {
    this.isOver = true;
    clearTimeout(this.timer);
    this.socket?.close();
  }
}
