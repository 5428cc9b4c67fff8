// Light of each source over the atlas, and their sum, which the graphics card makes.
import {
  AdditiveBlending, ClampToEdgeWrapping, DataArrayTexture, DataUtils, GLSL3, HalfFloatType, LinearFilter, Mesh, NoBlending, OrthographicCamera,
  PlaneGeometry, RawShaderMaterial, RGBAFormat, Scene, Vector3, WebGLRenderTarget, type IUniform, type WebGLRenderer,
} from 'three';
import type { Archive } from './archive';
import type { Manifest, Triple } from './page';

const ONE = 0x3c00;

// Undoes what `export/html/layers.rs` does: differences to the left, red and blue less green, and
// logarithms. Values are shares of the layer's peak.
function decodeLayer(low: Uint8Array, high: Uint8Array, halves: Uint16Array, width: number, into: Uint16Array): void {
  const texels = into.length / 4;
  for (let c = 0; c < 3; c += 1) {
    // Green comes first, as the others are told by it.
    const channel = [1, 0, 2][c];
    const plane = c * texels;
    for (let row = 0; row < texels; row += width) {
      let value = row > 0 ? into[4 * (row - width) + channel] : 0;
      for (let i = row; i < row + width; i += 1) {
        const zigzag = low[plane + i] | (high[plane + i] << 8);
        value = (value + ((zigzag >> 1) ^ -(zigzag & 1))) & 0xffff;
        into[4 * i + channel] = value;
      }
    }
  }
  for (let i = 0; i < into.length; i += 4) {
    const green = into[i + 1];
    into[i] = halves[(into[i] + green) & 0xffff];
    into[i + 2] = halves[(into[i + 2] + green) & 0xffff];
    into[i + 1] = halves[green];
    into[i + 3] = ONE;
  }
}

// The half floats that codes stand for: 0, and then powers of two up to 1.
function halvesOf(steps: number, octaves: number): Uint16Array {
  const halves = new Uint16Array(65536);
  for (let code = 1; code < halves.length; code += 1) {
    halves[code] = DataUtils.toHalfFloat(Math.min(2 ** ((code - 1) / steps - octaves), 1) * SCALE);
  }
  return halves;
}

// Layers are kept this many times larger, as half floats lose digits below 6e-5.
const SCALE = 16384;

const VERTEX = `
in vec3 position;
void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }
`;

// No layer.
const NONE = -1;

// Layers that are added at a time: every graphics card takes so many uniforms.
const AT_ONCE = 16;

const FRAGMENT = `
precision highp float;
precision highp sampler2D;
precision highp sampler2DArray;
uniform sampler2DArray layers;
uniform int count;
uniform int numbers[${AT_ONCE}];
uniform vec3 weights[${AT_ONCE}];
out vec4 sum;
void main() {
  ivec2 texel = ivec2(gl_FragCoord.xy);
  vec3 light = vec3(0.0);
  for (int i = 0; i < count; i++) light += weights[i] * texelFetch(layers, ivec3(texel, numbers[i]), 0).rgb;
  sum = vec4(min(light, vec3(65000.0)), 1.0);
}
`;

export class Layers {
  // What surfaces look their irradiance up in, in units of `unit`: the sum over the atlas, and the
  // layer that is not in it, times its strength.
  readonly shown: Record<'light' | 'layers' | 'apart' | 'strength', IUniform>;
  private sum: WebGLRenderTarget;
  private pass = new Scene();
  private camera = new OrthographicCamera();
  private uniforms: Record<string, IUniform>;
  private material: RawShaderMaterial;
  private last: Vector3[] = [];

  // `unit` is an irradiance (W/m² or lx) of the order of what is shown.
  private constructor(private manifest: Manifest, data: Uint16Array<ArrayBuffer>, readonly unit: number) {
    const { width, height } = manifest.atlas;
    const count = manifest.sources.length;
    const layers = new DataArrayTexture(data, width, height, count);
    layers.type = HalfFloatType;
    layers.format = RGBAFormat;
    layers.minFilter = LinearFilter;
    layers.magFilter = LinearFilter;
    layers.needsUpdate = true;
    this.sum = this.target();
    this.shown = {
      light: { value: this.sum.texture }, layers: { value: layers }, apart: { value: NONE }, strength: { value: new Vector3() },
    };
    this.uniforms = {
      layers: { value: layers }, count: { value: 0 },
      numbers: { value: new Int32Array(AT_ONCE) }, weights: { value: Array.from({ length: AT_ONCE }, () => new Vector3()) },
    };
    this.material = new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, depthTest: false, depthWrite: false,
      uniforms: this.uniforms,
    });
    const plane = new Mesh(new PlaneGeometry(2, 2), this.material);
    plane.frustumCulled = false;
    this.pass.add(plane);
  }

  static async read(archive: Archive, manifest: Manifest, unit: number): Promise<Layers> {
    const { width, height, steps, octaves } = manifest.atlas;
    const halves = halvesOf(steps, octaves);
    const length = 4 * width * height;
    const data = new Uint16Array(length * manifest.sources.length);
    for (let k = 0; k < manifest.sources.length; k += 1) {
      const [low, high] = await Promise.all(['low', 'high'].map((part) => archive.array<Uint8Array>(`light/${k}_${part}`)));
      decodeLayer(low, high, halves, width, data.subarray(k * length, (k + 1) * length));
    }
    return new Layers(manifest, data, unit);
  }

  dispose(): void {
    (this.uniforms.layers.value as DataArrayTexture).dispose();
    this.sum.dispose();
  }

  // Shows sources as strong as they now are. One that alone changes is added where it is looked at,
  // and the sum of all others, which takes as long as the atlas is large, stays.
  mix(renderer: WebGLRenderer, weights: Triple[]): void {
    const now = this.manifest.sources.map(({ peak }, k) => new Vector3(...weights[k]).multiplyScalar(peak / SCALE / this.unit));
    const changed = now.flatMap((weight, k) => (this.last[k]?.equals(weight) ? [] : [k]));
    if (changed.length === 0) return;
    this.last = now;
    const apart = changed.length === 1 ? changed[0] : NONE;
    const { apart: before, strength } = this.shown;
    if (apart === NONE || apart !== before.value) this.add(renderer, now, now.flatMap((_, k) => (k === apart ? [] : [k])));
    before.value = apart;
    (strength.value as Vector3).copy(now[apart] ?? new Vector3());
  }

  // The graphics card has lost the sum.
  forget(): void {
    this.last = [];
    this.shown.apart.value = NONE;
  }

  private add(renderer: WebGLRenderer, weights: Vector3[], which: number[]): void {
    const { uniforms, material } = this;
    const lit = which.filter((k) => weights[k].lengthSq() > 0);
    renderer.setRenderTarget(this.sum);
    const { autoClear } = renderer;
    renderer.autoClear = false;
    // The first lot takes the place of what was there, the others are added.
    for (let first = 0; first === 0 || first < lit.length; first += AT_ONCE) {
      const lot = lit.slice(first, first + AT_ONCE);
      uniforms.count.value = lot.length;
      lot.forEach((k, i) => {
        (uniforms.numbers.value as Int32Array)[i] = k;
        (uniforms.weights.value as Vector3[])[i].copy(weights[k]);
      });
      material.blending = first === 0 ? NoBlending : AdditiveBlending;
      renderer.render(this.pass, this.camera);
    }
    renderer.autoClear = autoClear;
    renderer.setRenderTarget(null);
  }

  private target(): WebGLRenderTarget {
    const { width, height } = this.manifest.atlas;
    return new WebGLRenderTarget(width, height, {
      type: HalfFloatType, minFilter: LinearFilter, magFilter: LinearFilter,
      wrapS: ClampToEdgeWrapping, wrapT: ClampToEdgeWrapping, depthBuffer: false,
    });
  }
}
