import { readFileSync } from 'node:fs';
import { defineConfig } from 'vite';

// One script without imports, which the program puts into pages, with the licence of what is in it.
const licence = readFileSync(new URL('node_modules/three/LICENSE', import.meta.url), 'utf8').trim();
const banner = `/*!\nthree.js: ${licence}\n*/`;

export default defineConfig({
  build: {
    target: 'es2022',
    sourcemap: false,
    reportCompressedSize: false,
    lib: { entry: 'src/main.ts', formats: ['iife'], name: 'hemicube', fileName: () => 'page.js' },
    rolldownOptions: { output: { postBanner: banner } },
  },
});
