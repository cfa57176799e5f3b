// Bars of the timeline: the parts of an element's bar in seconds, and the time axis.

/** Range in seconds that is shown as one time, because several transitions follow each other. */
const ONE_TIME = 1;

/**
 * A part of a bar. `solid`: it certainly runs; `maybe`: it may run; `unknown`: nothing is known; `start`: it starts
 * then. `to` may be Infinity.
 *
 * @typedef {{kind: 'solid'|'maybe'|'unknown'|'start', from: number, to: number}} BarPart
 */

/**
 * Returns the parts of an element's bar; none if it never starts.
 *
 * @param {StoryElement} element
 * @param {StoryModel} story
 * @returns {BarPart[]}
 */
function barParts({ start, end, parent }, story) {
  if (start.earliest === Infinity) return [];
  const run = story.run.end;
  const until = Math.max(start.earliest, Math.min(end.latest, run.latest));
  if (start.latest === Infinity) {
    const known = story.elements[parent]?.start.earliest ?? 0;
    return [{ kind: start.earliest <= known + 0.001 ? 'unknown' : 'maybe', from: start.earliest, to: until }];
  }
  const isOne = start.latest - start.earliest <= ONE_TIME;
  const from = isOne ? start.earliest : start.latest;
  /** @type {BarPart[]} */
  const parts = [];
  if (!isOne) parts.push({ kind: 'maybe', from: start.earliest, to: start.latest });
  const certain = Math.min(end.earliest, run.earliest);
  const ends = end.earliest === Infinity || end.latest - end.earliest <= ONE_TIME;
  if (isOne || certain > from) parts.push({ kind: 'start', from, to: from });
  if (certain > from) parts.push({ kind: 'solid', from, to: certain });
  const rest = Math.max(from, certain);
  if (!ends && until > rest) parts.push({ kind: 'maybe', from: rest, to: until });
  return parts;
}

/** Part of the time axis in seconds. */
class TimeRange {
  /** @param {number} from @param {number} to */
  constructor(from, to) {
    this.from = from;
    this.to = to;
  }

  /** Returns a time as a fraction of the range. @param {number} time */
  at(time) {
    return (time - this.from) / (this.to - this.from);
  }

  /** @param {number} factor @param {number} [middle] fraction that stays @returns {TimeRange} */
  zoomed(factor, middle = 0.5) {
    const length = Math.min(1e9, Math.max(0.01, (this.to - this.from) * factor));
    const from = Math.max(0, this.from + (this.to - this.from) * middle - length * middle);
    return new TimeRange(from, from + length);
  }

  /** @param {number} by fraction @returns {TimeRange} */
  moved(by) {
    const length = this.to - this.from;
    const from = Math.max(0, this.from + length * by);
    return new TimeRange(from, from + length);
  }

  /** Returns round times that are at least so far apart. @param {number} least fraction @returns {{times: number[], step: number}} */
  ticks(least) {
    const wanted = (this.to - this.from) * least;
    const power = 10 ** Math.floor(Math.log10(wanted));
    const step = power * (wanted <= power ? 1 : wanted <= 2 * power ? 2 : wanted <= 5 * power ? 5 : 10);
    /** @type {number[]} */
    const times = [];
    const first = Math.ceil(this.from / step - 1e-9);
    for (let i = first; i * step <= this.to + step * 1e-9 && times.length < 200; i++) times.push(i * step);
    return { times, step };
  }
}

/**
 * Returns the range of the whole story: until the end of the run if that is known well, otherwise until the last known
 * time. A few times far after all others do not count.
 *
 * @param {StoryModel} story
 */
function wholeRange(story) {
  const { end } = story.run;
  if (end.latest < Infinity && end.latest > 0 && end.latest <= Math.max(2, end.earliest * 2))
    return new TimeRange(0, end.latest * 1.06);
  const times = story.elements
    .flatMap(({ start, end: last }) => [start.earliest, start.latest, last.earliest, last.latest])
    .filter((time) => Number.isFinite(time) && time > 0 && time < end.latest)
    .sort((a, b) => a - b);
  const usual = times[Math.floor((times.length - 1) * 0.9)] ?? 0;
  const most = times.filter((time) => time <= 10 * usual).at(-1) ?? 0;
  const run = end.earliest < Math.max(100, 10 * most) ? end.earliest : 0;
  return new TimeRange(0, Math.max(5, most * 1.3, run * 1.3));
}

/** Formats a time with as many decimals as the step needs. @param {number} time @param {number} step */
function timeLabel(time, step) {
  const digits = Math.min(3, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  return time >= 1e6 ? time.toExponential(1) : time.toFixed(digits);
}
