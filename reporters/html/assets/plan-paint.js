// Draws the map: lanes, borders, marks, reference lines, junctions. It works in steps of a few milliseconds, so that a
// map of any size does not block the page.

/**
 * center in cm, pixels per cm, size in pixels
 *
 * @typedef {object} Frame
 * @property {number} x
 * @property {number} y
 * @property {number} k
 * @property {number} width
 * @property {number} height
 */

/** @param {Frame} frame @param {number} [margin] pixels @returns {Box} */
function boxOfFrame(frame, margin = 0) {
  const halfWidth = (frame.width / 2 + margin) / frame.k;
  const halfHeight = (frame.height / 2 + margin) / frame.k;
  return [frame.x - halfWidth, frame.y - halfHeight, frame.x + halfWidth, frame.y + halfHeight];
}

/** Number of lanes in one path. Long paths are slow to fill, and short paths need many calls. */
const LANES_PER_PATH = 24;
const POINTS_PER_STEP = 6000;

class BasePainter {
  /** @param {IndexedPlan} indexed */
  constructor(indexed) {
    this.plan = indexed.plan;
    this.indexed = indexed;
    this.kinds = this.plan.sections.map((section) => Uint8Array.from(section.lanes, (lane) => kindOfLane(lane.type)));
  }

  /** Returns the level of detail for a scale. @param {number} k pixels per cm */
  static levelFor(k) {
    const perMetre = k * 100;
    return perMetre < 0.9 ? 2 : perMetre < 7 ? 1 : 0;
  }

  /**
   * Draws in steps. The caller can do other work between two steps.
   *
   * @param {CanvasRenderingContext2D} canvas
   * @param {Frame} frame
   * @param {MapTheme} theme
   */
  *paint(canvas, frame, theme) {
    const perMetre = frame.k * 100;
    const box = boxOfFrame(frame, 4);
    const visible = this.indexed.sections.within(box).filter((section) => this.isSeen(section, frame));
    const level = BasePainter.levelFor(frame.k);
    canvas.fillStyle = theme.ground;
    canvas.fillRect(0, 0, frame.width, frame.height);
    if (perMetre < 0.12) {
      yield* this.centers(canvas, frame, theme, visible);
    } else {
      yield* this.lanes(canvas, frame, theme, visible, level);
    }
    if (perMetre > 0.7) yield* this.edges(canvas, frame, theme, visible, level);
    const detail = new DetailPainter(this.indexed, canvas, frame, theme);
    if (perMetre > 2.5) yield* detail.marks(visible);
    if (perMetre > 2.5) yield* detail.references(visible, level);
    detail.junctions(box);
    if (perMetre > 1.2) yield* detail.objects(box);
    if (perMetre > 0.8) yield* detail.signals(box);
    if (perMetre > 1.5) yield* detail.arrows(visible);
    detail.labels(visible, box);
  }

  /** Checks whether a section is at least about half a pixel large. @param {number} index @param {Frame} frame */
  isSeen(index, frame) {
    const box = this.plan.sections[index]?.box;
    return box !== undefined && Math.max(box[2] - box[0], box[3] - box[1]) * frame.k > 0.4;
  }

  /**
   * Draws one line for each section, at scales where a lane is too narrow to be visible.
   *
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme @param {number[]} visible
   */
  *centers(canvas, frame, theme, visible) {
    canvas.strokeStyle = theme.edge;
    canvas.lineWidth = 1.2;
    let points = 0;
    canvas.beginPath();
    for (const index of visible) {
      points += this.line(canvas, frame, this.plan.sections[index]?.center ?? 0, 2);
      if (points < POINTS_PER_STEP) continue;
      canvas.stroke();
      canvas.beginPath();
      points = 0;
      yield;
    }
    canvas.stroke();
  }

  /**
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme @param {number[]} visible
   * @param {number} level
   */
  *lanes(canvas, frame, theme, visible, level) {
    for (let kind = 0; kind < LANE_KINDS.length; kind++) {
      canvas.fillStyle = theme.lanes[kind] ?? theme.edge;
      canvas.beginPath();
      let [inPath, points] = [0, 0];
      for (const index of visible) {
        const section = this.plan.sections[index];
        const kinds = this.kinds[index];
        if (!section || !kinds || !kinds.includes(kind)) continue;
        for (let lane = 0; lane < kinds.length; lane++) {
          if (kinds[lane] !== kind) continue;
          points += this.polygon(canvas, frame, /** @type {PlanLane} */ (section.lanes[lane]), level);
          if (++inPath < LANES_PER_PATH) continue;
          canvas.fill();
          canvas.beginPath();
          inPath = 0;
          if (points < POINTS_PER_STEP) continue;
          points = 0;
          yield;
        }
      }
      canvas.fill();
    }
  }

  /**
   * Draws thin borders of lanes. They separate neighbours of one kind and hide the gaps between polygons.
   *
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme @param {number[]} visible
   * @param {number} level
   */
  *edges(canvas, frame, theme, visible, level) {
    canvas.strokeStyle = theme.edge;
    canvas.globalAlpha = Math.min(0.8, 0.15 + frame.k * 12);
    canvas.lineWidth = 0.8;
    canvas.beginPath();
    let points = 0;
    for (const index of visible) {
      for (const lane of this.plan.sections[index]?.lanes ?? []) points += this.line(canvas, frame, lane.outer, level);
      if (points < POINTS_PER_STEP) continue;
      canvas.stroke();
      canvas.beginPath();
      points = 0;
      canvas.globalAlpha = 1;
      yield;
      canvas.globalAlpha = Math.min(0.8, 0.15 + frame.k * 12);
    }
    canvas.stroke();
    canvas.globalAlpha = 1;
  }

  /**
   * Adds a line to the path.
   *
   * @param {CanvasRenderingContext2D} canvas
   * @param {Frame} frame
   * @param {number} line
   * @param {number} level
   */
  line(canvas, frame, line, level) {
    const { x, y, start } = /** @type {LevelOfLines} */ (this.plan.levels[level]);
    const from = start[line] ?? 0;
    const to = start[line + 1] ?? from;
    const { k } = frame;
    const [dx, dy] = [frame.width / 2 - frame.x * k, frame.height / 2 + frame.y * k];
    for (let i = from; i < to; i++) {
      if (i === from) canvas.moveTo((x[i] ?? 0) * k + dx, dy - (y[i] ?? 0) * k);
      else canvas.lineTo((x[i] ?? 0) * k + dx, dy - (y[i] ?? 0) * k);
    }
    return to - from;
  }

  /**
   * Adds the polygon of a lane to the path. All polygons have the same orientation. Opposite ones would cancel out if
   * lanes of both sides overlap, as in junctions.
   *
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {PlanLane} lane @param {number} level
   */
  polygon(canvas, frame, lane, level) {
    const { x, y, start } = /** @type {LevelOfLines} */ (this.plan.levels[level]);
    const [forward, backward] = lane.left ? [lane.inner, lane.outer] : [lane.outer, lane.inner];
    const { k } = frame;
    const [dx, dy] = [frame.width / 2 - frame.x * k, frame.height / 2 + frame.y * k];
    const f0 = start[forward] ?? 0;
    const f1 = start[forward + 1] ?? f0;
    const b0 = start[backward] ?? 0;
    const b1 = start[backward + 1] ?? b0;
    if (f1 === f0 || b1 === b0) return 0;
    canvas.moveTo((x[f0] ?? 0) * k + dx, dy - (y[f0] ?? 0) * k);
    for (let i = f0 + 1; i < f1; i++) canvas.lineTo((x[i] ?? 0) * k + dx, dy - (y[i] ?? 0) * k);
    for (let i = b1 - 1; i >= b0; i--) canvas.lineTo((x[i] ?? 0) * k + dx, dy - (y[i] ?? 0) * k);
    canvas.closePath();
    return f1 - f0 + b1 - b0;
  }

  /**
   * Adds the outline of a road or of one of its sections to the path: only the outermost borders.
   *
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {PlanTarget} target @param {number} level
   */
  outline(canvas, frame, target, level) {
    const { x, y, start } = /** @type {LevelOfLines} */ (this.plan.levels[level]);
    const sections = this.plan.roads[target.road ?? -1]?.sections ?? [];
    const meant = target.section === undefined ? sections : sections.filter(({ index }) => index === target.section);
    /** @type {[number, number][]} */
    const left = [];
    /** @type {[number, number][]} */
    const right = [];
    for (const section of meant) {
      for (const [side, points] of /** @type {[boolean, [number, number][]][]} */ ([
        [true, left],
        [false, right],
      ])) {
        const line = section.lanes.findLast((lane) => lane.left === side)?.outer ?? section.center;
        for (let i = start[line] ?? 0; i < (start[line + 1] ?? 0); i++)
          points.push(onFrame(frame, x[i] ?? 0, y[i] ?? 0));
      }
    }
    [...left, ...right.reverse()].forEach(([px, py], index) =>
      index === 0 ? canvas.moveTo(px, py) : canvas.lineTo(px, py),
    );
    if (left.length > 0) canvas.closePath();
  }
}

/**
 * Adds the shape of a target to the path.
 *
 * @param {BasePainter} painter
 * @param {CanvasRenderingContext2D} canvas
 * @param {Frame} frame
 * @param {PlanTarget} target
 */
function traceTarget(painter, canvas, frame, target) {
  const { plan } = painter;
  const level = BasePainter.levelFor(frame.k);
  if (target.lane === undefined) painter.outline(canvas, frame, target, level);
  else for (const lane of lanesOf(plan, target)) painter.polygon(canvas, frame, lane, level);
  const section = plan.roads[target.road ?? -1]?.sections[target.section ?? -1];
  if (section && target.lane === 0) painter.line(canvas, frame, section.center, level);
  const road = plan.roads[target.road ?? -1];
  if (road && target.section === undefined && road.sections.length === 0) painter.line(canvas, frame, road.line, level);
  const outline = plan.junctions[target.junction ?? -1]?.outline ?? plan.objects[target.object ?? -1]?.outline;
  if (outline) traceOutline(canvas, frame, outline);
  const signal = plan.signals[target.signal ?? -1];
  if (signal && signal.box[0] <= signal.box[2]) {
    const [x, y] = onFrame(frame, signal.x, signal.y);
    canvas.moveTo(x + 11, y);
    canvas.arc(x, y, 11, 0, 2 * Math.PI);
  }
}

/** @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {Int32Array} outline */
function traceOutline(canvas, frame, outline) {
  if (outline.length === 2) {
    const [x, y] = onFrame(frame, outline[0] ?? 0, outline[1] ?? 0);
    canvas.moveTo(x + 9, y);
    canvas.arc(x, y, 9, 0, 2 * Math.PI);
    return;
  }
  for (let i = 0; i + 1 < outline.length; i += 2) {
    const [x, y] = onFrame(frame, outline[i] ?? 0, outline[i + 1] ?? 0);
    if (i === 0) canvas.moveTo(x, y);
    else canvas.lineTo(x, y);
  }
  if (outline.length > 0) canvas.closePath();
}

/** @param {Frame} frame @param {number} x @param {number} y @returns {[number, number]} */
function onFrame(frame, x, y) {
  return [(x - frame.x) * frame.k + frame.width / 2, frame.height / 2 - (y - frame.y) * frame.k];
}
