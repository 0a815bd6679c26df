/** A notebook's model, with a session that is made up at the other end of its comm. */

import { pictureOf } from '../engine/message_frames.js';

const NAMES = new Map([
  [Uint8Array, 'uint8'],
  [Int16Array, 'int16'],
  [Uint16Array, 'float16'],
  [Float32Array, 'float32'],
  [Float64Array, 'float64'],
]);

export class FakeModel {
  hearers = {};
  /** What the kernel has not come to yet. */
  waiting = [];
  isTaken = false;
  isBusy = false;

  constructor(host) {
    this.host = host;
  }

  on(event, hear) {
    (this.hearers[event] ??= []).push(hear);
  }
  off(event, hear) {
    this.hearers[event] = this.hearers[event].filter((one) => one !== hear);
  }
  trigger(event, ...given) {
    for (const hear of this.hearers[event] ?? []) hear(...given);
  }

  send(content, _, bytes) {
    this.page = Math.floor(content.seq / 2 ** 32);
    this.waiting.push([content, bytes]);
    void this.work();
  }

  /** Answer all that waits, unless the kernel is busy. */
  async work() {
    while (!this.isBusy && this.waiting.length) {
      const [{ kind, seq, buffers, ...fields }, bytes] = this.waiting.shift();
      const arrays = Object.fromEntries(
        buffers.map(({ name, dtype, shape }, k) => [name, pictureOf(dtype, shape, bytes[k])]),
      );
      this.say(await this.answer(kind, fields, arrays), seq);
    }
  }

  async answer(kind, fields, arrays) {
    if (kind === 'take_over') this.isTaken = false;
    if (kind === 'take_over' || kind === 'hello') return this.host.state();
    if (this.isTaken) return { kind: 'closed', reason: 'taken', text: 'It is open elsewhere.' };
    if (kind !== 'fetch') return this.host.send(kind, fields, arrays);
    return { kind: 'fetched', arrays: { data: await this.host.fetch(fields.name) } };
  }

  /** Say something, asked for or not. */
  say({ arrays = {}, ...message }, reply) {
    const pictures = Object.entries(arrays);
    const buffers = pictures.map(([name, { data, shape }]) => ({
      name,
      dtype: NAMES.get(data.constructor),
      shape,
    }));
    const bytes = pictures.map(
      ([, { data }]) => new DataView(data.buffer, data.byteOffset, data.byteLength),
    );
    this.trigger('msg:custom', { ...message, reply, page: this.page, buffers }, bytes);
  }
}
