// A page that shows a lit model: its lamps under sliders, illuminance under the pointer, and the
// patches that its light was solved on.
import { FloatType, PerspectiveCamera, SRGBColorSpace, WebGLRenderer, WebGLRenderTarget } from 'three';
import { Archive, decoded } from './archive';
import { Lamps } from './lamps';
import { Layers } from './layers';
import { Navigation } from './navigation';
import type { Manifest, Triple } from './page';
import { Pace } from './pace';
import { Panel, significant } from './panel';
import { LEGEND, Mode } from './shaders';
import { Surfaces } from './surfaces';

const byId = <E extends HTMLElement>(id: string): E => document.getElementById(id) as E;

const LUMINANCE: Triple = [0.2126, 0.7152, 0.0722];
const dot = (a: ArrayLike<number>, b: ArrayLike<number>) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// What is at a place of the picture.
interface Reading { illuminance: number; irradiance: Triple; material: string }

async function start(): Promise<void> {
  const archive = new Archive(decoded(byId('data').textContent ?? ''));
  const manifest = await archive.json<Manifest>('manifest.json');
  const canvas = byId<HTMLCanvasElement>('view');
  const renderer = new WebGLRenderer({ canvas, antialias: true });
  renderer.autoClear = true;
  renderer.outputColorSpace = SRGBColorSpace;
  // Half floats hold what is shown by exposures around the first one.
  const layers = await Layers.read(archive, manifest, 2 ** -manifest.exposure);
  const surfaces = await Surfaces.read(archive, manifest, layers.sum.texture, layers.unit);
  const { shared } = surfaces;
  const camera = new PerspectiveCamera();

  let stale = { light: true, picture: true };
  const draw = () => {
    if (stale.light) {
      const weights = lamps.weights();
      layers.mix(renderer, weights);
      surfaces.glow(weights);
    }
    if (stale.picture) renderer.render(surfaces.scene, camera);
    stale = { light: false, picture: false };
  };
  // Where the pointer is in the picture, 0..1 from its upper left.
  let pointer: [number, number] | null = null;
  let asked = false;
  const ask = (what: 'light' | 'picture' | 'reading') => {
    if (what !== 'reading') stale.picture = true;
    if (what === 'light') stale.light = true;
    if (asked) return;
    asked = true;
    requestAnimationFrame((now) => {
      asked = false;
      if (stale.picture) pace.frame(now);
      draw();
      if (pointer && !navigation.dragging) byId('hover').textContent = told(read(...pointer));
    });
  };

  const pace = new Pace(renderer, () => {
    stale.picture = true;
    draw();
  });

  const [low, high] = manifest.bounds;
  const size = Math.hypot(...low.map((l, k) => high[k] - l)) || 1;
  const navigation = new Navigation(camera, canvas, size, () => ask('picture'));

  // Controls.
  const panel = new Panel(byId('panel'));
  panel.heading('Light');
  const lamps = new Lamps(panel, manifest.sources, () => ask('light'));
  panel.heading('Picture');
  const exposure = panel.slider('Exposure', {
    low: -6, high: 6, step: 0.1, value: 0, text: (stops) => `${stops > 0 ? '+' : ''}${stops.toFixed(1)} stops`,
    changed: () => {
      shared.exposure.value = 2 ** (manifest.exposure + exposure.value());
      ask('picture');
    },
  });
  const falseColour = panel.check(`Illuminance in colours (${manifest.unit.illuminance})`, (on) => {
    shared.mode.value = on ? Mode.FalseColour : Mode.Picture;
    showLegend();
    ask('picture');
  });
  const range = panel.slider('Brightest colour', {
    low: -4, high: 4, step: 0.1, value: 0, text: (octaves) => `${significant(manifest.range * 2 ** octaves)} ${manifest.unit.illuminance}`,
    changed: () => {
      shared.range.value = manifest.range * 2 ** range.value();
      showLegend();
      ask('picture');
    },
  });
  const outlines = panel.check(`Patches (${manifest.patches.toLocaleString('en')})`, (on) => {
    surfaces.outline(on).then(() => ask('picture'), fail);
  });
  panel.heading('View');
  const cameras = panel.choice('Camera', manifest.cameras.map(({ name }) => name), (k) => navigation.take(manifest.cameras[k]));
  const walk = panel.check('Walk: dragging looks around', (on) => {
    navigation.way = on ? 'walk' : 'orbit';
  });
  const begin = () => {
    lamps.reset();
    exposure.set(0);
    range.set(0);
    shared.exposure.value = 2 ** manifest.exposure;
    shared.range.value = manifest.range;
    shared.mode.value = Mode.Picture;
    falseColour.checked = false;
    outlines.checked = false;
    walk.checked = manifest.inside;
    navigation.way = manifest.inside ? 'walk' : 'orbit';
    cameras.selectedIndex = 0;
    navigation.take(manifest.cameras[0]);
    showLegend();
    surfaces.outline(false).then(() => ask('light'), fail);
  };
  panel.button('As it was', begin);
  panel.note('Drag to turn, wheel or pinch to go nearer, shift and drag to move. Keys on the picture: arrows turn, + and - go '
    + 'nearer and away, W A S D walk, Q and E go down and up, Enter reads the middle.', 'keys');
  if (manifest.error !== null) {
    panel.note(`Irradiance is known to ${significant(100 * manifest.error)} % on 80 % of the surface.`);
  }

  function showLegend(): void {
    const legend = byId('legend');
    legend.hidden = shared.mode.value !== Mode.FalseColour;
    const [bar, scale] = legend.children as unknown as [HTMLElement, HTMLElement];
    bar.style.background = LEGEND;
    const most = shared.range.value as number;
    scale.replaceChildren(...[0, 0.25, 0.5, 0.75, 1].map((t) => {
      const mark = document.createElement('span');
      mark.textContent = `${significant(t * most)}${t === 1 ? ` ${manifest.unit.illuminance}` : ''}`;
      return mark;
    }));
    legend.setAttribute('aria-label', `Colours of illuminance from 0 to ${significant(most)} ${manifest.unit.illuminance}`);
  }

  // Illuminance at a place of the picture, 0..1 from its upper left, by drawing that pixel alone.
  const pixel = new WebGLRenderTarget(1, 1, { type: FloatType });
  const read = (x: number, y: number): Reading | null => {
    const { clientWidth: width, clientHeight: height } = canvas;
    camera.setViewOffset(width, height, x * width - 0.5, y * height - 0.5, 1, 1);
    const values = new Float32Array(4);
    surfaces.measuring(() => {
      renderer.setRenderTarget(pixel);
      renderer.setClearAlpha(0);
      renderer.render(surfaces.scene, camera);
      renderer.readRenderTargetPixels(pixel, 0, 0, 1, 1, values);
      renderer.setRenderTarget(null);
    });
    camera.clearViewOffset();
    if (values[3] < 0.5) return null;
    const irradiance = [values[0], values[1], values[2]] as Triple;
    return { illuminance: dot(irradiance, LUMINANCE), irradiance, material: manifest.materials[Math.round(values[3]) - 1].name };
  };
  const told = (reading: Reading | null) => (reading
    ? `${significant(reading.illuminance)} ${manifest.unit.illuminance} on ${reading.material}`
    : 'No surface there.');

  const follow = (event: PointerEvent) => {
    const box = canvas.getBoundingClientRect();
    pointer = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height];
    ask('reading');
  };
  canvas.addEventListener('pointermove', follow);
  canvas.addEventListener('pointerdown', follow);
  canvas.addEventListener('pointerleave', () => {
    pointer = null;
  });
  canvas.addEventListener('keydown', (event) => {
    if (event.key === 'Enter') byId('spoken').textContent = `Middle: ${told(read(0.5, 0.5))}`;
  });

  const resize = () => {
    renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    const { clientWidth: width, clientHeight: height } = canvas;
    renderer.setSize(width, height, false);
    navigation.widen(width / height);
    // At once, as a canvas that changes its size is empty.
    stale.picture = true;
    draw();
  };
  new ResizeObserver(resize).observe(canvas);
  canvas.addEventListener('webglcontextrestored', () => ask('light'));
  if (matchMedia('(max-width: 600px)').matches) byId<HTMLDetailsElement>('panel').open = false;
  begin();
  // What tests, and people at a console, may ask.
  const stand = (eye: Triple, target: Triple) => {
    const up: Triple = Math.abs(eye[1] - target[1]) > 0.9 * Math.hypot(...eye.map((e, k) => e - target[k])) ? [1, 0, 0] : [0, 1, 0];
    navigation.take({ ...manifest.cameras[0], eye, target, up });
  };
  const resizeTo = (width: number, height: number) => {
    renderer.setPixelRatio(1);
    renderer.setSize(width, height, false);
    navigation.widen(width / height);
  };
  Object.assign(window, {
    hemicube: { archive, camera, canvas, draw, manifest, origin: manifest.origin, read, resize: resizeTo, stand, ready: true },
  });
}

function fail(error: unknown): void {
  const box = byId('failure');
  box.hidden = false;
  box.textContent = `This page cannot be shown: ${error instanceof Error ? error.message : error}. It needs a browser with WebGL 2.`;
  console.error(error);
}

start().catch(fail);
