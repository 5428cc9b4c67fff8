// How surfaces look: L = L_e + ρ H / π, exposed and mapped as the program does it
// (`src/tone.rs`), or illuminance in colours (`src/tone/false_colour.rs`).

const VIRIDIS = [
  [68, 1, 84], [72, 24, 106], [71, 45, 123], [66, 64, 134], [59, 82, 139], [51, 99, 141], [44, 114, 142], [38, 130, 142],
  [33, 145, 140], [31, 160, 136], [40, 174, 128], [63, 188, 115], [94, 201, 98], [132, 212, 75], [173, 220, 48], [216, 226, 25],
  [253, 231, 37],
];

// The map as a background of CSS, from left to right.
export const LEGEND = `linear-gradient(to right, ${VIRIDIS.map((c) => `rgb(${c.join(' ')})`).join(', ')})`;

// Measure: irradiance, and the number of the triangle, from 1 on. Heat: a value for each patch.
export enum Mode { Picture, FalseColour, Measure, Heat }

// Octaves below the largest value that have colours.
export const HEAT_OCTAVES = 12;

const TONE = `
vec3 agx(vec3 c) {
  const mat3 inset = mat3(
    0.842479062253094, 0.0423282422510126, 0.0423756549057051,
    0.0784335999999992, 0.878468636469772, 0.0784336,
    0.0792237451477643, 0.0791661274605036, 0.879142973793104);
  const mat3 outset = mat3(
    1.19687900512017, -0.0528968517574562, -0.0529716355144438,
    -0.0980208811401368, 1.15190312990417, -0.0980434501171241,
    -0.0990297440797205, -0.0989611768448433, 1.15107367264116);
  vec3 x = clamp((log2(max(inset * c, 1e-10)) + 12.47393) / (4.026069 + 12.47393), 0.0, 1.0);
  vec3 x2 = x * x;
  vec3 x4 = x2 * x2;
  vec3 v = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
  return pow(max(outset * v, 0.0), vec3(2.2));
}

const vec3 LUMINANCE = vec3(0.2126, 0.7152, 0.0722);

vec3 toned(vec3 c) {
  if (tone == 1) {
    float l = dot(c, LUMINANCE);
    c = c * ((1.0 + l / 64.0) / (1.0 + l));
  } else if (tone == 0) {
    c = agx(c);
  }
  return clamp(c, 0.0, 1.0);
}

vec3 srgb(vec3 c) {
  return mix(1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}
`;

export const VERTEX = `
uniform mat4 projectionMatrix;
uniform mat4 modelViewMatrix;
in vec3 position;
in vec2 atlas;
#ifdef TEXTURED
in vec2 uv;
out vec2 place;
#endif
#ifdef TINTED
in vec3 tint;
out vec3 tinted;
#endif
out vec2 texel;
flat out int facet;
void main() {
  texel = vec2(atlas);
  facet = gl_VertexID / 3;
#ifdef TEXTURED
  place = uv;
#endif
#ifdef TINTED
  tinted = tint;
#endif
  gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
}
`;

export const FRAGMENT = `
precision highp float;
precision highp sampler2D;
precision highp sampler2DArray;
uniform sampler2D light;
uniform sampler2DArray layers;
uniform int apart;
uniform vec3 strength;
uniform float unit;
uniform float most;
uniform vec3 reflectance;
uniform vec3 emission;
uniform int mode;
uniform int tone;
uniform float exposure;
uniform float range;
#ifdef TEXTURED
uniform sampler2D reflectanceMap;
uniform sampler2D emissionMap;
in vec2 place;
#endif
#ifdef TINTED
in vec3 tinted;
#endif
in vec2 texel;
flat in int facet;
#ifdef MAPPED
uniform highp usampler2D patches;
uniform sampler2D values;
#endif
out vec4 shown;
${TONE}
const vec3 VIRIDIS[${VIRIDIS.length}] = vec3[](
  ${VIRIDIS.map((c) => `vec3(${c.map((v) => (v / 255).toFixed(5)).join(', ')})`).join(',\n  ')}
);
void main() {
  vec3 irradiance = texture(light, texel).rgb;
  if (apart >= 0) irradiance += strength * texture(layers, vec3(texel, float(apart))).rgb;
  irradiance *= unit;
  if (mode == ${Mode.Measure}) {
    shown = vec4(irradiance, float(facet + 1));
    return;
  }
#ifdef MAPPED
  if (mode == ${Mode.Heat}) {
    int patchNumber = int(texelFetch(patches, ivec2(texel * vec2(textureSize(patches, 0))), 0).r) - 1;
    float value = patchNumber < 0 ? 0.0 : texelFetch(values, ivec2(patchNumber % 1024, patchNumber / 1024), 0).r;
    float t = clamp(1.0 + log2(max(value, 1e-9)) / ${HEAT_OCTAVES.toFixed(1)}, 0.0, 1.0) * ${(VIRIDIS.length - 1).toFixed(1)};
    int k = min(int(t), ${VIRIDIS.length - 2});
    shown = vec4(value > 0.0 ? mix(VIRIDIS[k], VIRIDIS[k + 1], t - float(k)) : value < 0.0 ? vec3(1.0, 0.35, 0.2) : vec3(0.08), 1.0);
    return;
  }
#endif
  bool glows = emission != vec3(0.0);
  if (mode == ${Mode.FalseColour}) {
    float t = clamp(dot(irradiance, LUMINANCE) / range, 0.0, 1.0) * ${(VIRIDIS.length - 1).toFixed(1)};
    int k = min(int(t), ${VIRIDIS.length - 2});
    shown = vec4(glows ? vec3(0.19) : mix(VIRIDIS[k], VIRIDIS[k + 1], t - float(k)), 1.0);
    return;
  }
  vec3 rho = reflectance;
  vec3 emitted = emission;
#ifdef TEXTURED
  rho *= texture(reflectanceMap, place).rgb;
  emitted *= texture(emissionMap, place).rgb;
#endif
#ifdef TINTED
  rho *= tinted;
#endif
  vec3 radiance = emitted + min(rho, most) * irradiance / 3.14159265;
  shown = vec4(srgb(toned(radiance * exposure)), 1.0);
}
`;

// The surroundings, behind everything.
export const SKY_VERTEX = `
in vec3 position;
uniform vec3 emission;
uniform int mode;
uniform int tone;
uniform float exposure;
flat out vec4 colour;
${TONE}
void main() {
  if (mode == ${Mode.Measure}) colour = vec4(0.0);
  else if (mode != ${Mode.Picture}) colour = vec4(vec3(0.08), 1.0);
  else colour = vec4(srgb(toned(emission * exposure)), 1.0);
  gl_Position = vec4(position.xy, 1.0, 1.0);
}
`;

export const SKY_FRAGMENT = `
precision highp float;
flat in vec4 colour;
out vec4 shown;
void main() { shown = colour; }
`;
