// Fewer pixels while something moves, where the machine is slow; all of them once it rests.
import type { WebGLRenderer } from 'three';

// Milliseconds a frame may take, and after which a picture rests.
const SLOW = 40;
const QUICK = 20;
const REST = 200;
const FEWEST = 0.35;

export class Pace {
  private share = 1;
  private last = -Infinity;
  private timer = 0;

  constructor(private renderer: WebGLRenderer, private redraw: () => void) {}

  // To be called before each frame, with its time.
  frame(now: number): void {
    const took = now - this.last;
    this.last = now;
    clearTimeout(this.timer);
    if (took < REST) {
      if (took > SLOW) this.share = Math.max(this.share * Math.max(Math.sqrt(SLOW / took), 0.5), FEWEST);
      else if (took < QUICK) this.share = Math.min(this.share * 1.1, 1);
      this.fit(this.share);
    }
    this.timer = setTimeout(() => {
      if (this.fit(1)) this.redraw();
    }, REST);
  }

  // Draws with a share of the pixels across and down; whether that is a change.
  private fit(share: number): boolean {
    const ratio = share * Math.min(devicePixelRatio, 2);
    if (Math.abs(ratio - this.renderer.getPixelRatio()) < 0.02) return false;
    this.renderer.setPixelRatio(ratio);
    return true;
  }
}
