// Shows that the check passes right files and fails wrong ones.
// Usage: node selftest.mjs
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { colours, png, square, texcoords } from './square.mjs';

const rows = [0, 1, 2, 3].map((row) => [0, 1, 2, 3].map((column) => [60 * column + 20, 60 * row + 20, 250 - 50 * row]));
const picture = png(rows);
const upright = texcoords(0, 1, 1, 1, 1, 0, 0, 0);
const UNLIT = { extensions: { KHR_materials_unlit: {} } };

// The sRGB curve of glTF pictures.
function linear(byte) {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

// A point at the middle of each texel; `place` puts it in the world.
const texels = (radiance, place, normal) => rows.flatMap((line, row) => line.map((texel, column) => ({
  position: place((column + 0.5) / 4, 1 - (row + 0.5) / 4),
  normal,
  radiance: texel.map(radiance),
})));

// An unlit picture on two squares: one is turned, moved and enlarged; the other shows its culled back just before it.
function unlit() {
  const turn = [0, Math.SQRT1_2, 0, Math.SQRT1_2];
  const back = [0, -Math.SQRT1_2, 0, Math.SQRT1_2];
  const model = {
    attributes: { TEXCOORD_0: upright },
    picture,
    material: { pbrMetallicRoughness: { baseColorTexture: { index: 0 } }, ...UNLIT },
    scenes: [{ nodes: [0, 1, 2] }],
    nodes: [
      { mesh: 0, rotation: turn, translation: [5, -3, 20], scale: [2, 3, 1] },
      { mesh: 0, rotation: back, translation: [5.0001, -3, 16], scale: [9, 9, 9] },
      { camera: 0 },
    ],
    cameras: [{ type: 'perspective', perspective: { yfov: 1, znear: 0.1 } }],
    extensionsUsed: ['KHR_materials_unlit'],
  };
  // The picture holds the radiance times 1/4.
  const points = texels((byte) => 4 * linear(byte), (x, y) => [5, 3 * y - 3, 20 - 2 * x], [1, 0, 0]);
  // Between two texels: the mean of the linear values.
  const between = [0, 1, 2].map((c) => (points[5].radiance[c] + points[6].radiance[c]) / 2);
  points.push({ position: [5, 3 * 0.625 - 3, 19], normal: [1, 0, 0], radiance: between });
  return { model, sample: { mode: 'unlit', scale: 0.25, points } };
}

// Vertex colours; a second square stands 1 mm before the first, so the camera must be nearer.
function vertex() {
  const corners = [[0.1, 0.2, 0.9], [0.8, 0.3, 0.01], [0.5, 0.6, 0.4], [0, 1, 0.2]];
  const model = {
    attributes: { COLOR_0: colours(...corners.flatMap((corner) => [...corner, 1])) },
    material: UNLIT,
    scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { mesh: 0, translation: [0.3, 0, 0.001] }],
    extensionsUsed: ['KHR_materials_unlit'],
  };
  const point = (weights) => ({
    position: [weights[1] + weights[2], weights[2] + weights[3], 0],
    normal: [0, 0, 1],
    radiance: [0, 1, 2].map((c) => 2 * weights.reduce((sum, weight, i) => sum + weight * corners[i][c], 0)),
  });
  const points = [[0.98, 0.01, 0.01, 0], [0.2, 0.5, 0.3, 0], [0.3, 0, 0.1, 0.6], [0.5, 0, 0.5, 0]].map(point);
  return { model, sample: { mode: 'vertex', scale: 0.5, near: 0.0005, points } };
}

// A light map; the lamp is in it already. Without its specular part the material is a Lambert one.
function lightmap() {
  const albedo = [0.7, 0.5, 0.2];
  const model = {
    attributes: { TEXCOORD_0: texcoords(0, 0, 0, 0, 0, 0, 0, 0), TEXCOORD_1: upright },
    picture,
    material: {
      pbrMetallicRoughness: { baseColorFactor: [...albedo, 1], metallicFactor: 0 },
      extensions: {
        KHR_materials_specular: { specularFactor: 0 },
        MOZ_lightmap: { index: 0, texCoord: 1, intensity: 20 },
      },
    },
    scenes: [{ nodes: [0, 1] }],
    nodes: [{ mesh: 0 }, { translation: [0.5, 0.5, 1], extensions: { KHR_lights_punctual: { light: 0 } } }],
    extensions: { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 50 }] } },
    extensionsUsed: ['KHR_lights_punctual', 'KHR_materials_specular', 'MOZ_lightmap'],
  };
  const radiance = (byte, c) => albedo[c] / Math.PI * 20 * byte / 255;
  return { model, sample: { mode: 'lightmap', scale: 1, points: texels(radiance, (x, y) => [x, y, 0], [0, 0, 1]) } };
}

// Wrong files: a right one, changed, and the complaint that must come.
const wrong = {
  'light off by 5 %': [/BAD .*1 beyond 2 %\n  point 2 at .* shows .*, not /, unlit, ({ sample }) => {
    sample.points[2].radiance = sample.points[2].radiance.map((value) => 1.05 * value);
  }],
  'point beside the model': [/point 0 at .* shows nothing/, vertex, ({ sample }) => { sample.points[0].position = [1.5, 0.5, 0]; }],
  'square before the points': [/ [1-3] beyond 2 %/, vertex, ({ sample }) => { delete sample.near; }],
  'back of the model': [/point 0 at .* shows nothing/, vertex, ({ sample }) => { sample.points[0].normal = [0, 0, -1]; }],
  'other mode': [/no material is one of mode "lightmap"/, vertex, ({ sample }) => { sample.mode = 'lightmap'; }],
  'no points': [/no point was looked at/, vertex, ({ sample }) => { sample.points = []; }],
  'invalid accessor': [/validator: error ACCESSOR_MAX_MISMATCH/, vertex, ({ model }) => {
    model.change = (json) => { json.accessors[0].max = [1, 2, 0]; };
  }],
  'gap in the texture coordinates': [/validator: \w+ MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY/, lightmap, ({ model }) => {
    delete model.attributes.TEXCOORD_0;
  }],
  'required extension': [/page: warning: THREE.GLTFLoader: Unknown extension "EXT_none"/, vertex, ({ model }) => {
    model.extensionsUsed.push('EXT_none');
    model.extensionsRequired = ['EXT_none'];
  }],
  'intensity off by 5 %': [/ [1-9]\d* beyond 2 %/, lightmap, ({ model }) => { model.material.extensions.MOZ_lightmap.intensity = 19; }],
};

async function write(folder, name, { model, sample }) {
  await writeFile(join(folder, `${name}.glb`), square(model));
  await writeFile(join(folder, `${name}.points.json`), JSON.stringify(sample));
}

// Runs the check on a folder that `fill` fills.
async function run(fill) {
  const folder = await mkdtemp(join(tmpdir(), 'readers-'));
  try {
    await fill(folder);
    const { status, stdout, stderr } = spawnSync(process.execPath, [join(import.meta.dirname, 'check.mjs'), folder], { encoding: 'utf8' });
    console.log(stdout + stderr);
    return { status, stdout };
  } finally {
    await rm(folder, { recursive: true });
  }
}

const passed = await run(async (folder) => {
  for (const make of [unlit, vertex, lightmap]) await write(folder, make.name, make());
});
assert.equal(passed.status, 0);
assert.match(passed.stdout, /3 files, 0 bad/);

const failed = await run(async (folder) => {
  for (const [name, [, make, spoil]] of Object.entries(wrong)) {
    const right = make();
    spoil(right);
    await write(folder, name, right);
  }
});
assert.equal(failed.status, 1);
for (const [name, [complaint]] of Object.entries(wrong)) {
  const result = failed.stdout.split(/^(?=good|BAD )/m).find((part) => part.includes(` ${name} (`));
  assert.match(result, complaint);
  assert.match(result, /^BAD /);
}
console.log('The check passes right files and fails wrong ones.');
