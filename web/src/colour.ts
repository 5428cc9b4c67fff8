// Colours of controls, sRGB in hexadecimal, and linear light.
import type { Triple } from './page';

export function hex(colour: Triple): string {
  const code = (c: number) => {
    const x = Math.min(Math.max(c, 0), 1);
    return Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055));
  };
  return `#${colour.map((c) => code(c).toString(16).padStart(2, '0')).join('')}`;
}

export function linear(text: string): Triple {
  const channel = (at: number) => {
    const x = parseInt(text.slice(at, at + 2), 16) / 255;
    return x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
  };
  return [channel(1), channel(3), channel(5)];
}
