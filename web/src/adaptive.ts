// The paper's adaptive subdivision, with its tolerance as a slider: a patch that any other sees under
// a larger form factor is split.
import type { Panel, Slider } from './panel';
import { significant } from './panel';

// Milliseconds that a tolerance rests before it is wished for.
const REST = 250;

// What is to be done: `wish` is told a tolerance, or null for uniform patches.
interface Told { ticked: () => void; wish: (tolerance: number | null) => Promise<void> }

export class Adaptive {
  private root: HTMLElement;
  private check: HTMLInputElement;
  private slider: Slider;
  // At first the largest one that Kulyasov & Nikulin found no fault with. The slider has steps.
  private tolerance = 0.02;
  private timer = 0;

  constructor(panel: Panel, private told: Told) {
    const section = panel.section('Subdivision');
    this.root = section.root;
    this.check = section.check('Adaptive, driven by form factors', (on) => {
      if (on) told.ticked();
      this.wished();
    });
    this.slider = section.slider('Largest form factor', {
      low: -3.5, high: -0.3, step: 0.05, value: Math.log10(this.tolerance), text: (power) => significant(10 ** power),
      changed: () => {
        this.tolerance = 10 ** this.slider.value();
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
    if (tolerance === null || tolerance === this.tolerance) return;
    this.tolerance = tolerance;
    this.slider.set(Math.log10(tolerance));
  }

  private wished(): void {
    clearTimeout(this.timer);
    const timer = this.timer = setTimeout(() => {
      this.told.wish(this.check.checked ? this.tolerance : null).finally(() => {
        if (this.timer === timer) this.timer = 0;
      });
    }, REST);
  }
}
