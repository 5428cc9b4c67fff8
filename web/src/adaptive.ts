// The paper's adaptive subdivision, with its tolerance as a slider: a patch that any other sees under
// a larger form factor is split.
import type { Panel, Slider } from './panel';
import { significant } from './panel';

// Milliseconds that a tolerance rests before it is wished for.
const REST = 250;

// The largest one that Kulyasov & Nikulin found no fault with.
const TOLERANCE = 0.02;

export class Adaptive {
  private root: HTMLElement;
  private check: HTMLInputElement;
  private slider: Slider;
  private timer = 0;

  // `wish` is told a tolerance, or null for uniform patches.
  constructor(panel: Panel, private wish: (tolerance: number | null) => Promise<void>) {
    const section = panel.section('Subdivision');
    this.root = section.root;
    this.check = section.check('Adaptive, driven by form factors', () => this.wished());
    this.slider = section.slider('Largest form factor', {
      low: -3.5, high: -0.3, step: 0.05, value: Math.log10(TOLERANCE), text: (power) => significant(10 ** power),
      changed: () => {
        if (this.check.checked) this.wished();
      },
    });
    this.root.hidden = true;
  }

  // Shows what the program makes, unless something else is about to be wished for.
  follow(splits: boolean, tolerance: number | null): void {
    this.root.hidden = !splits;
    if (this.timer !== 0) return;
    this.check.checked = tolerance !== null;
    if (tolerance !== null) this.slider.set(Math.log10(tolerance));
  }

  private wished(): void {
    clearTimeout(this.timer);
    const timer = this.timer = setTimeout(() => {
      this.wish(this.check.checked ? 10 ** this.slider.value() : null).finally(() => {
        if (this.timer === timer) this.timer = 0;
      });
    }, REST);
  }
}
