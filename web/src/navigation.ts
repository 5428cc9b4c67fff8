// Moves a camera: around what it looks at, or through the model on foot. Pointers, wheel and keys.
import { Quaternion, Spherical, Vector3, type PerspectiveCamera } from 'three';
import type { Camera } from './page';

export type Way = 'orbit' | 'walk';

// Radians a pixel, and a press of a key.
const TURN = 0.005;
const KEY_TURN = Math.PI / 36;
const STEEPEST = Math.PI / 2 - 0.01;

export class Navigation {
  way: Way = 'orbit';
  readonly target = new Vector3();
  private pointers = new Map<number, { x: number; y: number }>();
  private up = new Vector3(0, 1, 0);
  private lens = { vfov: 1, aspect: 1 };

  constructor(private camera: PerspectiveCamera, private canvas: HTMLElement, private size: number, private moved: () => void) {
    canvas.addEventListener('pointerdown', (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    });
    const gone = (event: PointerEvent) => this.pointers.delete(event.pointerId);
    canvas.addEventListener('pointerup', gone);
    canvas.addEventListener('pointercancel', gone);
    canvas.addEventListener('pointermove', (event) => this.drag(event));
    canvas.addEventListener('wheel', (event) => {
      event.preventDefault();
      this.forward(-event.deltaY * (event.deltaMode === 1 ? 20 : 1) / 600);
    }, { passive: false });
    canvas.addEventListener('keydown', (event) => this.press(event));
  }

  // Stands where a camera of the model does.
  take({ eye, target, up, vfov, aspect }: Camera): void {
    this.up.fromArray(up);
    this.camera.up.copy(this.up);
    this.camera.position.fromArray(eye);
    this.target.fromArray(target);
    this.lens = { vfov, aspect };
    this.widen(this.camera.aspect);
  }

  // Fits a picture of that width over height around all that the model's camera sees.
  widen(aspect: number): void {
    this.camera.aspect = aspect;
    const half = Math.tan(this.lens.vfov / 2) * Math.max(this.lens.aspect / aspect, 1);
    this.camera.fov = 2 * Math.atan(half) * 180 / Math.PI;
    this.look();
  }

  // Whether a pointer is pressed on the picture.
  get dragging(): boolean {
    return this.pointers.size > 0;
  }

  private drag(event: PointerEvent): void {
    const last = this.pointers.get(event.pointerId);
    if (!last) return;
    const [dx, dy] = [event.clientX - last.x, event.clientY - last.y];
    const before = this.spread();
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
    if (this.pointers.size > 1) {
      this.forward((this.spread() - before) / 200);
      this.pan(-dx / 2, dy / 2);
    } else if (event.buttons & 6 || event.shiftKey) this.pan(-dx, dy);
    else this.turn(dx * TURN, dy * TURN);
  }

  private spread(): number {
    const [a, b] = [...this.pointers.values()];
    return b ? Math.hypot(a.x - b.x, a.y - b.y) : 0;
  }

  // Turns around what is looked at, or looks around, as if the picture were dragged (radians).
  private turn(right: number, down: number): void {
    const offset = this.camera.position.clone().sub(this.target);
    const frame = new Vector3(0, 1, 0);
    const upright = offset.applyQuaternion(quaternionTo(this.up, frame));
    const at = new Spherical().setFromVector3(upright);
    const sign = this.way === 'orbit' ? -1 : 1;
    at.theta += sign * right;
    at.phi += sign * down;
    at.phi = Math.min(Math.max(at.phi, Math.PI / 2 - STEEPEST), Math.PI / 2 + STEEPEST);
    const back = new Vector3().setFromSpherical(at).applyQuaternion(quaternionTo(frame, this.up));
    if (this.way === 'orbit') this.camera.position.copy(this.target).add(back);
    else this.target.copy(this.camera.position).sub(back);
    this.look();
  }

  // Nearer to what is looked at, or a step on.
  private forward(step: number): void {
    const ahead = this.target.clone().sub(this.camera.position);
    if (this.way === 'orbit') {
      this.camera.position.addScaledVector(ahead, 1 - Math.exp(-step));
    } else {
      const stride = ahead.normalize().multiplyScalar(step * this.size / 8);
      this.camera.position.add(stride);
      this.target.add(stride);
    }
    this.look();
  }

  // Sideways, in pixels.
  private pan(right: number, up: number): void {
    const depth = this.camera.position.distanceTo(this.target);
    const pixel = 2 * depth * Math.tan(this.camera.fov * Math.PI / 360) / this.canvas.clientHeight;
    this.shift(right * pixel, up * pixel);
  }

  private shift(right: number, up: number): void {
    const across = new Vector3().setFromMatrixColumn(this.camera.matrix, 0).multiplyScalar(right);
    across.addScaledVector(this.way === 'walk' ? this.up : new Vector3().setFromMatrixColumn(this.camera.matrix, 1), up);
    this.camera.position.add(across);
    this.target.add(across);
    this.look();
  }

  private press(event: KeyboardEvent): void {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const stride = this.size / 40;
    const actions: Record<string, () => void> = {
      ArrowLeft: () => this.turn(KEY_TURN, 0), ArrowRight: () => this.turn(-KEY_TURN, 0),
      ArrowUp: () => this.turn(0, KEY_TURN), ArrowDown: () => this.turn(0, -KEY_TURN),
      '+': () => this.forward(0.2), '=': () => this.forward(0.2), '-': () => this.forward(-0.2),
      w: () => this.forward(0.2), s: () => this.forward(-0.2),
      a: () => this.shift(-stride, 0), d: () => this.shift(stride, 0),
      q: () => this.shift(0, -stride), e: () => this.shift(0, stride),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  private look(): void {
    this.camera.lookAt(this.target);
    this.camera.updateMatrix();
    const depth = this.camera.position.distanceTo(this.target);
    this.camera.near = Math.min(depth, this.size) / 200;
    this.camera.far = depth + 20 * this.size;
    this.camera.updateProjectionMatrix();
    this.moved();
  }
}

// The turn that takes one direction to another.
function quaternionTo(from: Vector3, to: Vector3): Quaternion {
  return new Quaternion().setFromUnitVectors(from.clone().normalize(), to.clone().normalize());
}
