// Headless Chromium that draws by software and asks no network.
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
