// Checks that baked glTF files are valid and that three.js shows their light rightly.
// Usage: node check.mjs FOLDER, with pairs NAME.glb and NAME.points.json in it.
import { readdir, readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join } from 'node:path';
import { validateBytes } from 'gltf-validator';
import { hear, launch } from './browser.mjs';

const TOLERANCE = 0.02;
const HERE = import.meta.dirname;
const ENDING = /\.(glb|points\.json)$/;
const SEVERITIES = ['error', 'warning', 'info', 'hint'];
const ALLOWED_INFOS = /^(UNUSED_|UNSUPPORTED_EXTENSION$)/;
const TYPES = { '.html': 'text/html', '.mjs': 'text/javascript', '.js': 'text/javascript', '.glb': 'model/gltf-binary' };

// Serves the page, three.js and the models of the folder on the loopback address.
function serve(folder) {
  const roots = { three: join(HERE, 'node_modules/three'), models: folder };
  const server = createServer(async (request, response) => {
    try {
      const [root, ...path] = decodeURIComponent(request.url).slice(1).split('/');
      const file = path.length ? join(roots[root], ...path) : join(HERE, root);
      const content = await readFile(file);
      response.setHeader('content-type', TYPES[extname(file)] ?? 'application/octet-stream').end(content);
    } catch {
      response.writeHead(404).end();
    }
  });
  return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

// The messages of the Khronos validator, one of each kind: [faults, notes].
async function validate(file) {
  const { issues } = await validateBytes(await readFile(file), { format: 'glb', maxIssues: 0 });
  const faults = [];
  const notes = [];
  for (const code of new Set(issues.messages.map((issue) => issue.code))) {
    const same = issues.messages.filter((issue) => issue.code === code);
    const [{ severity, message, pointer, offset }] = same;
    const line = `validator: ${SEVERITIES[severity]} ${code} (${same.length}), first at ${pointer ?? offset}: ${message}`;
    if (severity < 2) faults.push(line);
    else if (!ALLOWED_INFOS.test(code)) notes.push(line);
  }
  return [faults, notes];
}

// The colours that three.js shows at the points, and what the page complained of.
async function show(browser, address, name, sample) {
  const page = await browser.newPage();
  const faults = [];
  let shown = [];
  hear(page, faults);
  try {
    await page.goto(`${address}/page.html`);
    shown = await page.evaluate(([url, wanted]) => window.look(url, wanted), [`/models/${encodeURIComponent(name)}.glb`, sample]);
  } catch (error) {
    faults.push(error.message.split('\n')[0]);
  }
  await page.close();
  return [shown, faults];
}

// How far the shown colours are from the baked ones: [summary, faults].
function compare(shown, { points, scale }) {
  const wanted = points.map(({ radiance }) => radiance.map((value) => scale * value));
  const luminances = wanted.map(([r, g, b]) => 0.2126 * r + 0.7152 * g + 0.0722 * b);
  const mean = luminances.reduce((sum, value) => sum + value, 0) / points.length;
  const faults = [];
  let squares = 0;
  let worst = 0;
  wanted.forEach((colour, i) => {
    const errors = colour.map((value, c) => Math.abs(shown[i][c] - value));
    squares += errors.reduce((sum, error) => sum + error * error, 0);
    worst = Math.max(worst, ...errors);
    const good = errors.every((error, c) => error <= TOLERANCE * Math.max(colour[c], mean));
    const seen = shown[i][3] > 0 ? `shows ${digits(shown[i].slice(0, 3))}` : 'shows nothing';
    if (!good || shown[i][3] === 0) faults.push(`point ${i} at ${digits(points[i].position)} ${seen}, not ${digits(colour)}`);
  });
  const percent = (value) => `${(100 * value / mean).toFixed(2)} %`;
  const rms = Math.sqrt(squares / (3 * points.length));
  const summary = `${points.length} points, RMS ${percent(rms)}, worst ${percent(worst)} of the mean, `
    + `${faults.length} beyond ${100 * TOLERANCE} %`;
  return [summary, faults];
}

const digits = (values) => values.map((value) => value.toPrecision(4)).join(' ');

// Checks one pair, prints the result and says whether all is well.
async function check(browser, address, folder, name) {
  const sample = JSON.parse(await readFile(join(folder, `${name}.points.json`)));
  const [invalid, notes] = await validate(join(folder, `${name}.glb`));
  const [shown, complaints] = await show(browser, address, name, sample);
  const faults = [...invalid, ...complaints];
  let summary = 'not shown';
  if (shown.length > 0) {
    const [result, wrong] = compare(shown, sample);
    summary = result;
    faults.push(...wrong.slice(0, 8));
  } else {
    faults.push('no point was looked at');
  }
  console.log(`${faults.length === 0 ? 'good' : 'BAD '} ${name} (${sample.mode}): ${summary}`);
  faults.forEach((fault) => console.log(`  ${fault}`));
  notes.forEach((note) => console.log(`  note: ${note}`));
  return faults.length === 0;
}

async function main(folder) {
  const files = (await readdir(folder)).sort();
  const names = [...new Set(files.filter((file) => ENDING.test(file)).map((file) => file.replace(ENDING, '')))];
  if (names.length === 0) throw new Error(`no glb file in ${folder}`);
  const server = await serve(folder);
  const address = `http://127.0.0.1:${server.address().port}`;
  const browser = await launch();
  let bad = 0;
  try {
    for (const name of names) bad += await check(browser, address, folder, name) ? 0 : 1;
  } finally {
    await browser.close();
    server.close();
  }
  console.log(`${names.length} files, ${bad} bad`);
  process.exitCode = bad === 0 ? 0 : 1;
}

if (process.argv.length !== 3) throw new Error('usage: node check.mjs FOLDER');
await main(process.argv[2]);
