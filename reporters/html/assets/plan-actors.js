// Entities of a scenario on the map: their boxes at the start, and the lines that they follow.

/** Least length of a box on the screen in pixels. A smaller one becomes a sign. */
const LEAST_BOX = 13;

/** @typedef {{entities: Set<number>, courses: Set<number>}|null} ActorFocus emphasized parts; null: all */

/** @typedef {{x: number, y: number, width: number, height: number, entity: number}} ActorLabel in pixels */

class ActorLayer {
  /** @param {StoryModel} story @param {Plan} plan */
  constructor(story, plan) {
    this.story = story;
    this.hasRoads = plan.roads.length > 0;
    /** @type {ActorFocus} */
    this.focus = null;
    this.hovered = -1;
    const { origin } = plan;
    /** @param {readonly number[]} points */
    const inPlan = (points) =>
      Float64Array.from(points, (value, i) => (value - (i % 2 === 0 ? origin.x : origin.y)) * 100);
    this.lines = story.courses.map(({ points }) => inPlan(points));
    this.stops = story.courses.map(({ stops }) => inPlan(stops));
    this.places = story.entities.map(({ at }) => {
      if (!at) return null;
      const place = { x: (at.x - origin.x) * 100, y: (at.y - origin.y) * 100, heading: at.heading };
      return Math.abs(place.x) < FARTHEST && Math.abs(place.y) < FARTHEST ? place : null;
    });
    /** @type {ActorLabel[]} */
    this.labels = [];
    this.box = this.boxOf(null);
  }

  /** Returns the box of entities and lines, or null if nothing has a place. @param {ActorFocus} only @returns {Box|null} */
  boxOf(only) {
    const box = emptyBox();
    this.places.forEach((place, entity) => {
      if (place && (!only || only.entities.has(entity))) growBox(box, [place.x, place.y, place.x, place.y]);
    });
    [this.lines, this.stops].forEach((lists) =>
      lists.forEach((points, course) => {
        if (only && !only.courses.has(course)) return;
        for (let i = 0; i + 1 < points.length; i += 2) {
          const [x, y] = [points[i] ?? 0, points[i + 1] ?? 0];
          if (Math.abs(x) < FARTHEST && Math.abs(y) < FARTHEST) growBox(box, [x, y, x, y]);
        }
      }),
    );
    if (!(box[0] <= box[2])) return null;
    // At least 30 m to each side, so that the surroundings are seen.
    const [x, y] = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    const half = [Math.max(3000, (box[2] - box[0]) / 2 + 600), Math.max(3000, (box[3] - box[1]) / 2 + 600)];
    return [x - (half[0] ?? 0), y - (half[1] ?? 0), x + (half[0] ?? 0), y + (half[1] ?? 0)];
  }

  /** @param {MapTheme} theme @param {number} entity */
  color(theme, entity) {
    return theme.entities[entity % theme.entities.length] ?? theme.text;
  }

  /** @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme */
  draw(canvas, frame, theme) {
    canvas.save();
    if (!this.hasRoads) drawMetres(canvas, frame, theme);
    const order = this.story.courses.map(({ index }) => index);
    // Emphasized lines are on top.
    order.sort((a, b) => Number(this.isStrong(a)) - Number(this.isStrong(b)) || a - b);
    for (const course of order) this.drawCourse(canvas, frame, theme, course);
    const shown = this.places.flatMap((place, entity) => (place && this.isNear(frame, place) ? [entity] : []));
    shown.sort((a, b) => Number(this.isEmphasized(a)) - Number(this.isEmphasized(b)) || b - a);
    for (const entity of shown) this.drawEntity(canvas, frame, theme, entity);
    this.drawLabels(canvas, frame, theme, shown.reverse());
    canvas.restore();
  }

  /** @param {Frame} frame @param {{x: number, y: number}} place */
  isNear(frame, { x, y }) {
    const box = boxOfFrame(frame, 60 + LONGEST_BOX * 100 * frame.k);
    return x >= box[0] && x <= box[2] && y >= box[1] && y <= box[3];
  }

  /** @param {number} entity */
  isEmphasized(entity) {
    return this.hovered === entity || (this.focus?.entities.has(entity) ?? false);
  }

  /** @param {number} course */
  isStrong(course) {
    return this.focus?.courses.has(course) ?? false;
  }

  /** @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme @param {number} index */
  drawCourse(canvas, frame, theme, index) {
    const course = this.story.courses[index];
    const points = this.lines[index];
    const stops = this.stops[index];
    if (!course || !points || !stops) return;
    const strong = this.isStrong(index);
    canvas.globalAlpha = this.focus && !strong ? 0.28 : 1;
    const color = this.color(theme, course.entities[0] ?? 0);
    canvas.lineJoin = 'round';
    canvas.lineCap = 'round';
    if (points.length >= 4) {
      tracePoints(canvas, frame, points);
      canvas.setLineDash([]);
      canvas.lineWidth = strong ? 7.5 : 5;
      canvas.strokeStyle = theme.halo;
      canvas.stroke();
      canvas.setLineDash(course.exact ? [] : [7, 6]);
      canvas.lineWidth = (course.kind === 'route' ? 2.6 : 2) + (strong ? 1.4 : 0);
      canvas.strokeStyle = color;
      canvas.stroke();
      canvas.setLineDash([]);
      drawArrows(canvas, frame, points, color, strong ? 6.5 : 5);
    }
    for (let i = 0; i + 1 < stops.length; i += 2) {
      const [x, y] = onFrame(frame, stops[i] ?? 0, stops[i + 1] ?? 0);
      if (course.kind === 'target') drawTarget(canvas, x, y, color, theme);
      else drawStop(canvas, x, y, color, theme, strong ? 5 : 4);
    }
    canvas.globalAlpha = 1;
  }

  /** @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme @param {number} index */
  drawEntity(canvas, frame, theme, index) {
    const entity = this.story.entities[index];
    const place = this.places[index];
    if (!entity || !place) return;
    const [x, y] = onFrame(frame, place.x, place.y);
    const scale = frame.k * 100;
    const [length, width] = entity.size;
    canvas.save();
    canvas.globalAlpha = this.focus && !this.isEmphasized(index) ? 0.35 : 1;
    canvas.translate(x, y);
    canvas.rotate(-place.heading);
    canvas.fillStyle = this.color(theme, index);
    if (length * scale >= LEAST_BOX) {
      canvas.translate(entity.center[0] * scale, -entity.center[1] * scale);
      drawBox(canvas, length * scale, width * scale, entity.kind, theme, entity.sized);
    } else {
      drawSign(canvas, entity.kind, theme);
    }
    canvas.restore();
    if (this.isEmphasized(index)) {
      const [cx, cy] = this.middle(frame, index);
      ring(canvas, cx, cy, Math.max(11, (Math.hypot(length, width) * scale) / 2 + 5), theme);
    }
  }

  /** Returns the middle of a box in pixels. @param {Frame} frame @param {number} index @returns {[number, number]} */
  middle(frame, index) {
    const entity = this.story.entities[index];
    const place = this.places[index];
    if (!entity || !place) return [NaN, NaN];
    const [x, y] = onFrame(frame, place.x, place.y);
    if (entity.size[0] * frame.k * 100 < LEAST_BOX) return [x, y];
    const scale = frame.k * 100;
    const [dx, dy] = entity.center;
    const [sin, cos] = [Math.sin(place.heading), Math.cos(place.heading)];
    return [x + (dx * cos - dy * sin) * scale, y - (dx * sin + dy * cos) * scale];
  }

  /**
   * Draws the names. A name that would cover another one moves, or is left out.
   *
   * @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme
   * @param {number[]} shown the most important first
   */
  drawLabels(canvas, frame, theme, shown) {
    canvas.font = '600 11.5px system-ui, sans-serif';
    canvas.textAlign = 'left';
    canvas.textBaseline = 'middle';
    this.labels = [];
    const middles = shown.slice(0, 300).map((index) => this.middle(frame, index));
    for (const index of shown.slice(0, 300)) {
      const entity = this.story.entities[index];
      if (!entity) continue;
      const text = plain(entity.name, 28);
      const width = canvas.measureText(text).width + 15;
      const spot = this.freeSpot(frame, index, width, middles);
      if (!spot) continue;
      this.labels.push({ ...spot, width, height: 17, entity: index });
      canvas.globalAlpha = this.focus && !this.isEmphasized(index) ? 0.4 : 1;
      canvas.beginPath();
      canvas.roundRect(spot.x, spot.y, width, 17, 4);
      canvas.fillStyle = theme.label;
      canvas.fill();
      canvas.lineWidth = this.isEmphasized(index) ? 1.8 : 1;
      canvas.strokeStyle = this.color(theme, index);
      canvas.stroke();
      canvas.fillStyle = this.color(theme, index);
      canvas.fillRect(spot.x + 4, spot.y + 4, 3, 9);
      canvas.fillStyle = theme.text;
      canvas.fillText(text, spot.x + 10, spot.y + 9);
    }
    canvas.globalAlpha = 1;
  }

  /**
   * Returns a place for a name that covers neither another name nor the middle of a box.
   *
   * @param {Frame} frame @param {number} index @param {number} width @param {[number, number][]} middles of the boxes
   * @returns {{x: number, y: number}|null}
   */
  freeSpot(frame, index, width, middles) {
    const [x, y] = this.middle(frame, index);
    const [length, wide] = this.story.entities[index]?.size ?? [1, 1];
    const heading = this.places[index]?.heading ?? 0;
    const scale = frame.k * 100;
    const [cos, sin] = [Math.abs(Math.cos(heading)), Math.abs(Math.sin(heading))];
    const across = Math.max(8, ((length * cos + wide * sin) * scale) / 2) + 5;
    const up = Math.max(8, ((length * sin + wide * cos) * scale) / 2) + 4;
    /** @type {[number, number][]} */
    const spots = [
      [x - width / 2, y - up - 17],
      [x - width / 2, y + up],
      [x + across, y - 8.5],
      [x - across - width, y - 8.5],
      [x + across * 0.7, y - up - 17],
      [x - across * 0.7 - width, y - up - 17],
      [x + across * 0.7, y + up],
      [x - across * 0.7 - width, y + up],
      [x - width / 2, y - up - 37],
      [x - width / 2, y + up + 20],
    ];
    const isFree = (/** @type {[number, number]} */ [left, top]) =>
      left > 2 &&
      top > 2 &&
      left + width < frame.width - 2 &&
      top + 19 < frame.height &&
      middles.every(([mx, my]) => mx < left - 4 || mx > left + width + 4 || my < top - 3 || my > top + 20) &&
      this.labels.every(
        (other) =>
          left > other.x + other.width + 2 || left + width + 2 < other.x || top > other.y + 19 || top + 19 < other.y,
      );
    const free = spots.find(isFree) ?? (this.isEmphasized(index) ? spots[0] : undefined);
    return free ? { x: free[0], y: free[1] } : null;
  }

  /** Returns the entity at a pixel, or -1. @param {Frame} frame @param {number} px @param {number} py */
  pick(frame, px, py) {
    const label = this.labels.find(({ x, y, width, height }) => px >= x && px <= x + width && py >= y && py <= y + height);
    if (label) return label.entity;
    let [best, least] = [-1, Infinity];
    this.places.forEach((place, index) => {
      const entity = this.story.entities[index];
      if (!place || !entity) return;
      const [x, y] = this.middle(frame, index);
      const [dx, dy] = [px - x, y - py];
      const [cos, sin] = [Math.cos(place.heading), Math.sin(place.heading)];
      const along = Math.abs(dx * cos + dy * sin);
      const across = Math.abs(dy * cos - dx * sin);
      const half = entity.size.map((size) => Math.max(9, (size * frame.k * 100) / 2 + 2));
      const distance = Math.hypot(dx, dy);
      if (along <= (half[0] ?? 9) && across <= (half[1] ?? 9) && distance < least) [best, least] = [index, distance];
    });
    return best;
  }

  /** Returns the line at a pixel, or -1. @param {Frame} frame @param {number} px @param {number} py */
  pickCourse(frame, px, py) {
    let [best, least] = [-1, 6];
    this.lines.forEach((points, index) => {
      for (let i = 0; i + 3 < points.length; i += 2) {
        const from = onFrame(frame, points[i] ?? 0, points[i + 1] ?? 0);
        const to = onFrame(frame, points[i + 2] ?? 0, points[i + 3] ?? 0);
        const distance = distanceToSegment(px, py, from, to);
        if (distance < least) [best, least] = [index, distance];
      }
    });
    return best;
  }
}

/** @param {number} px @param {number} py @param {[number, number]} from @param {[number, number]} to */
function distanceToSegment(px, py, from, to) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const square = dx * dx + dy * dy;
  const share = square > 0 ? Math.min(1, Math.max(0, ((px - from[0]) * dx + (py - from[1]) * dy) / square)) : 0;
  return Math.hypot(px - from[0] - share * dx, py - from[1] - share * dy);
}

/** @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {Float64Array} points */
function tracePoints(canvas, frame, points) {
  canvas.beginPath();
  for (let i = 0; i + 1 < points.length; i += 2) {
    const [x, y] = onFrame(frame, points[i] ?? 0, points[i + 1] ?? 0);
    if (i === 0) canvas.moveTo(x, y);
    else canvas.lineTo(x, y);
  }
}

/** Draws arrow heads along a line and at its end. @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {Float64Array} points @param {string} color @param {number} size */
function drawArrows(canvas, frame, points, color, size) {
  canvas.fillStyle = color;
  let since = 60;
  for (let i = 0; i + 3 < points.length; i += 2) {
    const [x0, y0] = onFrame(frame, points[i] ?? 0, points[i + 1] ?? 0);
    const [x1, y1] = onFrame(frame, points[i + 2] ?? 0, points[i + 3] ?? 0);
    const length = Math.hypot(x1 - x0, y1 - y0);
    since += length;
    const isLast = i + 5 >= points.length;
    if (length < 0.5 || (since < 130 && !isLast)) continue;
    if (x1 < -20 || y1 < -20 || x1 > frame.width + 20 || y1 > frame.height + 20) continue;
    since = 0;
    canvas.save();
    canvas.translate(x1, y1);
    canvas.rotate(Math.atan2(y1 - y0, x1 - x0));
    canvas.beginPath();
    canvas.moveTo(size * 1.3, 0);
    canvas.lineTo(-size, size);
    canvas.lineTo(-size * 0.5, 0);
    canvas.lineTo(-size, -size);
    canvas.closePath();
    canvas.fill();
    canvas.restore();
  }
}

/** @param {CanvasRenderingContext2D} canvas @param {number} x @param {number} y @param {string} color @param {MapTheme} theme @param {number} radius */
function drawStop(canvas, x, y, color, theme, radius) {
  canvas.beginPath();
  canvas.arc(x, y, radius, 0, 2 * Math.PI);
  canvas.fillStyle = theme.label;
  canvas.fill();
  canvas.lineWidth = 2;
  canvas.strokeStyle = color;
  canvas.stroke();
}

/** @param {CanvasRenderingContext2D} canvas @param {number} x @param {number} y @param {string} color @param {MapTheme} theme */
function drawTarget(canvas, x, y, color, theme) {
  for (const [width, stroke] of /** @type {[number, string][]} */ ([
    [5, theme.halo],
    [2, color],
  ])) {
    canvas.lineWidth = width;
    canvas.strokeStyle = stroke;
    canvas.beginPath();
    canvas.arc(x, y, 6, 0, 2 * Math.PI);
    canvas.moveTo(x - 10, y);
    canvas.lineTo(x + 10, y);
    canvas.moveTo(x, y - 10);
    canvas.lineTo(x, y + 10);
    canvas.stroke();
  }
}

/**
 * Draws a box around the origin that faces to the right, with an arrow for its heading.
 *
 * @param {CanvasRenderingContext2D} canvas @param {number} length pixels @param {number} width
 * @param {string} kind @param {MapTheme} theme @param {boolean} sized whether its size is known
 */
function drawBox(canvas, length, width, kind, theme, sized) {
  const high = Math.max(width, 5);
  const radius = kind === 'Vehicle' ? Math.min(high * 0.28, length * 0.15) : kind === 'Pedestrian' ? high / 2 : 1;
  canvas.beginPath();
  canvas.roundRect(-length / 2, -high / 2, length, high, radius);
  canvas.lineWidth = 4;
  canvas.strokeStyle = theme.halo;
  canvas.stroke();
  canvas.fill();
  canvas.lineWidth = 1.3;
  canvas.strokeStyle = theme.bodyEdge;
  if (!sized) canvas.setLineDash([3, 2.5]);
  canvas.stroke();
  canvas.setLineDash([]);
  if (kind === 'MiscObject') return;
  const size = Math.min(high * 0.33, length * 0.3);
  canvas.beginPath();
  canvas.moveTo(length / 2 - high * 0.14, 0);
  canvas.lineTo(length / 2 - high * 0.14 - size * 1.25, size);
  canvas.lineTo(length / 2 - high * 0.14 - size * 1.25, -size);
  canvas.closePath();
  canvas.fillStyle = theme.bodyMark;
  canvas.fill();
}

/** Draws the sign of an entity whose box is too small. @param {CanvasRenderingContext2D} canvas @param {string} kind @param {MapTheme} theme */
function drawSign(canvas, kind, theme) {
  canvas.beginPath();
  if (kind === 'MiscObject') {
    canvas.rect(-4.5, -4.5, 9, 9);
  } else if (kind === 'Pedestrian') {
    canvas.arc(0, 0, 5, 0, 2 * Math.PI);
    canvas.moveTo(5, -3);
    canvas.lineTo(10, 0);
    canvas.lineTo(5, 3);
  } else {
    canvas.moveTo(9, 0);
    canvas.lineTo(-7, 6.5);
    canvas.lineTo(-3.5, 0);
    canvas.lineTo(-7, -6.5);
  }
  canvas.closePath();
  canvas.lineJoin = 'round';
  canvas.lineWidth = 4;
  canvas.strokeStyle = theme.halo;
  canvas.stroke();
  canvas.fill();
  canvas.lineWidth = 1.1;
  canvas.strokeStyle = theme.bodyEdge;
  canvas.stroke();
}

/** Draws lines at round coordinates, if there are no roads. @param {CanvasRenderingContext2D} canvas @param {Frame} frame @param {MapTheme} theme */
function drawMetres(canvas, frame, theme) {
  const step = 10 ** Math.ceil(Math.log10(50 / frame.k));
  const [x0, y0, x1, y1] = boxOfFrame(frame);
  canvas.beginPath();
  for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) {
    const [px] = onFrame(frame, x, 0);
    canvas.moveTo(px, 0);
    canvas.lineTo(px, frame.height);
  }
  for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) {
    const [, py] = onFrame(frame, 0, y);
    canvas.moveTo(0, py);
    canvas.lineTo(frame.width, py);
  }
  canvas.lineWidth = 1;
  canvas.strokeStyle = theme.grid;
  canvas.stroke();
}
