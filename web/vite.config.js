import { defineConfig } from 'vite';

// One script without imports, which the program puts into pages.
export default defineConfig({
  build: {
    target: 'es2022',
    sourcemap: false,
    reportCompressedSize: false,
    lib: { entry: 'src/main.ts', formats: ['iife'], name: 'hemicube', fileName: () => 'page.js' },
  },
});
