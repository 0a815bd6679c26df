/** As much of everything as there may be, and as long: 69 lights, 40 looks, the longest sentences. */

const LONG = 'ceiling_track.north_gallery_left_of_the_entrance';
const OBJECT = 'Marble relief of the four seasons, second from the left';
const OTHERS = ['limits', 'color', 'kelvin', 'primaries', 'lock', 'off', 'present'];

/** What is said of an error, in each form that it has. */
const ERRORS = ['± 4 %', '−54 % … +454 %', '0 … +1200 %', '−100 % … 0', 'undetermined', '0 … 0.0093'];
const UNITS = ['W/(m² sr)', 'W/sr', 'W/m²'];

const named = (k) =>
  `${LONG}.${k % 2 ? 'wall_washer' : 'spot_on_the_second_picture'}_${String(k).padStart(2, '0')}`;

export const HEADLINE =
  `About half way (46 %), and changes the annex by ΔE 12. Slightly brighter light on the ` +
  `${OBJECT} is missing: unpainted parts are held near their current look. Paint more or loosen the hold.`;

export const LONGEST =
  `35 % of the way, at the cost of the ${OBJECT} (ΔE 49). Darker and bluer shadow on the ${OBJECT} ` +
  `is missing: ` +
  `${named(12)} and ${named(13)} are limited by their constraints.`;

/** What has a button, of the name of a light. */
export const HELP = { kind: 'limits', names: [named(0)], gain: 0.57, hold: null };

export const SENTENCES = [
  'Of the difference (large errors count most), 41 % would need colours or levels that the ' +
    'lights may not have, 27 % is given up for the other views, 22 % is out of reach of these lights, ' +
    '6 % is finer detail than light can show: grain, edges and texture of the paint, 4 % is render ' +
    'noise, which more samples reduce.',
  'Most of what is out of reach is at the bottom right (38 %): the paint is a little brighter and ' +
    'yellower than any mix of the lights.',
  `Lights ${named(12)}, ${named(13)} are limited in colour (2700 to 6500 K, duv 0.003); any other colour ` +
    'would remove 12 % of the difference.',
  `Light ${named(30)} is switched off, as asked; switching it on would remove 9 % of the difference.`,
];

const VERIFIED =
  'The render does NOT agree with the prediction: they are 7.9 standard errors apart (limit 5). ' +
  'The scene may have changed since the lights were rendered, or a light is in it that the basis lacks.';

export const TOAST =
  `“twelve” may be stops or percent: type the unit, too (12 st, 80 %). ${named(7)} is held at its ` +
  'current level, and its limits stay as they were before this was typed.';

/** What is done by hand, in every manner. @param {number} k @param {number[]} present */
function constraintsOf(k, present) {
  switch (OTHERS[k % 12]) {
    case 'limits':
      return { limits: { min: '12.5%', max: '1234.56%' } };
    case 'color':
      return { color: '#ffb46b' };
    case 'kelvin':
      return { kelvin: [2700, 6500], duv: 0.0035 };
    case 'primaries':
      return { primaries: ['#ff0000', '#00ff00', '#0000ff', '#ffbf00', '2700K', '6500K'] };
    case 'lock':
      return { lock: present.map((x) => x * 2 ** -10.7) };
    case 'off':
      return { off: true };
    case 'present':
      return { lock: true };
  }
  return {};
}

/** Make a session and its room one of many long things. @param {any} host */
export function crowd(host) {
  const { room } = host;
  room.lights.forEach((light, k) => {
    light.name = named(k);
    light.present = light.present.map((x) => x * 10 ** ((k % 7) - 2));
  });
  room.objects = room.objects.map((name, k) => (k === 3 ? OBJECT : `${name}, ${OBJECT} ${k}`));
  host.weights = room.lights.map(({ present }, k) =>
    present.map((x) => x * (k % 9 === 5 ? 0 : 2 ** (((k * 5) % 23) - 10.7))),
  );
  for (let k = 0; k < 40; k += 1)
    host.looks.push({
      id: (host.ids += 1),
      name: k % 3 ? `Warm evening, sculptures only, before the guests come: ${k}` : `Look ${k}`,
      lights: room.lights.map((light) => light.name),
      weights: room.lights.map(({ present }) => present.map((x) => x * (1 + k / 40))),
      places: '',
      delta_e: 12.3,
      stamp: 0,
      thumbnail: `look/${k + 1}`,
    });
  host.constraints = Object.fromEntries(room.lights.map((one, k) => [one.name, constraintsOf(k, one.present)]));
  host.ties = [room.lights.slice(40, 44).map(({ name }) => name)];
  const { state, exact, asks } = host;
  host.exact = () => {
    const made = exact.call(host);
    const lights = made.lights.map((one, k) => ({
      ...one,
      error: ERRORS[k % ERRORS.length],
      is_constrained: k % 12 < 4,
      is_unreached: k % 10 === 9,
    }));
    const seen = { headline: HEADLINE, help: HELP, delta_e: 11.24, delta_e_present: 20.53 };
    return { ...made, ...seen, sentences: SENTENCES.slice(2), lights };
  };
  host.asks = () => {
    const made = asks.call(host);
    const undo = [`brush, ${OBJECT}`, `look “Warm evening, sculptures only, before the guests come”`];
    return { ...made, history: { ...made.history, undo, redo: undo } };
  };
  host.state = () => {
    const made = state.call(host);
    const transforms = [...made.transforms, { name: 'ocio:sRGB - Display/ACES 1.0 - SDR Video' }];
    const lights = made.lights.map((one, k) => ({
      ...one,
      unit: UNITS[k % 3],
      group: k < 24 ? null : `Row ${'ABCDEFG'[Math.floor((k - 24) / 8)]} of ${LONG}`,
    }));
    const folder = `/shows/${'a_folder_of_a_long_name/'.repeat(6)}gallery-evening.paint`;
    const scene = 'museum-of-applied-arts-east-wing-second-floor-2031-rev-17';
    return { ...made, lights, scene, folder, transforms, is_new: false };
  };
  host.explain = () => ({ kind: 'explained', sentences: SENTENCES });
  host.verify = () => ({ kind: 'verified', agrees: false, text: VERIFIED });
  host.export = ({ outputs }) => ({
    kind: 'exported',
    files: outputs.map((one) => `${host.state().folder}/${one}.with_a_long_name_of_its_own`),
    command: `lightpaint solve ${host.state().folder}/painting.exr --hold 4 --lock '${named(3)}=12.5%'`,
    is_unpainted: false,
  });
}
