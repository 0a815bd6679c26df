/** The painter as a page of its own: its session is behind the server that the page came from. */

import { mount } from './app.js'
import { openHost } from './ui/engine.js'

const element = document.getElementById('lightpaint')
if (element) {
  mount(element, await openHost(), { global: true })
}
