// Checks the viewer: `hemicube view` in a browser, its rows of form factors and what changes.
// Usage: node view.mjs HEMICUBE [PICTURE.png], where a picture of the row is written.
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { differences, hear, launch } from './browser.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const [, , program, picture] = process.argv;
if (!program) throw new Error('usage: node view.mjs HEMICUBE [PICTURE.png]');

const faults = [];
const expect = (holds, text) => {
  console.log(`${holds ? 'good' : 'BAD '} ${text}`);
  if (!holds) faults.push(text);
};

const start = performance.now();
const seconds = () => `${((performance.now() - start) / 1000).toFixed(1)} s`;
const viewer = spawn(program, ['view', 'cornell-box', '--no-open', '-q'], { stdio: ['ignore', 'pipe', 'inherit'] });
const address = await new Promise((resolve) => {
  viewer.stdout.once('data', (text) => resolve(text.toString().trim()));
});
const browser = await launch();
try {
  const page = await browser.newPage({ viewport: { width: 1280, height: 800 } });
  const complaints = [];
  hear(page, complaints);
  page.on('request', (request) => {
    if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) complaints.push(`asks for ${request.url()}`);
  });
  await page.goto(address);
  await page.waitForFunction(() => window.hemicube?.ready, null, { timeout: 60000 });
  console.log(`     first light after ${seconds()}, the browser's start with it`);
  const done = () => page.waitForFunction(() => document.getElementById('work').hidden, null, { timeout: 300000 });
  const light = () => page.evaluate(() => window.hemicube.app.read(0.5, 0.2)?.illuminance ?? 0);
  const first = await light();
  await done();
  console.log(`     all light after ${seconds()}`);
  const last = await light();
  expect(Math.abs(first / last - 1) < 0.15, `first light is ${(100 * (first / last - 1)).toFixed(1)} % off where it is read`);

  // The picture is that of `render`.
  const folder = mkdtempSync(join(tmpdir(), 'hemicube-'));
  const file = join(folder, 'cornell.png');
  execFileSync(program, ['render', 'cornell-box', '--size', '960x720', '-q', '-o', file]);
  const at = await differences(page, file);
  rmSync(folder, { recursive: true });
  expect(at(0.5) <= 1 && at(0.95) <= 6, `pixels differ from render's by ${at(0.5)} at the median, ${at(0.95)} at 95 % (of 255)`);

  // A row: what is shown is what the program says.
  await page.locator('canvas').click({ position: { x: 300, y: 600 } });
  await page.waitForFunction(() => window.hemicube.live.row);
  const row = await page.evaluate(() => window.hemicube.live.row);
  // The patch under the pointer is marked.
  const marked = await page.evaluate(([x, y]) => {
    const { app } = window.hemicube;
    app.ask('picture');
    app.draw();
    const context = new OffscreenCanvas(1, 1).getContext('2d');
    const ratio = app.canvas.width / app.canvas.clientWidth;
    context.drawImage(app.canvas, -Math.floor(x * ratio), -Math.floor(y * ratio));
    return [...context.getImageData(0, 0, 1, 1).data].slice(0, 3);
  }, [300, 600]);
  expect(marked[0] > 240 && marked[1] < 110 && marked[2] < 80, `the patch that was clicked is red: ${marked}`);
  const sum = row.factors.reduce((all, f) => all + f, 0);
  expect(Math.abs(sum + row.environment - 1) < 1e-3, `a row sums to ${sum.toFixed(4)}, ${row.environment.toFixed(4)} escape`);
  const shown = await page.evaluate(({ columns, factors }) => {
    const values = window.hemicube.app.heats();
    const most = Math.max(...factors);
    return Math.max(...columns.map((j, k) => Math.abs(values[j] * most - factors[k]) / most));
  }, row);
  expect(shown < 1e-6, `the heat map is the row within ${shown.toExponential(1)} of its largest factor`);
  await page.waitForFunction(() => document.querySelector('#seen img').naturalWidth > 0);
  expect(await page.locator('#seen').isVisible(), 'the hemicube is shown');
  if (picture) await page.screenshot({ path: picture });
  const spoken = await page.locator('#spoken').textContent();
  expect(/^Patch \d+ of .+ m²: .+ lx\. Form factors to \d+ patches/.test(spoken), `it is announced: "${spoken}"`);
  await page.locator('canvas').press('Escape');
  expect(!await page.locator('#seen').isVisible(), 'Escape shows the picture again');
  await page.locator('canvas').press('f');
  await page.waitForFunction(() => window.hemicube.live.row);
  await page.locator('canvas').press('Escape');

  // Another reflectance.
  await page.getByLabel('Material').selectOption('white');
  await page.getByLabel('Solved again when it is chosen').fill('#101010');
  await page.waitForFunction(() => !document.getElementById('work').hidden, null, { timeout: 10000 });
  await done();
  const dark = await light();
  expect(dark < 0.8 * last, `a darker room is solved again: ${last.toFixed(3)} lx become ${dark.toFixed(3)}`);

  // The paper's subdivision, and another tolerance from the keyboard.
  const patches = () => page.evaluate(() => window.hemicube.app.manifest.patches);
  const settled = async () => {
    await page.waitForFunction(() => !document.getElementById('work').hidden, null, { timeout: 10000 });
    await done();
  };
  const uniform = await patches();
  await page.getByLabel('Adaptive, driven by form factors').check();
  await settled();
  const adaptive = await patches();
  expect(adaptive < 0.7 * uniform, `${uniform} patches become ${adaptive} at a tolerance of .02`);
  const outlines = page.getByLabel(`Patches (${adaptive.toLocaleString('en')})`);
  const drawn = () => page.evaluate(() => new Promise((resolve) => {
    requestAnimationFrame(() => {
      const { app } = window.hemicube;
      app.ask('picture');
      app.draw();
      const { width, height } = app.canvas;
      const context = new OffscreenCanvas(width, height).getContext('2d');
      context.drawImage(app.canvas, 0, 0);
      resolve(context.getImageData(0, 0, width, height).data.reduce((sum, value) => sum + value, 0) / width / height);
    });
  }));
  const lined = await drawn();
  await outlines.uncheck();
  const plain = await drawn();
  expect(lined > 1.02 * plain, `their outlines are drawn: the mean of pixels is ${lined.toFixed(1)}, without them ${plain.toFixed(1)}`);
  await outlines.check();
  if (picture) await page.screenshot({ path: picture.replace(/(\.\w+)?$/, '-adaptive$1') });
  await page.getByLabel('Largest form factor').press('Home');
  await settled();
  const fine = await patches();
  expect(fine > 1.2 * adaptive, `a smaller tolerance splits more: ${fine}`);
  await page.getByLabel('Adaptive, driven by form factors').uncheck();
  await settled();
  expect(await patches() === uniform, 'without it patches are as they were');

  await page.evaluate(await readFile(AXE, 'utf8'));
  const { violations } = await page.evaluate(() => window.axe.run(document));
  violations.forEach(({ id, help, nodes }) => console.log(`  ${id}: ${help}: ${nodes[0].html}`));
  expect(violations.length === 0, `axe-core finds ${violations.length} faults`);
  expect(complaints.length === 0, `no complaints ${complaints.join('; ')}`);
} finally {
  await browser.close();
  viewer.kill('SIGINT');
}
const code = await new Promise((resolve) => {
  viewer.once('exit', resolve);
});
expect(code === 130, 'Ctrl-C ends it');
process.exitCode = faults.length === 0 ? 0 : 1;
