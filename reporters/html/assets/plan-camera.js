// Camera of the map: the visible part, movement by pointer and wheel, and flights to a place.

const LEAST_SCALE = 1e-7;
/** Maximum scale in pixels per centimetre. */
const GREATEST_SCALE = 8;
const FLIGHT_MILLISECONDS = 320;

class Camera {
  /** @param {() => void} changed */
  constructor(changed) {
    this.x = 0;
    this.y = 0;
    /** Pixels per centimetre. */
    this.k = 0.01;
    this.width = 1;
    this.height = 1;
    /** Pixels on the right that are hidden by a panel. */
    this.hidden = 0;
    this.changed = changed;
    /** @type {{from: {x: number, y: number, k: number}, to: {x: number, y: number, k: number}, began: number, done: () => void}|null} */
    this.flight = null;
    this.reduced = matchMedia('(prefers-reduced-motion: reduce)');
  }

  /**
   * Returns the frame of the whole canvas. `x` and `y` are the middle of the part that is not hidden.
   *
   * @returns {Frame}
   */
  frame() {
    return { x: this.x + this.hidden / 2 / this.k, y: this.y, k: this.k, width: this.width, height: this.height };
  }

  /** @param {number} k */
  static clamp(k) {
    return Math.min(GREATEST_SCALE, Math.max(LEAST_SCALE, Number.isFinite(k) ? k : 0.01));
  }

  /** @param {number} dx pixels @param {number} dy */
  pan(dx, dy) {
    this.land();
    this.x -= dx / this.k;
    this.y += dy / this.k;
    this.changed();
  }

  /** @param {number} factor @param {number} [px] pixel that stays fixed @param {number} [py] */
  zoom(factor, px = (this.width - this.hidden) / 2, py = this.height / 2) {
    this.land();
    const k = Camera.clamp(this.k * factor);
    const offsetX = px - (this.width - this.hidden) / 2;
    const offsetY = this.height / 2 - py;
    this.x += offsetX / this.k - offsetX / k;
    this.y += offsetY / this.k - offsetY / k;
    this.k = k;
    this.changed();
  }

  /**
   * Returns the scale at which a box around a point is completely visible.
   *
   * @param {number} halfWidth cm
   * @param {number} halfHeight
   */
  scaleFor(halfWidth, halfHeight) {
    const free = Math.max(80, this.width - this.hidden);
    return Camera.clamp(
      Math.min((free * 0.44) / Math.max(halfWidth, 1), (this.height * 0.42) / Math.max(halfHeight, 1)),
    );
  }

  /** @param {Box} box @returns {Promise<void>} */
  fit(box) {
    const [x, y] = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    return this.fly(x, y, this.scaleFor((box[2] - box[0]) / 2, (box[3] - box[1]) / 2));
  }

  /** @param {number} x @param {number} y @param {number} k @returns {Promise<void>} resolves on arrival */
  fly(x, y, k) {
    this.land();
    const to = { x, y, k: Camera.clamp(k) };
    const far = Math.hypot(x - this.x, y - this.y) * Math.min(this.k, to.k) > 4 * this.width;
    if (this.reduced.matches || document.hidden || far) {
      Object.assign(this, to);
      this.changed();
      return Promise.resolve();
    }
    return new Promise((resolve) => {
      this.flight = { from: { x: this.x, y: this.y, k: this.k }, to, began: performance.now(), done: resolve };
      this.changed();
    });
  }

  /** Ends a flight at the current position. */
  land() {
    const { flight } = this;
    this.flight = null;
    flight?.done();
  }

  /** Moves the camera; returns true during a flight. @param {number} now */
  step(now) {
    const { flight } = this;
    if (!flight) return false;
    const part = Math.min(1, Math.max(0, (now - flight.began) / FLIGHT_MILLISECONDS));
    if (part >= 1 || document.hidden) {
      Object.assign(this, flight.to);
      this.land();
      return false;
    }
    const eased = part < 0.5 ? 4 * part ** 3 : 1 - (2 - 2 * part) ** 3 / 2;
    const { from, to } = flight;
    this.k = from.k * (to.k / from.k) ** eased;
    // The target moves evenly over the screen while the scale changes.
    const ratio = to.k / from.k;
    const share = Math.abs(ratio - 1) < 1e-3 ? eased : ((this.k - from.k) / (to.k - from.k)) * (to.k / this.k);
    this.x = from.x + (to.x - from.x) * share;
    this.y = from.y + (to.y - from.y) * share;
    return true;
  }
}

/** Pointer, wheel and pinch on a canvas. */
class CameraInput {
  /**
   * @param {HTMLCanvasElement} canvas @param {Camera} camera
   * @param {(x: number, y: number) => void} clicked @param {(x: number, y: number, inside: boolean) => void} moved
   */
  constructor(canvas, camera, clicked, moved) {
    this.canvas = canvas;
    this.camera = camera;
    this.clicked = clicked;
    this.moved = moved;
    /** @type {Map<number, {x: number, y: number}>} */
    this.pointers = new Map();
    this.travelled = 0;
    canvas.addEventListener('pointerdown', (event) => this.down(event));
    canvas.addEventListener('pointermove', (event) => this.move(event));
    canvas.addEventListener('pointerup', (event) => this.up(event, true));
    canvas.addEventListener('pointercancel', (event) => this.up(event, false));
    canvas.addEventListener('pointerleave', () => moved(0, 0, false));
    canvas.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    canvas.addEventListener('dblclick', (event) => camera.zoom(event.shiftKey ? 0.5 : 2, event.offsetX, event.offsetY));
  }

  /** @param {PointerEvent} event */
  down(event) {
    if (event.button > 1) return;
    this.canvas.setPointerCapture(event.pointerId);
    if (this.pointers.size === 0) this.travelled = 0;
    this.pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    this.canvas.classList.add('dragged');
  }

  /** @param {PointerEvent} event */
  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) {
      this.moved(event.offsetX, event.offsetY, true);
      return;
    }
    const [dx, dy] = [event.offsetX - before.x, event.offsetY - before.y];
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId).map(([, point]) => point);
    this.travelled += Math.hypot(dx, dy);
    if (others[0]) {
      const distance = (/** @type {{x: number, y: number}} */ point) =>
        Math.hypot(point.x - (others[0]?.x ?? 0), point.y - (others[0]?.y ?? 0));
      const now = { x: event.offsetX, y: event.offsetY };
      const middle = { x: (now.x + others[0].x) / 2, y: (now.y + others[0].y) / 2 };
      this.camera.pan(dx / 2, dy / 2);
      this.camera.zoom(Math.max(distance(now), 8) / Math.max(distance(before), 8), middle.x, middle.y);
    } else if (this.travelled > 3) {
      this.camera.pan(dx, dy);
    }
    before.x = event.offsetX;
    before.y = event.offsetY;
  }

  /** @param {PointerEvent} event @param {boolean} meant */
  up(event, meant) {
    const known = this.pointers.delete(event.pointerId);
    if (this.pointers.size === 0) this.canvas.classList.remove('dragged');
    if (known && meant && this.travelled <= 3 && this.pointers.size === 0) this.clicked(event.offsetX, event.offsetY);
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 16 : event.deltaMode === 2 ? 400 : 1;
    const amount = Math.max(-300, Math.min(300, event.deltaY * lines));
    this.camera.zoom(Math.exp(-amount * (event.ctrlKey ? 0.01 : 0.0018)), event.offsetX, event.offsetY);
  }
}
