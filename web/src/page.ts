// What a page's data says of itself: `manifest.json`, written by `export/html/manifest.rs`.

export type Triple = [number, number, number];
export type Tone = 'agx' | 'reinhard' | 'linear';

export interface Manifest {
  scene: string;
  unit: { illuminance: string };
  // Stops, and the tone curve.
  exposure: number;
  tone: Tone;
  // False colour runs from 0 to this.
  range: number;
  // How well irradiance is known on 80 % of the surface, as a share of it.
  error: number | null;
  patches: number;
  // Whether the first camera stands within the model.
  inside: boolean;
  // Where the model's own coordinates have these, m: the middle of its box.
  origin: Triple;
  // Corners of the box around the model.
  bounds: [Triple, Triple];
  mostReflectance: number;
  cameras: Camera[];
  sky: { source: number; emission: Triple } | null;
  sources: Source[];
  materials: Material[];
  textures: Texture[];
  atlas: { width: number; height: number; steps: number; octaves: number };
}

export interface Camera { name: string; eye: Triple; target: Triple; up: Triple; vfov: number; aspect: number }

// A source of light and what its layer is multiplied by.
export interface Source {
  name: string;
  // What it now emits, as a multiple of its layer.
  weight: Triple;
  // Whether its channels change together alone.
  keepsColour: boolean;
  // What the largest code of its layer stands for, W/m² or lx.
  peak: number;
}

// A run of triangles of one material.
export interface Material {
  name: string;
  first: number;
  count: number;
  reflectance: Triple;
  texture: number | null;
  // The source that it is of, and the radiance that it then has at unit weight.
  source: number | null;
  emission: Triple;
  emissionTexture: number | null;
}

export interface Texture { file: string; wrap: [Wrap, Wrap]; vUp: boolean }
export type Wrap = 'repeat' | 'mirror' | 'clamp';
