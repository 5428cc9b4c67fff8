// Checks a page that `hemicube bake -o room.html` made: what it shows is what the program says.
// Usage: node html.mjs HEMICUBE FOLDER, with room.html and room.png (by render, as wide as high
// times 4/3) in it. HEMICUBE is the program.
import { execFileSync } from 'node:child_process';
import { readFile, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { differences, hear, launch } from './browser.mjs';

const AXE = createRequire(import.meta.url).resolve('axe-core/axe.min.js');
const POINTS = 100;
const percent = (x) => `${(100 * x).toFixed(2)} %`;
const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

const faults = [];
const expect = (holds, text) => {
  console.log(`${holds ? 'good' : 'BAD '} ${text}`);
  if (!holds) faults.push(text);
};

const [, , program, folder] = process.argv;
if (process.argv.length !== 4) throw new Error('usage: node html.mjs HEMICUBE FOLDER');

// The page in a window of that size, and what it complains of.
async function open(browser, size) {
  const page = await browser.newPage({ viewport: size });
  const complaints = [];
  hear(page, complaints);
  page.on('request', (request) => {
    if (!/^(file|blob|data):/.test(request.url())) complaints.push(`asks for ${request.url()}`);
  });
  const start = performance.now();
  await page.goto(pathToFileURL(resolve(folder, 'room.html')).href);
  await page.waitForFunction(() => window.hemicube?.ready);
  const seconds = (performance.now() - start) / 1000;
  return { page, complaints, seconds };
}

// What the page shows beside what `render` does.
async function picture(page) {
  const at = await differences(page, join(folder, 'room.png'));
  expect(at(0.5) <= 1 && at(0.95) <= 6, `pixels differ from render's by ${at(0.5)} at the median, ${at(0.95)} at 95 % (of 255)`);
}

// Irradiance read in the page beside that of `probe`, at points spread over the model.
async function readings(page) {
  const found = await page.evaluate(async (count) => {
    const { app, stand } = window.hemicube;
    const { archive, manifest } = app;
    const { origin } = manifest;
    const read = (x, y) => app.read(x, y);
    const position = await archive.array('mesh/position');
    const place = (k) => [position[3 * k], position[3 * k + 1], position[3 * k + 2]];
    const minus = (a, b) => a.map((x, i) => x - b[i]);
    const triangles = [];
    let total = 0;
    for (let k = 0; k < position.length / 3; k += 3) {
      const [a, b, c] = [0, 1, 2].map((i) => place(k + i));
      const [u, v] = [minus(b, a), minus(c, a)];
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      const length = Math.hypot(...n);
      if (length === 0) continue;
      total += length;
      triangles.push({ a, u, v, n: n.map((x) => x / length), end: total });
    }
    const near = 2e-3 * Math.hypot(...minus(manifest.bounds[1], manifest.bounds[0]));
    return Array.from({ length: count }, (_, i) => {
      const triangle = triangles.find(({ end }) => end >= (i + 0.5) / count * total);
      const [s, t] = [(0.2 + i * 0.7548) % 1, (0.3 + i * 0.5698) % 1];
      const [x, y] = s + t > 1 ? [1 - s, 1 - t] : [s, t];
      const at = triangle.a.map((p, c) => p + x * triangle.u[c] + y * triangle.v[c]);
      stand(at.map((p, c) => p + near * triangle.n[c]), at);
      const reading = read(0.5, 0.5);
      return { at: at.map((p, c) => p + origin[c]), normal: triangle.n, illuminance: reading?.illuminance ?? NaN };
    });
  }, POINTS);
  const table = join(folder, 'points.csv');
  const rows = found.map(({ at, normal }) => [...at, ...normal].join(','));
  await writeFile(table, `x,y,z,nx,ny,nz\n${rows.join('\n')}\n`);
  const out = execFileSync(program, ['probe', 'room', '--points', table, '--samples', '1024', '-q'], { encoding: 'utf8' });
  const [head, ...lines] = out.trim().split('\n').map((line) => line.split(','));
  const [e, error, free] = ['E', 'error', 'place'].map((name) => head.indexOf(name));
  const pairs = lines.map((line, i) => ({
    said: found[i].illuminance, probed: Number(line[e]), error: Number(line[error]), place: line[free],
  })).filter(({ place }) => place === 'free');
  const mean = pairs.reduce((sum, { probed }) => sum + probed, 0) / pairs.length;
  // A texel is the mean of the surface in it, so points at contacts and on narrow faces differ, as
  // do those of curved surfaces, which are shaded by smooth normals.
  const good = pairs.filter(({ said, probed, error }) => Math.abs(said - probed) <= error + 0.02 * mean);
  const rms = Math.sqrt(pairs.reduce((sum, { said, probed }) => sum + (said - probed) ** 2, 0) / pairs.length) / mean;
  expect(pairs.length >= 0.9 * POINTS && good.length >= 0.9 * pairs.length && rms < 0.03, `illuminance is probe's to its error and 2 % of the mean at ${good.length} of ${pairs.length} points, RMS ${percent(rms)} of the mean`);
}

// Light is linear in each slider.
async function sliders(page) {
  const lamps = page.locator('#panel input[type=range]');
  const names = await page.evaluate(() => window.hemicube.app.manifest.sources.map(({ name }) => name));
  const light = (lamp, value) => page.evaluate(([k, percentage]) => {
    const input = document.querySelectorAll('#panel input[type=range]')[k];
    input.value = percentage;
    input.dispatchEvent(new Event('input', { bubbles: true }));
    window.hemicube.app.draw();
    const places = Array.from({ length: 64 }, (_, i) => [(i % 8 + 0.5) / 8, (Math.floor(i / 8) + 0.5) / 8]);
    return places.map(([x, y]) => window.hemicube.app.read(x, y)?.irradiance ?? [0, 0, 0]).flat();
  }, [lamp, value]);
  for (let k = 0; k < names.length; k += 1) {
    const [off, half, full] = [await light(k, 0), await light(k, 50), await light(k, 100)];
    const mean = full.reduce((sum, e) => sum + e, 0) / full.length;
    const worst = Math.max(...full.map((e, i) => Math.abs(half[i] - (off[i] + e) / 2))) / mean;
    const change = full.reduce((sum, e, i) => sum + e - off[i], 0) / full.length / mean;
    expect(worst <= 0.01 && change > 0.02, `${names[k]}: half of the slider is half of its light within ${percent(worst)} of the mean; it brings ${percent(change)}`);
  }
  expect(await lamps.count() >= names.length, 'each lamp has a slider');
  const times = await page.evaluate(async (count) => {
    const frame = () => new Promise((done) => { requestAnimationFrame(done); });
    const found = [];
    for (let i = 0, last = await frame(); i < 30; i += 1) {
      const input = document.querySelectorAll('#panel input[type=range]')[i < 15 ? 0 : count - 1];
      input.value = 30 + 5 * i;
      input.dispatchEvent(new Event('input', { bubbles: true }));
      const now = await frame();
      found.push(now - last);
      last = now;
    }
    return found;
  }, names.length);
  console.log(`     frames while a slider moves: ${median(times).toFixed(0)} ms (median), at most ${Math.max(...times).toFixed(0)} ms`);
}

// Keys alone reach and move everything, and what is read is announced.
async function keyboard(page) {
  const wanted = await page.evaluate(() => document.querySelectorAll('canvas, summary, #panel input, #panel select, #panel button').length);
  const reached = new Set();
  await page.evaluate(() => document.activeElement?.blur());
  for (let i = 0; i < wanted + 3; i += 1) {
    await page.keyboard.press('Tab');
    reached.add(await page.evaluate(() => {
      const all = [...document.querySelectorAll('canvas, summary, #panel input, #panel select, #panel button')];
      return all.indexOf(document.activeElement);
    }));
  }
  reached.delete(-1);
  expect(reached.size === wanted, `Tab reaches ${reached.size} of ${wanted} controls`);
  const exposure = page.getByLabel('Exposure');
  await exposure.focus();
  await page.keyboard.press('ArrowRight');
  expect(await exposure.inputValue() === '0.1', 'arrow keys move a slider');
  const eye = () => page.evaluate(() => window.hemicube.app.camera.matrixWorld.elements.join());
  for (const key of ['ArrowLeft', 'ArrowUp', '+', 'w', 'd', 'e']) {
    const before = await eye();
    await page.locator('canvas').focus();
    await page.keyboard.press(key);
    await page.evaluate(() => window.hemicube.app.draw());
    expect(await eye() !== before, `${key} moves the camera`);
  }
  await page.keyboard.press('Enter');
  const spoken = await page.locator('#spoken').textContent();
  expect(/^Middle: ([\d.]+ lx on .+|No surface there\.)$/.test(spoken), `Enter announces "${spoken}"`);
  await page.getByText('As it was').focus();
  await page.keyboard.press('Enter');
  expect(await exposure.inputValue() === '0', 'a button is pressed by a key');
}

// What axe-core finds wrong for people who see or hear otherwise.
async function access(page) {
  await page.evaluate(await readFile(AXE, 'utf8'));
  const { violations } = await page.evaluate(() => window.axe.run(document));
  violations.forEach(({ id, help, nodes }) => console.log(`  ${id}: ${help}: ${nodes[0].html}`));
  expect(violations.length === 0, `axe-core finds ${violations.length} faults`);
}

const browser = await launch();
try {
  const { page, complaints, seconds } = await open(browser, { width: 1280, height: 800 });
  console.log(`     the first frame after ${seconds.toFixed(2)} s`);
  await picture(page);
  await sliders(page);
  await page.getByText('As it was').click();
  await readings(page);
  await page.getByText('As it was').click();
  await keyboard(page);
  await access(page);
  for (const name of [/^Illuminance in colours/, /^Patches/]) await page.getByLabel(name).check();
  await access(page);
  expect(complaints.length === 0, `no complaints ${complaints.join('; ')}`);
  const phone = await open(browser, { width: 390, height: 844 });
  const overflow = await phone.page.evaluate(() => document.documentElement.scrollWidth - innerWidth);
  expect(overflow <= 0, 'nothing lies beyond the width of a phone');
  await phone.page.locator('summary').click();
  expect(await phone.page.getByLabel('Exposure').isVisible(), 'the controls open on a phone');
  await access(phone.page);
  expect(phone.complaints.length === 0, `no complaints on a phone ${phone.complaints.join('; ')}`);
} finally {
  await browser.close();
}
process.exitCode = faults.length === 0 ? 0 : 1;
