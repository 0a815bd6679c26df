/** The mixers of a gallery, one for each basis, and the looks that they can start from. */
import { begin } from '../../viewer/mixer/mixer.js';
import { createElement } from '../../viewer/mixer/page_elements.js';
import { elementOf, inputOf, looks, titleOf, transforms } from './gallery_data.js';

/** @import { Look, LookLight } from './gallery_data.js' */

/** Distance from Planck's locus up to which a light has a colour temperature. */
const WHITE_DUV = 0.02;

/** @param {LookLight} light */
const isWhite = ({ duv }) => duv !== undefined && Math.abs(duv) <= WHITE_DUV;

export class LookMixers {
  constructor() {
    /** @type {Map<string, HTMLElement>} */
    this.roots = new Map();
    for (const root of document.querySelectorAll('.mixer'))
      if (root instanceof HTMLElement) this.roots.set(root.dataset.basis ?? '', root);
    this.looks = looks.filter((look) => this.canMix(look));
    /** Number of requests: a mixer that unpacks slowly does not replace a later one. */
    this.requests = 0;
    for (const look of this.looks) {
      const option = createElement('option', '', titleOf(look));
      option.value = String(looks.indexOf(look));
      elementOf('from').append(option);
    }
  }

  /** @param {Look} look */
  canMix(look) {
    return look.basis !== undefined && this.roots.has(look.basis);
  }

  /** Show the mixer, starting from a look. @param {Look} look */
  begin(look) {
    const root = this.roots.get(look.basis ?? '');
    if (!root) return;
    const request = ++this.requests;
    for (const mixer of this.roots.values()) if (mixer !== root) mixer.hidden = true;
    inputOf('from').value = String(looks.indexOf(look));
    begin(root, startOf(look), () => request === this.requests);
    scrollTo(0, 0);
  }
}

/** @param {Look} look @returns {import("../../viewer/mixer/mixer.js").Look} */
function startOf(look) {
  const [view, stops] = look.view ?? ['srgb', 0];
  const lights = look.lights ?? [];
  const lightsByName = new Map(lights.map((light) => [light.name, light]));
  const transform = { ...(transforms[view] ?? transforms.srgb), stops };
  return {
    start(data) {
      const started = data.lights.map((light) => {
        const found = lightsByName.get(light.name);
        const answer = found ? (found.emission ?? [0, 0, 0]) : light.present;
        const kelvin = (found && isWhite(found) && found.kelvin) || null;
        return { ...light, answer, kelvin: { ...light.kelvin, answer: kelvin } };
      });
      const joint = data.joint.map((one) => withEmissions(one, started));
      const lighting = { ...data.lighting, target: `${look.look}-mix` };
      return { ...data, lights: started, joint, lighting, transform };
    },
  };
}

/** Return joint lights with the emissions of their members.
 * @param {import("../../viewer/mixer/mixer_data.js").Joint} joint
 * @param {import("../../viewer/mixer/mixer_light.js").Light[]} lights */
function withEmissions(joint, lights) {
  const members = (joint.members ?? []).map((k) => lights[k]);
  return {
    ...joint,
    answer: Object.fromEntries(members.map(({ name, answer }) => [name, answer])),
    present: Object.fromEntries(members.map(({ name, present }) => [name, present])),
  };
}
