/** The painter as a page of its own: its session is behind the server that the page came from. */

import { mount } from './app.js';
import { openEngine, openHost } from './engine/picture_engine.js';

const element = document.getElementById('lightpaint');
if (element) {
  const host = openHost();
  const engine = openEngine(host);
  // For measurements, and for the console.
  Object.assign(element, { painter: { host, engine } });
  void mount(element, host, { global: true, engine, isGuided: !navigator.webdriver });
}
