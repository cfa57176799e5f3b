// Plots of values along a road: elevation, widths of lanes.

/**
 * pairs of s and value in cm; s counts from `from`
 *
 * @typedef {object} ProfileLine
 * @property {string} name
 * @property {string} color
 * @property {Float64Array} pairs
 * @property {number} from
 * @property {number} to
 * @property {boolean} labelled
 */

/** Colours of lines, distinguishable with red-green colour blindness (bright and muted schemes of Paul Tol). */
const PROFILE_COLORS = ['#4477aa', '#ee6677', '#228833', '#ccbb44', '#66ccee', '#aa3377', '#997700', '#88ccaa'];

const PLOT = { width: 316, height: 108, left: 38, right: 22, top: 8, bottom: 18 };

class ProfilePlot {
  /**
   * @param {string} title @param {number} length length of the road in cm @param {ProfileLine[]} lines
   * @param {{s: number, level: Level}[]} findings @param {(s: number|null) => void} hovered
   */
  constructor(title, length, lines, findings, hovered) {
    this.length = Math.max(length, 1);
    this.lines = lines;
    this.findings = findings;
    this.hovered = hovered;
    /** @type {number|null} */
    this.station = null;
    this.range = ProfilePlot.rangeOf(lines);
    /** Vertical positions that have a label. @type {number[]} */
    this.labels = [];
    const [low, high] = this.range;
    this.canvas = withAttributes(make('canvas', 'plot'), {
      role: 'img',
      'aria-label': `${title}, between ${fixed(low / 100)} and ${fixed(high / 100)} metres over ${fixed(length / 100, 1)} metres`,
    });
    this.value = make('span', 'plot-value muted');
    this.element = make(
      'figure',
      lines.length > 1 ? 'profile several' : 'profile',
      make('figcaption', '', `${title} `, this.value),
      this.canvas,
    );
    this.canvas.addEventListener('pointermove', (event) => this.hover(event.offsetX));
    this.canvas.addEventListener('pointerleave', () => this.hover(null));
  }

  /** @param {ProfileLine[]} lines @returns {[number, number]} */
  static rangeOf(lines) {
    let [low, high] = [Infinity, -Infinity];
    for (const { pairs } of lines) {
      for (let i = 1; i < pairs.length; i += 2) {
        low = Math.min(low, pairs[i] ?? low);
        high = Math.max(high, pairs[i] ?? high);
      }
    }
    if (low > high) return [0, 100];
    const spare = Math.max(10, (high - low) * 0.1);
    return [low - spare, high + spare];
  }

  /** @param {number|null} px */
  hover(px) {
    const inner = PLOT.width - PLOT.left - PLOT.right;
    this.hovered(px === null ? null : Math.min(1, Math.max(0, (px - PLOT.left) / inner)) * this.length);
  }

  /** @param {MapTheme} theme @param {number|null} station */
  draw(theme, station) {
    this.station = station;
    const ratio = Math.min(3, window.devicePixelRatio || 1);
    this.canvas.width = PLOT.width * ratio;
    this.canvas.height = PLOT.height * ratio;
    const context = this.canvas.getContext('2d');
    if (!context) return;
    context.scale(ratio, ratio);
    context.font = '10px system-ui, sans-serif';
    this.axes(context, theme);
    this.labels = [];
    for (const line of this.lines) this.line(context, line, theme);
    for (const { s, level } of this.findings.slice(0, 500)) this.vertical(context, s, LEVEL_COLORS[level], 1.2);
    if (station !== null) this.vertical(context, station, theme.highlight, 1.5);
    this.value.textContent = station === null ? '' : `s ${fixed(station / 100, 1)}  ${this.valuesAt(station)}`;
  }

  /** @param {number} station */
  valuesAt(station) {
    const values = this.lines.filter(({ from, to }) => station >= from && station <= to).slice(0, 6);
    return values
      .map(({ name, pairs, from }) => `${name}${name ? ': ' : ''}${fixed(valueAt(pairs, station - from) / 100)}`)
      .join('   ');
  }

  /** @param {number} s */
  x(s) {
    return PLOT.left + (s / this.length) * (PLOT.width - PLOT.left - PLOT.right);
  }

  /** @param {number} value */
  y(value) {
    const [low, high] = this.range;
    return PLOT.height - PLOT.bottom - ((value - low) / (high - low)) * (PLOT.height - PLOT.top - PLOT.bottom);
  }

  /** @param {CanvasRenderingContext2D} context @param {MapTheme} theme */
  axes(context, theme) {
    const [low, high] = this.range;
    context.fillStyle = theme.arrow;
    context.lineWidth = 1;
    context.textBaseline = 'middle';
    context.textAlign = 'right';
    for (const value of niceTicks(low / 100, high / 100, 3)) {
      const y = Math.round(this.y(value * 100)) + 0.5;
      context.strokeStyle = theme.grid;
      context.beginPath();
      context.moveTo(PLOT.left, y);
      context.lineTo(PLOT.width - PLOT.right, y);
      context.stroke();
      context.fillText(tickText(value), PLOT.left - 4, y);
    }
    context.textBaseline = 'alphabetic';
    context.textAlign = 'center';
    for (const value of niceTicks(0, this.length / 100, 4))
      context.fillText(tickText(value), this.x(value * 100), PLOT.height - 5);
    context.strokeStyle = theme.edge;
    context.beginPath();
    context.moveTo(PLOT.left + 0.5, PLOT.top);
    context.lineTo(PLOT.left + 0.5, PLOT.height - PLOT.bottom + 0.5);
    context.lineTo(PLOT.width - PLOT.right, PLOT.height - PLOT.bottom + 0.5);
    context.stroke();
  }

  /** @param {CanvasRenderingContext2D} context @param {ProfileLine} line @param {MapTheme} theme */
  line(context, line, theme) {
    const { pairs } = line;
    if (pairs.length === 0) return;
    context.strokeStyle = line.color;
    context.lineWidth = 1.5;
    context.beginPath();
    for (let i = 0; i < pairs.length; i += 2) {
      context.lineTo(this.x(Math.min(line.to, (pairs[i] ?? 0) + line.from)), this.y(pairs[i + 1] ?? 0));
    }
    const last = pairs[pairs.length - 1] ?? 0;
    context.lineTo(this.x(line.to), this.y(last));
    context.stroke();
    const y = this.y(last);
    if (!line.labelled || this.labels.some((other) => Math.abs(other - y) < 9)) return;
    this.labels.push(y);
    context.textAlign = 'left';
    context.textBaseline = 'middle';
    context.fillStyle = theme.text;
    context.fillText(line.name, this.x(line.to) + 3, y);
  }

  /** @param {CanvasRenderingContext2D} context @param {number} s @param {string} color @param {number} width */
  vertical(context, s, color, width) {
    const x = this.x(Math.min(this.length, Math.max(0, s)));
    context.strokeStyle = color;
    context.lineWidth = width;
    context.beginPath();
    context.moveTo(x, PLOT.top);
    context.lineTo(x, PLOT.height - PLOT.bottom);
    context.stroke();
  }
}

/**
 * Returns round numbers within a range.
 *
 * @param {number} low
 * @param {number} high
 * @param {number} wanted
 * @returns {number[]}
 */
function niceTicks(low, high, wanted) {
  const raw = (high - low) / Math.max(1, wanted);
  if (!(raw > 0) || !Number.isFinite(raw)) return [low];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * (raw / power > 5 ? 10 : raw / power > 2 ? 5 : raw / power > 1 ? 2 : 1);
  const ticks = [];
  for (let value = Math.ceil(low / step) * step; value <= high && ticks.length < 12; value += step)
    ticks.push(Math.abs(value) < step / 1e6 ? 0 : value);
  return ticks;
}

/** @param {number} value */
function tickText(value) {
  return Math.abs(value) >= 10000 ? `${Number((value / 1000).toPrecision(4))}k` : String(Number(value.toPrecision(5)));
}
