/** The interface over a session and an engine that are made up: `?lights=N`, `?shadow`, `?first`,
 * `?elsewhere`; `?image=4x3`: the last of the lights are texels of an image, `sky`, with `?finer=1,1` that one split again; `?crowd`: as much of everything as there may be, and as long;
 * `?tour`: as for people, whom the tour greets at their first visit;
 * `?model`: that of a notebook, `?model=taken`: at a place that loses the painter at once. */

import { mount } from '../app.js';
import { ModelHost } from '../engine/notebook_host.js';
import { openEngine } from '../engine/picture_engine.js';
import { crowd } from './crowd.js';
import { FakeEngine } from './engine.js';
import { FakeHost } from './host.js';
import { FakeModel } from './model.js';
import { split } from './image.js';
import { makeRoom } from './room.js';

/** @type {(() => void) | null} */
let close = null;

/** End the painter that is open. */
function end() {
  close?.();
  close = null;
}

/** Open a painter as a query asks, in place of the one before.
 *
 * Tests do so in a page that is there already, whose modules are compiled: a page that loads anew
 * takes several times as long. */
async function open(query = location.search) {
  end();
  const asked = new URLSearchParams(query);
  history.replaceState(null, '', `?${asked}`);
  const room = makeRoom(Number(asked.get('lights') ?? 7), asked.get('size') ?? '192x108');
  const host = new FakeHost(room, {
    isFirst: asked.has('first'),
    isElsewhere: asked.has('elsewhere'),
  });
  if (asked.has('crowd')) crowd(host);
  if (asked.has('image')) split(host, asked.get('image') ?? '', asked.get('finer'));
  let element = /** @type {HTMLElement} */ (document.getElementById('lightpaint'));
  if (asked.has('shadow')) {
    const shadow = element.attachShadow({ mode: 'open' });
    for (const link of document.querySelectorAll('link[rel=stylesheet]')) {
      shadow.append(link.cloneNode());
      if (/style/.test(link.href)) link.remove();
    }
    element = document.createElement('div');
    element.style.height = '100%';
    shadow.append(element);
  }
  const model = new FakeModel(host);
  model.isTaken = asked.get('model') === 'taken';
  const session = asked.has('model') ? new ModelHost(model) : host;
  // `?engine`: the one that ships, over the same session.
  const engine = asked.has('engine')
    ? openEngine(session)
    : new FakeEngine(session, room);
  const painter = await mount(element, session, {
    global: !asked.has('shadow'),
    engine,
    isGuided: asked.has('tour'),
  });
  close = painter.close;
  Object.assign(window, { painter, host, engine, model });
  session.open();
}

// A page with a shadow root keeps it: no other painter can follow.
if (!new URLSearchParams(location.search).has('shadow')) {
  Object.assign(window, { openPainter: open, closePainter: end });
}
// No module waits at its top: a bundle calls each as a function.
open();
