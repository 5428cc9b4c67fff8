// What a page asks of the program that serves it: how far the work is, light as it gets better, and
// what a patch sees.
import { fail, type App } from './app';
import { Adaptive } from './adaptive';
import { Archive } from './archive';
import { hex, linear } from './colour';
import { byId } from './dom';
import { significant } from './panel';
import { HEAT_OCTAVES, LEGEND } from './shaders';

// How the work stands; `version` counts what there is to show.
// `tolerance` is that of the adaptive subdivision, if it is one; `splits`, whether another may be wished for.
interface State {
  stage: string; share: number | null; version: number; done: boolean; failure: string | null;
  splits: boolean; tolerance: number | null; refusal: string | null;
}

// A patch and its row of form factors.
export interface Row {
  patch: number; surface: string; area: number; illuminance: number; error: number; sum: number; environment: number;
  columns: number[]; factors: number[]; patches: number;
}

// Milliseconds between two questions while there is work.
const WAIT = 150;

// The value that marks the patch itself.
const SELF = -1;

export class Live {
  row: Row | null = null;
  private version = 0;
  private listens = false;
  // Whether something was wished for since the last look began.
  private again = false;
  private adaptive: Adaptive | null = null;

  constructor(private app: App) {
    byId('work').hidden = false;
  }

  // Waits for the first light, and goes on to listen.
  async start(): Promise<void> {
    while (this.version === 0) await this.look();
    this.build();
    this.listen();
  }

  // Shows what is new until the work is done.
  private listen(): void {
    this.again = true;
    if (this.listens) return;
    this.listens = true;
    const all = async () => {
      let done = false;
      while (!done || this.again) {
        this.again = false;
        done = await this.look();
      }
    };
    all().finally(() => {
      this.listens = false;
    }).catch(fail);
  }

  // Asks how the work stands and shows what is new; whether it is done.
  private async look(): Promise<boolean> {
    const state = await (await ask('state')).json() as State;
    const share = state.share === null ? '' : ` ${Math.floor(100 * state.share)} %`;
    byId('work').textContent = state.failure ?? state.refusal ?? `${state.stage}${share}`;
    if (!this.again) this.adaptive?.follow(state.splits, state.tolerance);
    if (state.failure !== null) throw new Error(state.failure);
    if (state.version > this.version) {
      const bytes = new Uint8Array(await (await ask(`data?version=${state.version}`)).arrayBuffer());
      await this.app.show(new Archive(bytes));
      this.version = state.version;
      // The row was of the light before.
      if (this.row) this.close();
    }
    byId('work').hidden = state.done && !this.again && state.refusal === null;
    if (!state.done) await new Promise((resolve) => { setTimeout(resolve, WAIT); });
    return state.done && state.version === this.version;
  }

  private build(): void {
    const { app } = this;
    app.panel.heading('Reflectance');
    const names = [...new Set(app.manifest.materials.map(({ name }) => name))];
    const colourOf = (k: number) => hex(app.manifest.materials.find(({ name }) => name === names[k])!.reflectance);
    const material = app.panel.choice('Material', names, (k) => {
      colour.value = colourOf(k);
    });
    const colour = app.panel.colour('Solved again when it is chosen', (value) => {
      const name = names[material.selectedIndex];
      void this.wish(`reflectance?material=${encodeURIComponent(name)}&reflectance=${linear(value).join(',')}`);
    });
    colour.value = colourOf(0);
    this.adaptive = new Adaptive(app.panel, {
      // One wants to see what is split.
      ticked: () => app.outline(true),
      wish: (tolerance) => this.wish(`subdivision?tolerance=${tolerance ?? 'uniform'}`),
    });
    app.panel.heading('Form factors');
    app.panel.note('Click a place, or press F for the middle: what its patch sees. Escape shows the picture again.');
    let pressed: [number, number] | null = null;
    app.canvas.addEventListener('pointerdown', ({ clientX, clientY }) => {
      pressed = [clientX, clientY];
    });
    app.canvas.addEventListener('pointerup', ({ clientX, clientY }) => {
      if (!pressed || Math.hypot(clientX - pressed[0], clientY - pressed[1]) > 4) return;
      const box = app.canvas.getBoundingClientRect();
      this.lookAt((clientX - box.left) / box.width, (clientY - box.top) / box.height).catch(fail);
    });
    app.canvas.addEventListener('keydown', ({ key }) => {
      if (key === 'f') this.lookAt(0.5, 0.5).catch(fail);
      if (key === 'Escape') this.close();
    });
  }

  private wish(what: string): Promise<void> {
    return ask(what, 'POST').then(() => this.listen(), fail);
  }

  // Shows what the patch at a place of the picture sees.
  async lookAt(x: number, y: number): Promise<void> {
    const { app } = this;
    const reading = app.read(x, y);
    if (!reading) {
      this.close();
      return;
    }
    const place = app.place(x, y, reading.facet)?.join(',');
    const { version } = this;
    const answer = await ask(`row?version=${version}&facet=${reading.facet}&at=${place}`, 'GET', [404]);
    // Light that is not shown yet has other triangles, and some places belong to no patch.
    if (!answer.ok) {
      byId('spoken').textContent = 'Nothing is known of that place yet.';
      return;
    }
    const row = await answer.json() as Row;
    // By now other patches may be shown.
    if (version !== this.version) return;
    this.row = row;
    const values = new Float32Array(row.patches);
    const most = row.factors.reduce((largest, f) => Math.max(largest, f), Number.MIN_VALUE);
    row.columns.forEach((j, k) => {
      values[j] = row.factors[k] / most;
    });
    values[row.patch] = SELF;
    app.heat(values);
    const seen = byId('seen');
    const [image, caption, bar, scale] = seen.children as unknown as [HTMLImageElement, HTMLElement, HTMLElement, HTMLElement];
    image.src = `hemicube?patch=${row.patch}&version=${version}`;
    bar.style.background = LEGEND;
    scale.replaceChildren(...[2 ** -HEAT_OCTAVES * most, 2 ** (-HEAT_OCTAVES / 2) * most, most].map((value) => {
      const mark = document.createElement('span');
      mark.textContent = value.toExponential(1);
      return mark;
    }));
    caption.textContent = `Patch ${row.patch} of ${row.surface}, ${significant(row.area)} m²: `
      + `${significant(row.illuminance)} ± ${significant(row.error)} ${app.manifest.unit.illuminance}. Form factors to ${row.columns.length} patches, `
      + `${significant(row.sum)} in all, ${significant(row.environment)} to the surroundings.`;
    byId('spoken').textContent = caption.textContent;
    seen.hidden = false;
  }

  private close(): void {
    this.row = null;
    this.app.heat(null);
    byId('spoken').textContent = '';
    byId('seen').hidden = true;
  }
}

// An answer of the program, with one of these statuses if not well.
async function ask(what: string, method = 'GET', expected: number[] = []): Promise<Response> {
  const response = await fetch(what, { method }).catch(() => {
    throw new Error('the program that serves it has ended');
  });
  if (!response.ok && !expected.includes(response.status)) throw new Error(`the program answers ${response.status} to ${what}`);
  return response;
}
