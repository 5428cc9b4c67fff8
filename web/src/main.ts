// A page that shows a lit model: its lamps under sliders, illuminance under the pointer, and the
// patches that its light was solved on.
import { App, fail } from './app';
import { Archive, decoded } from './archive';
import { byId } from './dom';
import { Live } from './live';
import type { Triple } from './page';

async function start(): Promise<void> {
  if (matchMedia('(max-width: 600px)').matches) byId<HTMLDetailsElement>('panel').open = false;
  const data = byId('data').textContent?.trim() ?? '';
  const app = new App();
  const live = data === '' ? new Live(app) : null;
  await (live ? live.start() : app.show(new Archive(decoded(data))));
  // What tests, and people at a console, may ask.
  const stand = (eye: Triple, target: Triple) => {
    const steep = Math.abs(eye[1] - target[1]) > 0.9 * Math.hypot(...eye.map((e, k) => e - target[k]));
    app.navigation.take({ ...app.manifest.cameras[0], eye, target, up: steep ? [1, 0, 0] : [0, 1, 0] });
  };
  const resize = (width: number, height: number) => {
    app.renderer.setPixelRatio(1);
    app.resize(width, height);
  };
  Object.assign(window, { hemicube: { app, live, stand, resize, ready: true } });
}

start().catch(fail);
