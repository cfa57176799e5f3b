// Cached picture of the map, a little larger than the view. When the map moves, the picture moves. A new one is drawn
// off screen, a few milliseconds in each frame, and replaces the old one when it is complete.

/** Drawing time in a frame in milliseconds. */
const BUDGET = 9;
/** Margin of the picture on each side as a fraction of the view. */
const MARGIN = 0.25;

/** @typedef {{canvas: HTMLCanvasElement, frame: Frame, theme: MapTheme}} Tile */

class TileStore {
  /** @param {BasePainter} painter */
  constructor(painter) {
    this.painter = painter;
    /** @type {Tile|null} */
    this.front = null;
    /** @type {{tile: Tile, steps: Generator<void, void, void>, spent: number}|null} */
    this.back = null;
    /** @type {HTMLCanvasElement|null} */
    this.spare = null;
    this.lastPaint = 0;
  }

  /** @param {Frame} view @param {number} ratio device pixels per CSS pixel @param {MapTheme} theme */
  begin(view, ratio, theme) {
    const canvas = this.spare ?? this.back?.tile.canvas ?? document.createElement('canvas');
    this.spare = null;
    const width = Math.ceil(view.width * (1 + 2 * MARGIN));
    const height = Math.ceil(view.height * (1 + 2 * MARGIN));
    const [wide, high] = [Math.max(1, Math.round(width * ratio)), Math.max(1, Math.round(height * ratio))];
    if (canvas.width !== wide || canvas.height !== high) {
      canvas.width = wide;
      canvas.height = high;
    }
    const frame = { x: view.x, y: view.y, k: view.k, width, height };
    const context = canvas.getContext('2d', { alpha: false });
    if (!context) return;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.back = { tile: { canvas, frame, theme }, steps: this.painter.paint(context, frame, theme), spent: 0 };
  }

  /**
   * Checks whether a picture covers the whole view at a sufficient resolution.
   *
   * @param {Tile|undefined|null} tile
   * @param {Frame} view
   * @param {MapTheme} theme
   */
  static suits(tile, view, theme) {
    if (!tile || tile.theme !== theme) return false;
    const { frame } = tile;
    const spareX = (frame.width - view.width) / 2;
    const spareY = (frame.height - view.height) / 2;
    const moved = Math.max(Math.abs(view.x - frame.x) * view.k - spareX, Math.abs(view.y - frame.y) * view.k - spareY);
    return Math.abs(frame.k / view.k - 1) < 1e-9 && spareX >= 0 && spareY >= 0 && moved <= 0.5;
  }

  /**
   * Checks whether to continue a picture instead of starting another one.
   *
   * @param {Tile} tile
   * @param {Frame} view
   * @param {MapTheme} theme
   */
  static isOfUse(tile, view, theme) {
    if (tile.theme !== theme) return false;
    const ratio = tile.frame.k / view.k;
    const moved = Math.max(
      Math.abs(view.x - tile.frame.x) / tile.frame.width,
      Math.abs(view.y - tile.frame.y) / tile.frame.height,
    );
    return ratio > 0.6 && ratio < 1.7 && moved * view.k < 0.7;
  }

  /**
   * Continues drawing.
   *
   * @param {Frame} view
   * @param {number} ratio
   * @param {MapTheme} theme
   * @param {number} budget
   * @returns {boolean} whether there is more to do
   */
  advance(view, ratio, theme, budget) {
    if (TileStore.suits(this.front, view, theme) && !this.back) return false;
    if (!this.back || !TileStore.isOfUse(this.back.tile, view, theme)) {
      if (TileStore.suits(this.front, view, theme)) {
        this.back = null;
        return false;
      }
      this.begin(view, ratio, theme);
    }
    const { back } = this;
    if (!back) return false;
    const began = performance.now();
    let now = began;
    while (now - began < budget) {
      if (back.steps.next().done) {
        this.spare = this.front?.canvas ?? null;
        this.front = back.tile;
        this.back = null;
        this.lastPaint = back.spent + performance.now() - began;
        return !TileStore.suits(this.front, view, theme);
      }
      now = performance.now();
    }
    back.spent += now - began;
    return true;
  }

  /** Drops pictures of another size or resolution. */
  clear() {
    this.front = null;
    this.back = null;
    this.spare = null;
  }

  /** @param {CanvasRenderingContext2D} context @param {Frame} view @param {MapTheme} theme */
  draw(context, view, theme) {
    const { front } = this;
    const { frame } = front ?? {};
    const exact = front !== null && TileStore.suits(front, view, theme);
    if (!exact) {
      context.fillStyle = theme.ground;
      context.fillRect(0, 0, view.width, view.height);
    }
    if (!front || !frame) return;
    const ratio = view.k / frame.k;
    const [width, height] = [frame.width * ratio, frame.height * ratio];
    let left = (frame.x - view.x) * view.k + view.width / 2 - width / 2;
    let top = (view.y - frame.y) * view.k + view.height / 2 - height / 2;
    if (exact) {
      // The offset is a whole number of device pixels, because otherwise the picture is blurred.
      const device = context.canvas.width / view.width;
      left = Math.round(left * device) / device;
      top = Math.round(top * device) / device;
    }
    context.imageSmoothingEnabled = !exact;
    context.imageSmoothingQuality = 'low';
    context.drawImage(front.canvas, left, top, width, height);
  }
}
