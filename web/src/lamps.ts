// A slider and a colour for each source of light.
import { hex, linear } from './colour';
import type { Panel, Slider } from './panel';
import type { Source, Triple } from './page';

// Sliders reach this many times what a source emitted at first.
const MOST = 4;

export class Lamps {
  private sliders: Slider[];
  private strengths: number[];
  private colours: Triple[];

  constructor(panel: Panel, private sources: Source[], changed: () => void) {
    const strongest = Math.max(...sources.map(({ weight }) => Math.max(...weight)), 0) || 1;
    // A source that is dark yet begins as bright as the brightest.
    this.strengths = sources.map(({ weight }) => Math.max(...weight) || strongest);
    this.colours = sources.map(({ weight }, k) => (Math.max(...weight) > 0 ? scaled(weight, 1 / this.strengths[k]) : [1, 1, 1]));
    this.sliders = sources.map(({ name, weight, keepsColour }, k) => panel.slider(name, {
      low: 0, high: 100 * MOST, step: 1, value: Math.max(...weight) > 0 ? 100 : 0,
      text: (value) => `${value} %`, changed,
      colour: keepsColour ? undefined : hex(this.colours[k]),
    }));
  }

  // By what each layer is to be multiplied.
  weights(): Triple[] {
    return this.sliders.map((slider, k) => {
      const first = hex(this.colours[k]);
      const { colour } = slider;
      // Eight bits know the first colour less well than the scene does.
      const own = !colour || colour.value === first ? this.colours[k] : linear(colour.value);
      return scaled(own, this.strengths[k] * slider.value() / 100);
    });
  }

  reset(): void {
    this.sliders.forEach((slider, k) => {
      slider.set(Math.max(...this.sources[k].weight) > 0 ? 100 : 0);
      if (slider.colour) slider.colour.value = hex(this.colours[k]);
    });
  }
}

function scaled([r, g, b]: Triple, by: number): Triple {
  return [r * by, g * by, b * by];
}
