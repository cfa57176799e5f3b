// Map element. It draws after changes, shows the pointer's position and reports clicks.

/**
 * @typedef {object} MapEvents
 * @property {(finding: number) => void} finding called for a clicked marker
 * @property {(members: number[], x: number, y: number) => void} several called for several markers at one place
 * @property {(road: number, x: number) => void} road
 * @property {() => void} nothing
 * @property {(entity: number) => void} [actor] called for a clicked entity
 * @property {(course: number) => void} [course] called for a clicked route or trajectory
 */

const DOUBLE_CLICK_MILLISECONDS = 220;

/**
 * Returns a sentence about items whose distance from the roads exceeds the size of the road network, or an empty text.
 *
 * @param {Plan} plan
 */
function farSentence(plan) {
  if (!plan.roadBox) return '';
  const [x0, y0, x1, y1] = plan.roadBox;
  const size = Math.max(x1 - x0, y1 - y0);
  const isFar = (/** @type {{box: Box}} */ { box }) =>
    box[0] <= box[2] && Math.max(x0 - box[0], y0 - box[1], box[2] - x1, box[3] - y1) > size;
  const parts = /** @type {[{box: Box}[], string][]} */ ([
    [plan.signals, 'signal'],
    [plan.objects, 'object'],
    [plan.junctions, 'junction'],
  ])
    .map(([list, one]) => ({ count: list.filter(isFar).length, one }))
    .filter(({ count }) => count > 0);
  if (parts.length === 0) return '';
  const lies = parts.length === 1 && parts[0]?.count === 1 ? 'lies' : 'lie';
  return `${parts.map(({ count, one }) => counted(count, one)).join(' and ')} ${lies} far outside the view`;
}

class PlanView {
  /** @param {Plan} plan @param {Theme} theme @param {MapEvents} events */
  constructor(plan, theme, events) {
    this.indexed = indexPlan(plan);
    this.plan = plan;
    this.theme = theme;
    this.events = events;
    this.painter = new BasePainter(this.indexed);
    this.tiles = new TileStore(this.painter);
    this.markers = new Markers();
    this.selected = -1;
    /** @type {PlanTarget[]} */
    this.targets = [];
    /** Further places of the selected finding. @type {{x: number, y: number}[]} */
    this.further = [];
    /** Entities of a scenario. @type {ActorLayer|null} */
    this.actors = null;
    /** Part that is shown first; null: all roads. @type {Box|null} */
    this.home = null;
    /** Camera that showed it. @type {{x: number, y: number, k: number}|null} */
    this.first = null;
    /** @type {number} */
    this.road = -1;
    /** Station on the selected road at the pointer's position in its profile. @type {number|null} */
    this.station = null;
    this.roadTimer = 0;
    this.pending = false;
    this.sized = false;
    this.frames = { painted: 0, longest: 0, total: 0, firstPaint: 0, last: 0, gap: 0 };
    this.canvas = withAttributes(make('canvas', 'map-canvas'), {
      tabindex: 0,
      role: 'img',
      'aria-label': 'Map of the roads with the findings; the table shows the same as text',
    });
    this.readout = make('div', 'readout');
    this.scaleBar = make('div', 'scale-bar', make('span', ''));
    this.north = withAttributes(make('div', 'north', make('span', '', '▲'), make('span', '', 'N')), {
      title: 'y points up',
      'aria-hidden': 'true',
    });
    this.said = withAttributes(make('span', 'map-said'), { role: 'status' });
    this.notes = make('div', 'map-notes', this.farNote(), this.said);
    this.element = make('div', 'map', this.canvas, this.north, this.scaleBar, this.readout, this.notes);
    this.say('');
    this.camera = new Camera(() => this.refresh());
    this.input = new CameraInput(
      this.canvas,
      this.camera,
      (x, y) => this.click(x, y),
      (x, y, inside) => this.hover(x, y, inside),
    );
    this.canvas.addEventListener('dblclick', () => clearTimeout(this.roadTimer));
    theme.listeners.push(() => this.refresh());
    new ResizeObserver(() => this.resize()).observe(this.element);
    this.hover(0, 0, false);
  }

  farNote() {
    const sentence = farSentence(this.plan);
    if (sentence === '') return null;
    const everything = makeButton('link', 'Show everything', () => {
      if (this.plan.box) void this.camera.fit(this.plan.box);
    });
    return make('span', 'far', `${sentence} `, everything);
  }

  /** Shows a sentence about the selection below the scale. @param {string} sentence empty: nothing */
  say(sentence) {
    this.said.textContent = sentence;
    this.element.classList.toggle('with-notes', sentence !== '' || this.notes.querySelector('.far') !== null);
  }

  /** @returns {MapTheme} */
  get colors() {
    return this.theme.dark && !this.printing ? MAP_THEMES.dark : MAP_THEMES.light;
  }

  printing = false;

  resize() {
    const { clientWidth, clientHeight } = this.element;
    if (clientWidth < 2 || clientHeight < 2) return;
    this.camera.width = clientWidth;
    this.camera.height = clientHeight;
    this.tiles.clear();
    // The scenario stays in sight until somebody moves the map.
    if (!this.sized || (this.home && this.isAtHome())) {
      this.sized = true;
      this.goHome();
    }
    this.paint(performance.now(), 40);
    this.refresh();
  }

  /** Shows the first part of the map at once. */
  goHome() {
    const box = this.home ?? this.plan.roadBox;
    if (!box) return;
    const [x0, y0, x1, y1] = box;
    const { camera } = this;
    this.first = {
      x: (x0 + x1) / 2,
      y: (y0 + y1) / 2,
      k: camera.scaleFor((x1 - x0) / 2, (y1 - y0) / 2),
    };
    Object.assign(camera, this.first);
  }

  isAtHome() {
    const { camera, first } = this;
    return first !== null && camera.x === first.x && camera.y === first.y && camera.k === first.k;
  }

  refresh() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => {
      this.pending = false;
      this.paint(now, BUDGET);
    });
  }

  /** @param {number} now @param {number} budget milliseconds for drawing the map itself */
  paint(now, budget) {
    if (!this.sized) return;
    const began = performance.now();
    const flying = this.camera.step(now);
    const ratio = Math.min(3, window.devicePixelRatio || 1);
    const { canvas } = this;
    const frame = this.camera.frame();
    const [wide, high] = [Math.max(1, Math.round(frame.width * ratio)), Math.max(1, Math.round(frame.height * ratio))];
    if (canvas.width !== wide || canvas.height !== high) {
      canvas.width = wide;
      canvas.height = high;
      this.tiles.clear();
    }
    const context = canvas.getContext('2d', { alpha: false });
    if (!context) return;
    const more = this.tiles.advance(frame, ratio, this.colors, this.tiles.front ? budget : Math.max(budget, 40));
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    this.tiles.draw(context, frame, this.colors);
    this.overlay(context, frame);
    this.drawScale();
    this.count(performance.now() - began);
    if (flying || more) this.refresh();
  }

  /** Draws everything at once for printing. */
  paintWhole() {
    this.paint(performance.now(), Infinity);
    this.paint(performance.now(), Infinity);
  }

  /** @param {number} took */
  count(took) {
    const { frames } = this;
    frames.painted++;
    frames.total += took;
    frames.longest = Math.max(frames.longest, took);
    const now = performance.now();
    if (frames.firstPaint === 0) frames.firstPaint = now;
    // Only consecutive frames count, because no frame is drawn while nothing changes.
    const gap = now - frames.last;
    if (gap < 250) frames.gap = frames.gap === 0 ? gap : frames.gap * 0.9 + gap * 0.1;
    frames.last = now;
  }

  /** @param {CanvasRenderingContext2D} context @param {Frame} frame */
  overlay(context, frame) {
    const { colors } = this;
    if (this.road >= 0) this.highlight(context, frame, [{ road: this.road }], 0.45);
    this.highlight(context, frame, this.targets, 1);
    for (const { x, y } of this.further) {
      const [px, py] = onFrame(frame, x, y);
      ring(context, px, py, 7, colors);
    }
    this.actors?.draw(context, frame, colors);
    this.markers.draw(context, frame, colors, this.selected);
    const road = this.plan.roads[this.road];
    if (road && this.station !== null) {
      const point = pointAt(this.plan, road, this.station);
      if (point) this.crosshair(context, frame, point);
    }
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Frame} frame
   * @param {PlanTarget[]} targets
   * @param {number} strength
   */
  highlight(context, frame, targets, strength) {
    if (targets.length === 0) return;
    context.beginPath();
    for (const target of targets.slice(0, 200)) traceTarget(this.painter, context, frame, target);
    context.fillStyle = this.colors.highlightFill;
    if (strength === 1) context.fill();
    context.lineJoin = 'round';
    context.lineWidth = 5;
    context.strokeStyle = this.colors.highlightHalo;
    context.globalAlpha = 0.8 * strength;
    context.stroke();
    context.lineWidth = 2.2;
    context.globalAlpha = strength === 1 ? 1 : 0.7;
    context.strokeStyle = this.colors.highlight;
    context.stroke();
    context.globalAlpha = 1;
  }

  /**
   * @param {CanvasRenderingContext2D} context
   * @param {Frame} frame
   * @param {{x: number, y: number, heading: number}} point
   */
  crosshair(context, frame, point) {
    const [x, y] = onFrame(frame, point.x, point.y);
    const [dx, dy] = [Math.sin(point.heading) * 16, Math.cos(point.heading) * 16];
    for (const [width, color] of /** @type {[number, string][]} */ ([
      [6, this.colors.highlightHalo],
      [2.5, this.colors.highlight],
    ])) {
      context.lineWidth = width;
      context.strokeStyle = color;
      context.beginPath();
      context.moveTo(x - dx, y - dy);
      context.lineTo(x + dx, y + dy);
      context.stroke();
    }
  }

  drawScale() {
    const most = 130 / this.camera.k / 100;
    const power = 10 ** Math.floor(Math.log10(most));
    const metres = power * (most / power >= 5 ? 5 : most / power >= 2 ? 2 : 1);
    this.scaleBar.style.width = `${metres * 100 * this.camera.k}px`;
    const label =
      metres >= 1000 ? `${metres / 1000} km` : metres >= 1 ? `${metres} m` : `${Math.round(metres * 100)} cm`;
    if (this.scaleBar.firstChild) this.scaleBar.firstChild.textContent = label;
  }

  /** @param {number} px @param {number} py @returns {[number, number]} cm from the origin */
  toPlan(px, py) {
    const frame = this.camera.frame();
    return [(px - frame.width / 2) / frame.k + frame.x, (frame.height / 2 - py) / frame.k + frame.y];
  }

  /** @param {number} px @param {number} py @param {boolean} inside */
  hover(px, py, inside) {
    const marker = inside && this.markers.pick(this.camera.frame(), px, py) !== null;
    const actor = inside && !marker ? this.hoverActor(px, py) : '';
    this.canvas.classList.toggle('on-marker', marker || actor !== '');
    if (!inside) {
      this.hoverActor(NaN, NaN);
      this.readout.textContent = '';
      return;
    }
    const [x, y] = this.toPlan(px, py);
    const { origin } = this.plan;
    const spot = spotAt(this.indexed, x, y);
    const road = spot ? this.plan.roads[spot.road] : undefined;
    const where =
      spot && road
        ? `road ${plain(road.id, 40)}   lane ${spot.lane}   s ${fixed(spot.s / 100)}   t ${fixed(spot.t / 100)}`
        : '';
    this.readout.textContent = `${actor}x ${fixed(origin.x + x / 100)}   y ${fixed(origin.y + y / 100)}${where ? `   ${where}` : ''}`;
  }

  /** Emphasizes the entity at a pixel. Returns its name for the readout. @param {number} px @param {number} py */
  hoverActor(px, py) {
    const { actors } = this;
    if (!actors) return '';
    const frame = this.camera.frame();
    const entity = Number.isFinite(px) ? actors.pick(frame, px, py) : -1;
    if (entity !== actors.hovered) {
      actors.hovered = entity;
      this.refresh();
    }
    const course = entity < 0 && Number.isFinite(px) ? actors.pickCourse(frame, px, py) : -1;
    const name = actors.story.entities[entity]?.name ?? courseName(actors.story.courses[course]);
    return name ? `${plain(name, 60)}   ` : '';
  }

  /** Handles a click on the scenario. Returns whether something is there. @param {number} px @param {number} py */
  clickActor(px, py) {
    const frame = this.camera.frame();
    const entity = this.actors?.pick(frame, px, py) ?? -1;
    const course = entity < 0 ? (this.actors?.pickCourse(frame, px, py) ?? -1) : -1;
    if (entity >= 0) this.events.actor?.(entity);
    else if (course >= 0) this.events.course?.(course);
    return entity >= 0 || course >= 0;
  }

  /** @param {number} px @param {number} py */
  click(px, py) {
    clearTimeout(this.roadTimer);
    const cluster = this.markers.pick(this.camera.frame(), px, py);
    const [first] = cluster?.members ?? [];
    if (cluster && cluster.members.length > 1) {
      const extent = Math.max(cluster.box[2] - cluster.box[0], cluster.box[3] - cluster.box[1]);
      if (extent > 100 && this.camera.k * 100 < 40) void this.camera.fit(cluster.box);
      else this.events.several(cluster.members, px, py);
      return;
    }
    if (first !== undefined) {
      this.events.finding(first);
      return;
    }
    if (this.clickActor(px, py)) return;
    const [x, y] = this.toPlan(px, py);
    const spot = spotAt(this.indexed, x, y);
    this.events.nothing();
    // A second click would make it a double click, which zooms.
    if (spot) this.roadTimer = setTimeout(() => this.events.road(spot.road, px), DOUBLE_CLICK_MILLISECONDS);
  }

  /** Shows the scenario, or all roads of a map. @returns {Promise<void>} */
  fit() {
    return this.home ? this.camera.fit(this.home) : this.fitRoads();
  }

  /** Shows all roads. @returns {Promise<void>} */
  fitRoads() {
    const box = this.plan.roadBox ?? this.home;
    return box ? this.camera.fit(box) : Promise.resolve();
  }

  /** Flies to a finding. @param {Finding} finding @returns {Promise<void>} */
  show(finding) {
    const { anchor } = finding;
    if (!anchor) return Promise.resolve();
    // At least 25 m to each side are shown, and more if the finding is about a whole element.
    const half = [2500, 2500];
    if (finding.wholeElement) {
      for (const target of this.targets) {
        const box = boxOfTarget(this.plan, target);
        if (!(box[0] <= box[2])) continue;
        half[0] = Math.max(half[0] ?? 0, anchor.x - box[0], box[2] - anchor.x);
        half[1] = Math.max(half[1] ?? 0, anchor.y - box[1], box[3] - anchor.y);
      }
    }
    return this.camera.fly(anchor.x, anchor.y, this.camera.scaleFor(half[0] ?? 2500, half[1] ?? 2500));
  }
}

/** @param {StoryCourse|undefined} course */
function courseName(course) {
  return course ? `${course.kind} ${course.name}`.trim() : '';
}

/** Returns the legend of the kinds of lanes on the map. @param {PlanView} view @param {Theme} theme */
function legend(view, theme) {
  const used = new Set(view.painter.kinds.flatMap((kinds) => [...kinds]));
  const list = make('ul');
  const fill = () => {
    const kinds = LANE_KINDS.map((kind, index) => ({ ...kind, index }))
      .filter(({ index }) => used.has(index))
      .reverse();
    list.replaceChildren(
      ...kinds.map(({ name, light, dark }) => {
        const swatch = make('span', 'swatch');
        swatch.style.background = theme.dark ? dark : light;
        return make('li', '', swatch, name);
      }),
    );
  };
  fill();
  theme.listeners.push(fill);
  return make('details', 'legend', make('summary', '', 'Lanes'), list);
}
