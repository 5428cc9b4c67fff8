// Fewer pixels while something moves, where the machine is slow; all of them once it rests.
import type { WebGLRenderer } from 'three';

// Milliseconds a frame may take, and after which a picture rests.
const SLOW = 40;
const QUICK = 20;
const REST = 250;
const FEWEST = 0.35;

export class Pace {
  private share = 1;
  private last = -Infinity;
  // Of several frames, as long and short ones alternate.
  private mean = (SLOW + QUICK) / 2;
  private timer = 0;

  constructor(private renderer: WebGLRenderer, private redraw: () => void) {}

  // To be called before each frame, with its time.
  frame(now: number): void {
    const took = now - this.last;
    this.last = now;
    clearTimeout(this.timer);
    if (took < 2 * REST) {
      this.mean += (took - this.mean) / 3;
      if (this.mean > SLOW) this.share = Math.max(this.share * Math.max(Math.sqrt(SLOW / this.mean), 0.7), FEWEST);
      else if (this.mean < QUICK) this.share = Math.min(this.share * 1.05, 1);
      this.fit(this.share);
    }
    this.timer = setTimeout(() => {
      if (this.fit(1)) this.redraw();
    }, REST);
  }

  // Draws with a share of the pixels across and down; whether that is a change.
  private fit(share: number): boolean {
    const ratio = share * Math.min(devicePixelRatio, 2);
    const now = this.renderer.getPixelRatio();
    if (share < 1 ? Math.abs(ratio / now - 1) < 0.08 : ratio === now) return false;
    this.renderer.setPixelRatio(ratio);
    return true;
  }
}
