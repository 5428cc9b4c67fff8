// The model: its surfaces by material, and the outlines of its patches.
import {
  BufferAttribute, BufferGeometry, ClampToEdgeWrapping, DataTexture, FloatType, FrontSide, GLSL3, LineBasicMaterial,
  LineSegments, LinearFilter, LinearMipmapLinearFilter, Mesh, MirroredRepeatWrapping, Plane, PlaneGeometry, RawShaderMaterial, Ray,
  RedFormat, RedIntegerFormat, RepeatWrapping, Scene, SRGBColorSpace, Texture, Triangle, UnsignedIntType, Vector3, type IUniform,
  type PerspectiveCamera,
} from 'three';
import type { Archive } from './archive';
import type { Manifest, Texture as TextureHead, Triple, Wrap } from './page';
import { FRAGMENT, Mode, SKY_FRAGMENT, SKY_VERTEX, VERTEX } from './shaders';

const WRAPS: Record<Wrap, Texture['wrapS']> = {
  repeat: RepeatWrapping, mirror: MirroredRepeatWrapping, clamp: ClampToEdgeWrapping,
};

const TONES = { agx: 0, reinhard: 1, linear: 2 };

export class Surfaces {
  readonly scene = new Scene();
  // What all materials share.
  readonly shared: Record<string, IUniform>;
  private lit: { uniforms: Record<string, IUniform>; source: number | null; emission: Triple }[] = [];
  heats: Float32Array = new Float32Array();
  private geometry = new BufferGeometry();
  private outlines?: LineSegments;
  private outlining?: Promise<void>;
  private outlined = false;

  private constructor(private archive: Archive, private manifest: Manifest, light: Record<string, IUniform>, unit: number) {
    this.shared = {
      ...light, unit: { value: unit }, mode: { value: Mode.Picture }, tone: { value: TONES[manifest.tone] },
      exposure: { value: 2 ** manifest.exposure }, range: { value: manifest.range }, most: { value: manifest.mostReflectance },
      patches: { value: null }, values: { value: null },
    };
  }

  static async read(archive: Archive, manifest: Manifest, light: Record<string, IUniform>, unit: number): Promise<Surfaces> {
    const all = new Surfaces(archive, manifest, light, unit);
    const { geometry } = all;
    const mapped = archive.has('light/patches.npy');
    const tinted = archive.has('mesh/tint.npy');
    geometry.setAttribute('position', new BufferAttribute(await archive.array<Float32Array>('mesh/position'), 3));
    geometry.setAttribute('atlas', new BufferAttribute(await archive.array<Uint16Array>('mesh/atlas'), 2, true));
    if (manifest.textures.length > 0) {
      geometry.setAttribute('uv', new BufferAttribute(await archive.array<Float32Array>('mesh/uv'), 2));
    }
    if (tinted) geometry.setAttribute('tint', new BufferAttribute(await archive.array<Uint8Array>('mesh/tint'), 3, true));
    const textures = await Promise.all(manifest.textures.map((texture) => all.texture(texture).catch((error: unknown) => {
      console.warn(`${texture.file} is of a kind that this browser does not show`, error);
      return null;
    })));
    const white = new DataTexture(new Uint8Array([255, 255, 255, 255]), 1, 1);
    white.needsUpdate = true;
    const map = (index: number | null) => ({ value: index === null ? white : textures[index] ?? white });
    const materials = manifest.materials.map((head, number) => {
      const textured = head.texture !== null || head.emissionTexture !== null;
      const uniforms: Record<string, IUniform> = {
        ...all.shared, reflectance: { value: new Vector3(...head.reflectance) },
        emission: { value: new Vector3() }, reflectanceMap: map(head.texture), emissionMap: map(head.emissionTexture),
      };
      all.lit.push({ uniforms, source: head.source, emission: head.emission });
      geometry.addGroup(head.first, head.count, number);
      return new RawShaderMaterial({
        glslVersion: GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms, side: FrontSide,
        defines: { ...(textured && { TEXTURED: '' }), ...(tinted && { TINTED: '' }), ...(mapped && { MAPPED: '' }) },
        polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
      });
    });
    const mesh = new Mesh(geometry, materials);
    mesh.frustumCulled = false;
    all.scene.add(mesh);
    all.addSky();
    if (mapped) {
      const { width, height } = manifest.atlas;
      const numbers = await archive.array<Uint32Array>('light/patches');
      const patches = new DataTexture(numbers as Uint32Array<ArrayBuffer>, width, height, RedIntegerFormat, UnsignedIntType);
      patches.internalFormat = 'R32UI';
      patches.needsUpdate = true;
      all.shared.patches.value = patches;
    }
    return all;
  }

  // Lets emitting surfaces glow as strongly as their sources.
  glow(weights: Triple[]): void {
    for (const { uniforms, source, emission } of this.lit) {
      const weight = source === null ? [0, 0, 0] : weights[source];
      (uniforms.emission.value as Vector3).set(emission[0] * weight[0], emission[1] * weight[1], emission[2] * weight[2]);
    }
  }

  // Shows the outlines of patches, or hides them.
  async outline(shown: boolean): Promise<void> {
    this.outlined = shown;
    if (shown) await (this.outlining ??= this.addOutlines());
    // Meanwhile it may have changed.
    if (this.outlines) this.outlines.visible = this.outlined;
  }

  private async addOutlines(): Promise<void> {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(await this.archive.array<Uint16Array>('mesh/outlines'), 3, true));
    const [low, high] = this.manifest.bounds;
    const lines = this.outlines = new LineSegments(geometry, new LineBasicMaterial({ color: 0xffffff, transparent: true, opacity: 0.45 }));
    lines.position.set(...low);
    lines.scale.set(high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    lines.frustumCulled = false;
    this.scene.add(lines);
  }

  // Shows values of patches in the mode for them, as shares of the largest.
  heat(values: Float32Array): void {
    this.heats = values;
    const width = 1024;
    const padded = new Float32Array(width * Math.ceil(values.length / width));
    padded.set(values);
    (this.shared.values.value as DataTexture | null)?.dispose();
    const texture = new DataTexture(padded, width, padded.length / width, RedFormat, FloatType);
    texture.needsUpdate = true;
    this.shared.values.value = texture;
  }

  // Where the ray through a place of the picture (-1..1) meets a facet: barycentric coordinates.
  meet(camera: PerspectiveCamera, [x, y]: [number, number], facet: number): Triple | null {
    const corner = (k: number) => new Vector3().fromBufferAttribute(this.geometry.getAttribute('position'), 3 * facet + k);
    const triangle = new Triangle(corner(0), corner(1), corner(2));
    const eye = camera.position;
    const ray = new Ray(eye, new Vector3(x, y, 0.5).unproject(camera).sub(eye).normalize());
    const at = ray.intersectPlane(triangle.getPlane(new Plane()), new Vector3());
    return at && (triangle.getBarycoord(at, new Vector3())?.toArray() ?? null);
  }

  dispose(): void {
    this.geometry.dispose();
    for (const name of ['patches', 'values']) (this.shared[name].value as Texture | null)?.dispose();
    this.scene.traverse((object) => {
      const { material } = object as Partial<Mesh>;
      [material ?? []].flat().forEach((one) => one.dispose());
    });
  }

  // Calls `draw` with surfaces alone, to be measured.
  measuring<T>(draw: () => T): T {
    const { mode } = this.shared;
    const before = [mode.value as Mode, this.outlines?.visible ?? false] as const;
    mode.value = Mode.Measure;
    if (this.outlines) this.outlines.visible = false;
    try {
      return draw();
    } finally {
      [mode.value] = before;
      if (this.outlines) [, this.outlines.visible] = before;
    }
  }

  private addSky(): void {
    const { sky } = this.manifest;
    const uniforms = { ...this.shared, emission: { value: new Vector3() } };
    this.lit.push({ uniforms, source: sky?.source ?? null, emission: sky?.emission ?? [0, 0, 0] });
    const plane = new Mesh(new PlaneGeometry(2, 2), new RawShaderMaterial({
      glslVersion: GLSL3, vertexShader: SKY_VERTEX, fragmentShader: SKY_FRAGMENT, uniforms, depthWrite: false,
    }));
    plane.frustumCulled = false;
    // Last, where nothing else is.
    plane.renderOrder = 1;
    this.scene.add(plane);
  }

  private async texture({ file, wrap, vUp }: TextureHead): Promise<Texture> {
    const image = await createImageBitmap(new Blob([await this.archive.bytes(file)]), {
      imageOrientation: vUp ? 'flipY' : 'from-image', premultiplyAlpha: 'none', colorSpaceConversion: 'none',
    });
    const texture = new Texture(image, undefined, WRAPS[wrap[0]], WRAPS[wrap[1]], LinearFilter, LinearMipmapLinearFilter);
    texture.flipY = false;
    texture.colorSpace = SRGBColorSpace;
    texture.anisotropy = 8;
    texture.needsUpdate = true;
    return texture;
  }
}
