// Details that are drawn on top of the lanes at large scales: marks, reference lines, junctions, signals, objects,
// arrows and names.

/** Items in one drawing step. The page can do other work between two steps. */
const ITEMS_PER_STEP = 300;

/** Keeps names from overlapping. Each name claims cells of a coarse raster. */
class LabelRaster {
  /** @param {Frame} frame */
  constructor(frame) {
    this.columns = Math.ceil(frame.width / 16) + 1;
    this.rows = Math.ceil(frame.height / 12) + 1;
    this.taken = new Uint8Array(this.columns * this.rows);
  }

  /** @param {number} x center @param {number} y @param {number} width @param {number} height */
  claim(x, y, width, height) {
    const c0 = Math.floor((x - width / 2) / 16);
    const c1 = Math.floor((x + width / 2) / 16);
    const r0 = Math.floor((y - height / 2) / 12);
    const r1 = Math.floor((y + height / 2) / 12);
    if (c0 < 0 || r0 < 0 || c1 >= this.columns || r1 >= this.rows) return false;
    for (let row = r0; row <= r1; row++) {
      for (let column = c0; column <= c1; column++) {
        if (this.taken[row * this.columns + column] === 1) return false;
      }
    }
    for (let row = r0; row <= r1; row++) this.taken.fill(1, row * this.columns + c0, row * this.columns + c1 + 1);
    return true;
  }
}

class DetailPainter {
  /**
   * @param {IndexedPlan} indexed
   * @param {CanvasRenderingContext2D} canvas
   * @param {Frame} frame
   * @param {MapTheme} theme
   */
  constructor(indexed, canvas, frame, theme) {
    this.indexed = indexed;
    this.plan = indexed.plan;
    this.canvas = canvas;
    this.frame = frame;
    this.theme = theme;
    this.raster = new LabelRaster(frame);
  }

  /** @param {number[]} visible sections */
  *marks(visible) {
    const { plan, canvas } = this;
    let steps = 0;
    canvas.lineCap = 'butt';
    for (const index of visible) {
      const section = plan.sections[index];
      if (!section) continue;
      for (const line of [section.center, ...section.lanes.map((lane) => lane.outer)]) {
        for (let mark = plan.markStarts[line] ?? 0; mark < (plan.markStarts[line + 1] ?? 0); mark += 6) this.mark(mark);
      }
      if (++steps % ITEMS_PER_STEP !== 0) continue;
      canvas.setLineDash([]);
      yield;
    }
    canvas.setLineDash([]);
  }

  /** @param {number} mark the first of its six numbers */
  mark(mark) {
    const { plan, canvas, frame, theme } = this;
    const [line = 0, first = 0, count = 0, typeAt = 0, colorAt = 0, width = 0] = plan.marks.subarray(mark, mark + 6);
    const type = plan.strings[typeAt] ?? '';
    if (type === '' || type === 'none' || count < 2) return;
    const { x, y, start } = /** @type {LevelOfLines} */ (plan.levels[0]);
    const from = (start[line] ?? 0) + first;
    const perMetre = frame.k * 100;
    const wide = Math.max(width, 10) * frame.k;
    canvas.beginPath();
    for (let i = from; i < from + count; i++) {
      const [px, py] = onFrame(frame, x[i] ?? 0, y[i] ?? 0);
      if (i === from) canvas.moveTo(px, py);
      else canvas.lineTo(px, py);
    }
    canvas.setLineDash(markPattern(type).map((metres) => metres * perMetre));
    const double =
      type === 'solid solid' || type === 'broken broken' || type === 'solid broken' || type === 'broken solid';
    canvas.lineWidth = Math.max(1.1, double ? wide * 2.6 : wide) + (theme.ground === MAP_THEMES.light.ground ? 0.9 : 0);
    // White on light grey is not visible without an edge.
    if (theme.ground === MAP_THEMES.light.ground) {
      canvas.strokeStyle = theme.markEdge;
      canvas.stroke();
      canvas.lineWidth -= 0.9;
    }
    canvas.strokeStyle = type === 'curb' ? theme.edge : markColor(plan.strings[colorAt] ?? '', theme);
    canvas.stroke();
    if (double && wide > 1.2) {
      canvas.setLineDash([]);
      canvas.lineWidth = wide * 0.8;
      canvas.strokeStyle = theme.lanes[LANE_KINDS.length - 1] ?? theme.ground;
      canvas.stroke();
    }
  }

  /** @param {number[]} visible @param {number} level */
  *references(visible, level) {
    const { plan, canvas, frame, theme } = this;
    const { x, y, start } = /** @type {LevelOfLines} */ (plan.levels[level]);
    canvas.strokeStyle = theme.reference;
    canvas.lineWidth = 1.1;
    canvas.globalAlpha = 0.75;
    canvas.setLineDash([8, 3, 1.5, 3]);
    canvas.beginPath();
    for (const road of new Set(visible.map((index) => plan.sections[index]?.road ?? -1))) {
      const line = plan.roads[road]?.line ?? -1;
      for (let i = start[line] ?? 0; i < (start[line + 1] ?? 0); i++) {
        const [px, py] = onFrame(frame, x[i] ?? 0, y[i] ?? 0);
        if (i === start[line]) canvas.moveTo(px, py);
        else canvas.lineTo(px, py);
      }
    }
    canvas.stroke();
    canvas.setLineDash([]);
    canvas.globalAlpha = 1;
    yield;
  }

  /** @param {Box} box */
  junctions(box) {
    const { plan, canvas, frame, theme } = this;
    canvas.strokeStyle = theme.junction;
    canvas.lineWidth = 1.4;
    canvas.setLineDash([5, 4]);
    for (const index of this.indexed.junctions.within(box)) {
      const junction = plan.junctions[index];
      if (!junction || (junction.box[2] - junction.box[0]) * frame.k < 6) continue;
      canvas.beginPath();
      traceOutline(canvas, frame, junction.outline);
      canvas.stroke();
    }
    canvas.setLineDash([]);
  }

  /** @param {Box} box */
  *objects(box) {
    const { plan, canvas, frame, theme } = this;
    let steps = 0;
    canvas.lineWidth = 1;
    for (const index of this.indexed.objects.within(box)) {
      const object = plan.objects[index];
      if (!object) continue;
      canvas.strokeStyle = theme.object;
      canvas.fillStyle = theme.objectFill;
      canvas.beginPath();
      if (object.outline.length === 2) {
        const [x, y] = onFrame(frame, object.outline[0] ?? 0, object.outline[1] ?? 0);
        canvas.rect(x - 2.5, y - 2.5, 5, 5);
      } else {
        traceOutline(canvas, frame, object.outline);
      }
      canvas.fill();
      canvas.stroke();
      if (++steps % ITEMS_PER_STEP === 0) yield;
    }
  }

  /** Draws signals as a post with a line in their direction. Lights are filled, signs are not. @param {Box} box */
  *signals(box) {
    const { plan, canvas, frame, theme } = this;
    let steps = 0;
    const size = Math.min(6, 2 + frame.k * 60);
    for (const index of this.indexed.signals.within(box)) {
      const signal = plan.signals[index];
      if (!signal) continue;
      const [x, y] = onFrame(frame, signal.x, signal.y);
      const [dx, dy] = [Math.cos(signal.heading), -Math.sin(signal.heading)];
      canvas.strokeStyle = theme.signal;
      canvas.fillStyle = signal.dynamic ? theme.signal : theme.ground;
      canvas.lineWidth = 1.4;
      canvas.beginPath();
      canvas.moveTo(x, y);
      canvas.lineTo(x + dx * size * 2.2, y + dy * size * 2.2);
      canvas.moveTo(x - dy * size, y + dx * size);
      canvas.lineTo(x + dy * size, y - dx * size);
      canvas.stroke();
      canvas.beginPath();
      if (signal.dynamic) canvas.arc(x, y, size * 0.7, 0, 2 * Math.PI);
      else canvas.rect(x - size * 0.55, y - size * 0.55, size * 1.1, size * 1.1);
      canvas.fill();
      canvas.stroke();
      if (++steps % ITEMS_PER_STEP === 0) yield;
    }
  }

  /** Draws arrows in the driving direction, with the lane's id at large scales. @param {number[]} visible */
  *arrows(visible) {
    let steps = 0;
    for (const index of visible) {
      const section = this.plan.sections[index];
      const leftHand = this.plan.roads[section?.road ?? -1]?.leftHand ?? false;
      // In a junction lanes overlap, and their ids would overlap too.
      const named = (this.plan.roads[section?.road ?? -1]?.junction ?? -1) < 0 || this.frame.k * 100 > 45;
      for (const lane of section?.lanes ?? []) this.arrowsOfLane(lane, leftHand, named);
      if (++steps % ITEMS_PER_STEP === 0) yield;
    }
  }

  /** @param {PlanLane} lane @param {boolean} leftHand @param {boolean} named whether the id is written */
  arrowsOfLane(lane, leftHand, named) {
    const { frame, canvas, theme } = this;
    const wide = (lane.widths[1] ?? 300) * frame.k;
    const length = this.lengthOf(lane.outer) * frame.k;
    if (length < 34 || wide < 10) return;
    const count = Math.min(60, Math.max(1, Math.floor(length / 170)));
    const size = Math.min(9, wide * 0.32);
    for (let i = 0; i < count; i++) {
      const share = (i + 0.5) / count;
      const inner = this.along(lane.inner, share);
      const outer = this.along(lane.outer, share);
      if (!inner || !outer) return;
      const [x, y] = [(inner.x + outer.x) / 2, (inner.y + outer.y) / 2];
      if (x < 0 || y < 0 || x > frame.width || y > frame.height) continue;
      const forward = lane.left === leftHand;
      const angle = Math.atan2(outer.dy, outer.dx) + (forward ? 0 : Math.PI);
      if (MOVING.has(lane.type)) {
        this.arrow(x, y, angle, size);
        if (lane.type === 'bidirectional') this.arrow(x, y, angle + Math.PI, size);
      }
      if (!named || wide < 18 || length < 60) continue;
      canvas.font = '500 10.5px system-ui, sans-serif';
      canvas.textAlign = 'center';
      canvas.textBaseline = 'middle';
      canvas.fillStyle = theme.arrow;
      canvas.fillText(String(lane.id), x - Math.cos(angle) * 22, y - Math.sin(angle) * 22);
    }
  }

  /** @param {number} x @param {number} y @param {number} angle on the screen @param {number} size */
  arrow(x, y, angle, size) {
    const { canvas, theme } = this;
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    canvas.strokeStyle = theme.arrow;
    canvas.lineWidth = Math.max(1, size * 0.2);
    canvas.beginPath();
    canvas.moveTo(x - c * size, y - s * size);
    canvas.lineTo(x + c * size, y + s * size);
    canvas.moveTo(x + c * size * 0.3 - s * size * 0.55, y + s * size * 0.3 + c * size * 0.55);
    canvas.lineTo(x + c * size, y + s * size);
    canvas.lineTo(x + c * size * 0.3 + s * size * 0.55, y + s * size * 0.3 - c * size * 0.55);
    canvas.stroke();
  }

  /** @param {number} line */
  lengthOf(line) {
    const { x, y, start } = /** @type {LevelOfLines} */ (this.plan.levels[1]);
    let length = 0;
    for (let i = (start[line] ?? 0) + 1; i < (start[line + 1] ?? 0); i++) {
      length += Math.hypot((x[i] ?? 0) - (x[i - 1] ?? 0), (y[i] ?? 0) - (y[i - 1] ?? 0));
    }
    return length;
  }

  /**
   * Returns the point at a fraction of a line's length on the frame, with the direction at this point.
   *
   * @param {number} line
   * @param {number} share
   */
  along(line, share) {
    const { x, y, start } = /** @type {LevelOfLines} */ (this.plan.levels[1]);
    let left = this.lengthOf(line) * share;
    for (let i = (start[line] ?? 0) + 1; i < (start[line + 1] ?? 0); i++) {
      const [x0, y0] = onFrame(this.frame, x[i - 1] ?? 0, y[i - 1] ?? 0);
      const [x1, y1] = onFrame(this.frame, x[i] ?? 0, y[i] ?? 0);
      const length = Math.hypot(x1 - x0, y1 - y0) / this.frame.k;
      if (left <= length && length > 0) {
        const part = left / length;
        return { x: x0 + part * (x1 - x0), y: y0 + part * (y1 - y0), dx: x1 - x0, dy: y1 - y0 };
      }
      left -= length;
    }
    return null;
  }

  /** Draws ids of junctions, then of roads, as many as fit. @param {number[]} visible @param {Box} box */
  labels(visible, box) {
    const { plan, frame, theme } = this;
    for (const index of this.indexed.junctions.within(box)) {
      const junction = plan.junctions[index];
      if (!junction || (junction.box[2] - junction.box[0]) * frame.k < 46) continue;
      const [x, y] = onFrame(frame, (junction.box[0] + junction.box[2]) / 2, junction.box[3]);
      this.label(`junction ${junction.id}`, x, y - 7, theme.junction);
    }
    if (frame.k * 100 < 0.35) return;
    const named = new Set();
    for (const index of visible) {
      const section = plan.sections[index];
      const road = plan.roads[section?.road ?? -1];
      if (!section || !road || named.has(section.road) || (road.junction >= 0 && frame.k * 100 < 3)) continue;
      const middle = this.middleInSight(road, box);
      if (!middle || this.lengthOf(road.line) * frame.k < 52) continue;
      named.add(section.road);
      const [x, y] = onFrame(frame, middle.x, middle.y);
      this.label(road.id, x, y, theme.text);
    }
  }

  /**
   * Returns a visible point of the reference line, the middle if possible.
   *
   * @param {PlanRoad} road
   * @param {Box} box
   */
  middleInSight(road, box) {
    for (const share of [0.5, 0.3, 0.7, 0.15, 0.85, 0.05, 0.95]) {
      const point = pointAt(this.plan, road, road.length * share);
      if (point && point.x > box[0] && point.x < box[2] && point.y > box[1] && point.y < box[3]) return point;
    }
    return null;
  }

  /** @param {string} text @param {number} x @param {number} y @param {string} color */
  label(text, x, y, color) {
    const { canvas, theme } = this;
    const shown = plain(text, 24);
    canvas.font = '600 11px system-ui, sans-serif';
    if (!this.raster.claim(x, y, canvas.measureText(shown).width + 8, 14)) return;
    canvas.textAlign = 'center';
    canvas.textBaseline = 'middle';
    canvas.lineWidth = 3.5;
    canvas.lineJoin = 'round';
    canvas.strokeStyle = theme.halo;
    canvas.strokeText(shown, x, y);
    canvas.fillStyle = color;
    canvas.fillText(shown, x, y);
  }
}
