// Writes small glb files for the self-test.
import { crc32, deflateSync } from 'node:zlib';

const float32 = (...values) => Buffer.from(Float32Array.from(values).buffer);
const uint16 = (...values) => Buffer.from(Uint16Array.from(values).buffer);
const uint32 = (...values) => Buffer.from(Uint32Array.from(values).buffer);

// A PNG picture of rows of [r, g, b] bytes.
export function png(rows) {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(rows[0].length, 0);
  header.writeUInt32BE(rows.length, 4);
  header.set([8, 2], 8);
  const pixels = deflateSync(Buffer.from(rows.flatMap((row) => [0, ...row.flat()])));
  const signature = Buffer.from('89504e470d0a1a0a', 'hex');
  return Buffer.concat([signature, chunk('IHDR', header), chunk('IDAT', pixels), chunk('IEND', Buffer.alloc(0))]);
}

// A glb file of this JSON, with one buffer view for each of the parts { data, target }.
function glb(json, parts) {
  const pad = (data, filling) => Buffer.concat([data, Buffer.alloc(-data.length & 3, filling)]);
  const binary = Buffer.concat(parts.map(({ data }) => pad(data, 0)));
  let byteOffset = 0;
  const bufferViews = parts.map(({ data, target }) => {
    const view = { buffer: 0, byteOffset, byteLength: data.length, target };
    byteOffset += pad(data, 0).length;
    return view;
  });
  const text = pad(Buffer.from(JSON.stringify({ ...json, bufferViews, buffers: [{ byteLength: binary.length }] })), ' ');
  const header = uint32(0x46546c67, 2, 28 + text.length + binary.length);
  return Buffer.concat([header, uint32(text.length, 0x4e4f534a), text, uint32(binary.length, 0x004e4942), binary]);
}

// Attributes of the four corners (0, 0), (1, 0), (1, 1), (0, 1).
export const texcoords = (...values) => ({
  data: float32(...values),
  accessor: { componentType: 5126, type: 'VEC2' },
});
export const colours = (...values) => ({
  data: uint16(...values.map((value) => Math.round(65535 * value))),
  accessor: { componentType: 5123, normalized: true, type: 'VEC4' },
});

// A glb file of the square from (0, 0, 0) to (1, 1, 0) that faces +z, with these
// further attributes, the material, a picture (texture 0) and more of the JSON.
export function square({ attributes, material, picture, change = () => {}, ...more }) {
  const extra = Object.values(attributes);
  const parts = [
    { data: float32(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0), target: 34962 },
    { data: float32(0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1), target: 34962 },
    { data: uint16(0, 1, 2, 0, 2, 3), target: 34963 },
    ...extra.map(({ data }) => ({ data, target: 34962 })),
    ...(picture ? [{ data: picture }] : []),
  ];
  const names = Object.keys(attributes).map((name, i) => [name, 3 + i]);
  const json = {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, ...Object.fromEntries(names) }, indices: 2, material: 0 }] }],
    materials: [material],
    accessors: [
      { bufferView: 0, componentType: 5126, count: 4, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] },
      { bufferView: 1, componentType: 5126, count: 4, type: 'VEC3' },
      { bufferView: 2, componentType: 5123, count: 6, type: 'SCALAR' },
      ...extra.map(({ accessor }, i) => ({ bufferView: 3 + i, count: 4, ...accessor })),
    ],
    ...(picture && { images: [{ bufferView: parts.length - 1, mimeType: 'image/png' }], textures: [{ source: 0 }] }),
    ...more,
  };
  change(json);
  return glb(json, parts);
}
