// Headless Chromium that draws by software and asks no network.
import { readFile } from 'node:fs/promises';
import { chromium } from 'playwright-core';

const FLAGS = [
  '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--use-gl=angle', '--use-angle=swiftshader',
  '--enable-unsafe-swiftshader', '--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1',
];
const DRIVER_CHATTER = /GPU stall due to ReadPixels|software WebGL|GroupMarkerNotSet/;

export function launch() {
  return chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: FLAGS });
}

// Puts what a page complains of into a list.
export function hear(page, faults) {
  page.on('console', (message) => {
    const bad = ['warning', 'error'].includes(message.type()) && !DRIVER_CHATTER.test(message.text());
    if (bad) faults.push(`page: ${message.type()}: ${message.text()}`);
  });
  page.on('pageerror', (error) => faults.push(`page: ${error.message}`));
}

// Differences between the pixels of a page of ours and those of a picture, 0..255: a function of the
// share of pixels that differ by less.
export async function differences(page, file) {
  const encoded = (await readFile(file)).toString('base64');
  const found = await page.evaluate(async (png) => {
    const { app, resize } = window.hemicube;
    const { canvas } = app;
    const image = new Image();
    image.src = `data:image/png;base64,${png}`;
    await image.decode();
    resize(image.width, image.height);
    app.draw();
    const pixels = [canvas, image].map((source) => {
      const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
      context.drawImage(source, 0, 0, image.width, image.height);
      return context.getImageData(0, 0, image.width, image.height).data;
    });
    const all = [];
    for (let i = 0; i < pixels[0].length; i += 4) {
      all.push(Math.max(...[0, 1, 2].map((c) => Math.abs(pixels[0][i + c] - pixels[1][i + c]))));
    }
    resize(canvas.clientWidth, canvas.clientHeight);
    return all.sort((a, b) => a - b);
  }, encoded);
  return (share) => found[Math.floor(share * (found.length - 1))];
}
