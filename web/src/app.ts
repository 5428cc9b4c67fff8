// The picture and its controls: what a page shows of one archive after another.
import { FloatType, PerspectiveCamera, WebGLRenderer, WebGLRenderTarget } from 'three';
import type { Archive } from './archive';
import { byId } from './dom';
import { Lamps } from './lamps';
import { Layers } from './layers';
import { Navigation } from './navigation';
import { Pace } from './pace';
import type { Manifest, Triple } from './page';
import { Panel, significant, type Slider } from './panel';
import { LEGEND, Mode } from './shaders';
import { Surfaces } from './surfaces';

const LUMINANCE: Triple = [0.2126, 0.7152, 0.0722];
const dot = (a: ArrayLike<number>, b: ArrayLike<number>) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// What is at a place of the picture.
export interface Reading { illuminance: number; irradiance: Triple; material: string; facet: number }

// What one archive holds, made ready.
interface Shown { archive: Archive; manifest: Manifest; layers: Layers; surfaces: Surfaces }

export class App {
  readonly canvas = byId<HTMLCanvasElement>('view');
  readonly camera = new PerspectiveCamera();
  readonly renderer: WebGLRenderer;
  readonly panel = new Panel(byId('panel'));
  navigation!: Navigation;
  private shown!: Shown;
  private lamps!: Lamps;
  private pace: Pace;
  private stale = { light: true, picture: true };
  private asked = false;
  // Where the pointer is in the picture, 0..1 from its upper left.
  private pointer: [number, number] | null = null;
  private pixel = new WebGLRenderTarget(1, 1, { type: FloatType });
  private exposure!: Slider;
  private range!: Slider;
  private outlines!: HTMLInputElement;
  private known!: HTMLElement;
  private mode = Mode.Picture;
  private heated = false;

  constructor() {
    try {
      this.renderer = new WebGLRenderer({ canvas: this.canvas, antialias: true });
    } catch {
      throw new Error('it needs a browser with WebGL 2');
    }
    this.pace = new Pace(this.renderer, () => {
      this.stale.picture = true;
      this.draw();
    });
  }

  get manifest(): Manifest {
    return this.shown.manifest;
  }

  get archive(): Archive {
    return this.shown.archive;
  }

  // Shows an archive; a later one of the same scene takes the place of the first, and all that was
  // set stays.
  async show(archive: Archive): Promise<void> {
    const manifest = await archive.json<Manifest>('manifest.json');
    // Half floats hold what is shown by exposures around the first one.
    const layers = await Layers.read(archive, manifest, 2 ** -manifest.exposure);
    const surfaces = await Surfaces.read(archive, manifest, layers.shown, layers.unit);
    const before = this.shown as Shown | undefined;
    const outlined = before !== undefined && this.outlines.checked;
    // Before it is drawn for the first time.
    if (outlined) await surfaces.outline(true);
    this.shown = { archive, manifest, layers, surfaces };
    this.heated = false;
    if (before) {
      before.layers.dispose();
      before.surfaces.dispose();
      this.settle();
    } else {
      this.build();
    }
    this.outlines.nextElementSibling!.textContent = `Patches (${manifest.patches.toLocaleString('en')})`;
    if (before && this.outlines.checked !== outlined) this.outline(this.outlines.checked);
    this.known.textContent = manifest.error === null ? ''
      : `Irradiance is known to ${significant(100 * manifest.error)} % on 80 % of the surface.`;
    this.draw();
  }

  // Draws what has changed.
  draw(): void {
    const { layers, surfaces } = this.shown;
    if (this.stale.light) {
      const weights = this.lamps.weights();
      layers.mix(this.renderer, weights);
      surfaces.glow(weights);
    }
    if (this.stale.picture) this.renderer.render(surfaces.scene, this.camera);
    this.stale = { light: false, picture: false };
  }

  // Has it drawn with the next frame.
  ask(what: 'light' | 'picture' | 'reading'): void {
    if (what !== 'reading') this.stale.picture = true;
    if (what === 'light') this.stale.light = true;
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame((now) => {
      this.asked = false;
      if (this.stale.picture) this.pace.frame(now);
      this.draw();
      if (this.pointer && !this.navigation.dragging) byId('hover').textContent = this.told(this.read(...this.pointer));
    });
  }

  // Illuminance at a place of the picture, by drawing that pixel alone.
  read(x: number, y: number): Reading | null {
    const { camera, renderer, canvas: { clientWidth: width, clientHeight: height } } = this;
    const { surfaces, manifest } = this.shown;
    camera.setViewOffset(width, height, x * width - 0.5, y * height - 0.5, 1, 1);
    const found = new Float32Array(4);
    surfaces.measuring(() => {
      renderer.setRenderTarget(this.pixel);
      renderer.setClearAlpha(0);
      renderer.render(surfaces.scene, camera);
      renderer.readRenderTargetPixels(this.pixel, 0, 0, 1, 1, found);
      renderer.setRenderTarget(null);
    });
    camera.clearViewOffset();
    const facet = Math.round(found[3]) - 1;
    const material = manifest.materials.find(({ first, count }) => 3 * facet >= first && 3 * facet < first + count);
    if (!material) return null;
    const irradiance = [found[0], found[1], found[2]] as Triple;
    return { illuminance: dot(irradiance, LUMINANCE), irradiance, material: material.name, facet };
  }

  // What a reading says.
  told(reading: Reading | null): string {
    const { unit } = this.manifest;
    return reading ? `${significant(reading.illuminance)} ${unit.illuminance} on ${reading.material}` : 'No surface there.';
  }

  // Where on a facet a place of the picture lies: barycentric coordinates.
  place(x: number, y: number, facet: number): Triple | null {
    return this.shown.surfaces.meet(this.camera, [2 * x - 1, 1 - 2 * y], facet);
  }

  // Shows a value for each patch, as shares of the largest; none: the picture again.
  heat(values: Float32Array | null): void {
    if (values) this.shown.surfaces.heat(values);
    this.heated = values !== null;
    this.settle();
  }

  // The values of patches that are shown.
  heats(): Float32Array {
    return this.shown.surfaces.heats;
  }

  private build(): void {
    const { manifest } = this.shown;
    const [low, high] = manifest.bounds;
    const size = Math.hypot(...low.map((l, k) => high[k] - l)) || 1;
    this.navigation = new Navigation(this.camera, this.canvas, size, () => this.ask('picture'));
    const { panel } = this;
    const { illuminance } = manifest.unit;
    panel.heading('Light');
    this.lamps = new Lamps(panel, manifest.sources, () => this.ask('light'));
    panel.heading('Picture');
    this.exposure = panel.slider('Exposure', {
      low: -6, high: 6, step: 0.1, value: 0, text: (stops) => `${stops > 0 ? '+' : ''}${stops.toFixed(1)} stops`,
      changed: () => this.settle(),
    });
    const falseColour = panel.check(`Illuminance in colours (${illuminance})`, (on) => {
      this.mode = on ? Mode.FalseColour : Mode.Picture;
      this.settle();
    });
    this.range = panel.slider('Brightest colour', {
      low: -4, high: 4, step: 0.1, value: 0, text: (octaves) => `${significant(manifest.range * 2 ** octaves)} ${illuminance}`,
      changed: () => this.settle(),
    });
    const outlines = this.outlines = panel.check('Patches', (on) => this.outline(on));
    panel.heading('View');
    const cameras = panel.choice('Camera', manifest.cameras.map(({ name }) => name), (k) => this.navigation.take(manifest.cameras[k]));
    const walk = panel.check('Walk: dragging looks around', (on) => {
      this.navigation.way = on ? 'walk' : 'orbit';
    });
    const begin = () => {
      this.lamps.reset();
      this.exposure.set(0);
      this.range.set(0);
      this.mode = Mode.Picture;
      falseColour.checked = false;
      outlines.checked = false;
      walk.checked = manifest.inside;
      this.navigation.way = manifest.inside ? 'walk' : 'orbit';
      cameras.selectedIndex = 0;
      this.navigation.take(manifest.cameras[0]);
      this.shown.surfaces.outline(false).then(() => this.settle(), fail);
    };
    panel.button('As it was', begin);
    panel.note('Drag to turn, wheel or pinch to go nearer, shift and drag to move. Keys on the picture: arrows turn, + and - go '
      + 'nearer and away, W A S D walk, Q and E go down and up, Enter reads the middle.', 'keys');
    this.known = panel.note('');
    this.listen();
    begin();
  }

  // Shows the patches, or no longer.
  outline(on: boolean): void {
    this.outlines.checked = on;
    this.shown.surfaces.outline(on).then(() => this.ask('picture'), fail);
  }

  // Lets surfaces show what controls say.
  private settle(): void {
    const { surfaces: { shared }, manifest } = this.shown;
    shared.exposure.value = 2 ** (manifest.exposure + this.exposure.value());
    shared.range.value = manifest.range * 2 ** this.range.value();
    shared.mode.value = this.heated ? Mode.Heat : this.mode;
    this.showLegend();
    this.ask('light');
  }

  private showLegend(): void {
    const { surfaces: { shared }, manifest: { unit } } = this.shown;
    const legend = byId('legend');
    legend.hidden = this.heated || this.mode !== Mode.FalseColour;
    const [bar, scale] = legend.children as unknown as [HTMLElement, HTMLElement];
    bar.style.background = LEGEND;
    const most = shared.range.value as number;
    scale.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((t) => {
      const mark = document.createElement('span');
      mark.textContent = `${significant(t * most)}${t === 1 ? ` ${unit.illuminance}` : ''}`;
      return mark;
    }));
    legend.setAttribute('aria-label', `Colours of illuminance from 0 to ${significant(most)} ${unit.illuminance}`);
  }

  private listen(): void {
    const { canvas } = this;
    const follow = (event: PointerEvent) => {
      const box = canvas.getBoundingClientRect();
      this.pointer = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
      this.ask('reading');
    };
    canvas.addEventListener('pointermove', follow);
    canvas.addEventListener('pointerdown', follow);
    canvas.addEventListener('pointerleave', () => {
      this.pointer = null;
    });
    canvas.addEventListener('keydown', (event) => {
      if (event.key === 'Enter') byId('spoken').textContent = `Middle: ${this.told(this.read(0.5, 0.5))}`;
    });
    canvas.addEventListener('webglcontextrestored', () => {
      this.shown.layers.forget();
      this.ask('light');
    });
    new ResizeObserver(() => {
      this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      this.resize(canvas.clientWidth, canvas.clientHeight);
      // At once, as a canvas that changes its size is empty.
      this.stale.picture = true;
      this.draw();
    }).observe(canvas);
  }

  // Draws as many pixels, times what the screen has to each.
  resize(width: number, height: number): void {
    this.renderer.setSize(width, height, false);
    this.navigation.widen(width / height);
  }
}

// Says why nothing can be shown.
export function fail(error: unknown): void {
  const box = byId('failure');
  box.hidden = false;
  box.textContent = `This page cannot go on: ${error instanceof Error ? error.message : error}.`;
  console.error(error);
}
