// Shows that the check passes right files and fails wrong ones.
// Usage: node selftest.mjs
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { crc32, deflateSync } from 'node:zlib';

const linear = (byte) => {
  const value = byte / 255;
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
};

const float32 = (values) => Buffer.from(Float32Array.from(values).buffer);
const uint16 = (values) => Buffer.from(Uint16Array.from(values).buffer);

// A PNG picture of rows of [r, g, b] bytes.
function png(rows) {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const part = Buffer.alloc(body.length + 8);
    part.writeUInt32BE(data.length);
    body.copy(part, 4);
    part.writeUInt32BE(crc32(body), body.length + 4);
    return part;
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(rows[0].length, 0);
  header.writeUInt32BE(rows.length, 4);
  header.set([8, 2], 8);
  const pixels = deflateSync(Buffer.from(rows.flatMap((row) => [0, ...row.flat()])));
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([signature, chunk('IHDR', header), chunk('IDAT', pixels), chunk('IEND', Buffer.alloc(0))]);
}

// A GLB file: each binary part becomes one buffer view.
function glb(json, parts) {
  const views = [];
  let length = 0;
  const padded = parts.map(({ data, target }) => {
    views.push({ buffer: 0, byteOffset: length, byteLength: data.length, target });
    const whole = Buffer.alloc(Math.ceil(data.length / 4) * 4);
    data.copy(whole);
    length += whole.length;
    return whole;
  });
  const whole = { asset: { version: '2.0' }, scene: 0, ...json, bufferViews: views, buffers: [{ byteLength: length }] };
  const text = Buffer.from(JSON.stringify(whole));
  const chunks = [[0x4e4f534a, Buffer.concat([text, Buffer.alloc(-text.length & 3, ' ')])], [0x004e4942, Buffer.concat(padded)]];
  const body = chunks.flatMap(([type, data]) => [Buffer.from(Uint32Array.of(data.length, type).buffer), data]);
  const total = 12 + body.reduce((sum, part) => sum + part.length, 0);
  return Buffer.concat([Buffer.from(Uint32Array.of(0x46546c67, 2, total).buffer), ...body]);
}

// The square from (0, 0, 0) to (1, 1, 0) that faces +z, its picture upright; a node moves it.
const NORMALS = { data: float32([0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1]), target: 34962 };
const POSITIONS = { data: float32([0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]), target: 34962 };
const TEXCOORDS = { data: float32([0, 1, 1, 1, 1, 0, 0, 0]), target: 34962 };
const ELEMENTS = { data: uint16([0, 1, 2, 0, 2, 3]), target: 34963 };

function square(attribute, part, accessor, image, material, more = {}) {
  const parts = [POSITIONS, NORMALS, ELEMENTS, part];
  if (image) parts.push({ data: image });
  return {
    parts,
    json: {
      scenes: [{ nodes: [0] }],
      nodes: [{ mesh: 0 }],
      meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, [attribute]: 3 }, indices: 2, material: 0 }] }],
      accessors: [
        { bufferView: 0, componentType: 5126, count: 4, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] },
        { bufferView: 1, componentType: 5126, count: 4, type: 'VEC3' },
        { bufferView: 2, componentType: 5123, count: 6, type: 'SCALAR' },
        { bufferView: 3, count: 4, ...accessor },
      ],
      materials: [material],
      ...(image && { images: [{ bufferView: 4, mimeType: 'image/png' }], textures: [{ source: 0 }] }),
      ...more,
    },
  };
}
