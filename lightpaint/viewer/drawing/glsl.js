/** Shaders of gl.js. They take their constants from overlay.js, so that each is defined once. */
import { MAX_HALF } from './half_floats.js';
import { BANDS, OPAQUE_DIFFERENCE, GREY, HATCH, INKS, LUMA } from './overlay.js';
import { GROUND } from './view.js';

const HEAD = `#version 300 es
precision highp float;
precision highp sampler2DArray;
precision highp sampler3D;
`;

/** One triangle over the whole viewport. */
export const VERTEX = `${HEAD}
void main() {
  vec2 corner = vec2(gl_VertexID == 1, gl_VertexID == 2);
  gl_Position = vec4(corner * 4.0 - 1.0, 0.0, 1.0);
}`;

/** Σ weights[k] · plane[k] of the planes in one texture, added to the target. */
export const MIX = `${HEAD}
uniform sampler2DArray planes;
uniform sampler2D weights;
uniform int first;
uniform int count;
out vec4 mixed;
void main() {
  vec3 sum = vec3(0.0);
  ivec2 at = ivec2(gl_FragCoord.xy);
  for (int k = 0; k < count; k++) {
    vec3 weight = texelFetch(weights, ivec2(first + k, 0), 0).rgb;
    if (weight != vec3(0.0)) sum += weight * texelFetch(planes, ivec3(at, k), 0).rgb;
  }
  mixed = vec4(clamp(sum, -${MAX_HALF}.0, ${MAX_HALF}.0), 1.0);
}`;

/** One pixel of each plane of a texture, side by side. */
export const PROBE = `${HEAD}
uniform sampler2DArray planes;
uniform ivec2 at;
out vec4 light;
void main() {
  light = texelFetch(planes, ivec3(at, int(gl_FragCoord.x)), 0);
}`;

/** @param {number[]} codes */
const vec3 = (codes) => `vec3(${codes.map((code) => (code / 255).toFixed(6)).join(', ')})`;

/** A pane: light through the view transform, with its overlay. */
export const SHOW = `${HEAD}
uniform sampler2D picture;
uniform sampler2D painting;
uniform sampler2D beyond;
uniform sampler3D lattice;
uniform vec2 size;
uniform vec2 corner;
uniform float scale;
uniform float above;
uniform float gain;
uniform float side;
uniform vec2 shaper;
uniform bool isSrgb;
uniform bool isSharp;
uniform bool isSmall;
uniform int overlay;
uniform float full;
out vec4 shown;

const vec3 LUMA = vec3(${LUMA.join(', ')});
const vec3 BANDS[${BANDS.length}] = vec3[](
  ${BANDS.map(vec3).join(',\n  ')}
);

vec3 encode(vec3 light) {
  vec3 x = light * gain;
  if (isSrgb) {
    x = clamp(x, 0.0, 1.0);
    vec3 curve = 1.055 * pow(max(x, 1e-6), vec3(1.0 / 2.4)) - 0.055;
    return mix(curve, 12.92 * x, vec3(lessThanEqual(x, vec3(0.0031308))));
  }
  vec3 along = (log2(max(x, 1e-37)) - shaper.x) / (shaper.y - shaper.x);
  // Axes are r, g, b from the slowest to the fastest.
  return texture(lattice, (clamp(along, 0.0, 1.0).bgr * (side - 1.0) + 0.5) / side).rgb;
}

float hatch(ivec2 at, int slope) {
  int along = (at.x + slope * at.y) % ${HATCH.period};
  along = along < 0 ? along + ${HATCH.period} : along;
  return along < ${HATCH.thin} ? ${HATCH.strength} : 1.0;
}

vec3 lay(vec3 display, vec3 ink, float amount) {
  return mix(vec3(dot(LUMA, display) * 0.6), ink, amount);
}

vec3 missed(vec3 display, ivec2 at) {
  vec4 painted = texelFetch(painting, at, 0);
  vec3 off = display - encode(painted.rgb);
  float most = max(max(abs(off.r), abs(off.g)), abs(off.b)) * 255.0;
  float amount = painted.a > 0.0 ? min(1.0, most / ${OPAQUE_DIFFERENCE}.0) : 0.0;
  bool isDark = dot(LUMA, off) < 0.0;
  vec3 ink = isDark ? ${vec3(INKS.dark)} : ${vec3(INKS.bright)};
  return lay(display, ink, amount * hatch(at, isDark ? -1 : 1));
}

vec3 lightAt(vec2 where, ivec2 at) {
  if (isSharp) return texelFetch(picture, at, 0).rgb;
  if (!isSmall) return texture(picture, where / size).rgb;
  // A display pixel that covers several picture pixels averages the centres of its four quarters.
  vec2 near = 0.25 / scale / size;
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; k++) {
    vec2 corner = vec2(k % 2, k / 2) * 2.0 - 1.0;
    sum += texture(picture, where / size + corner * near).rgb;
  }
  return sum * 0.25;
}

void main() {
  vec2 place = vec2(gl_FragCoord.x, above - gl_FragCoord.y) - corner;
  vec2 where = place / scale;
  if (any(lessThan(where, vec2(0.0))) || any(greaterThanEqual(where, size))) {
    shown = vec4(${vec3(GROUND)}, 1.0);
    return;
  }
  ivec2 at = min(ivec2(where), ivec2(size) - 1);
  vec3 light = lightAt(where, at);
  vec3 display = encode(light);
  if (overlay == 1) {
    float stops = log2(max(dot(LUMA, light) * gain, 1e-9) / ${GREY});
    display = BANDS[clamp(int(floor(stops + 0.5)) + 6, 0, ${BANDS.length - 1})];
  } else if (overlay == 2) {
    display = missed(display, at);
  } else if (overlay == 3) {
    float amount = min(log(1.0 + max(texelFetch(painting, at, 0).a, 0.0)) / log(1.0 + full), 1.0) * 0.8;
    display = lay(display, ${vec3(INKS.importance)}, amount * hatch(at, 1));
  } else if (overlay == 4) {
    float amount = texelFetch(beyond, at, 0).r * 0.8;
    display = lay(display, ${vec3(INKS.beyond)}, amount * hatch(at, 1));
  }
  shown = vec4(display, 1.0);
}`;
