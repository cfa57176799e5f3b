// Lookup of positions: from a point of the map to road, section and lane, and from road and s to a point.

/** @typedef {{road: number, section: number, lane: number, s: number, t: number}} PlanSpot all lengths in centimetres */
/**
 * @typedef {object} PlanTarget
 * @property {number} [road]
 * @property {number} [section]
 * @property {number} [lane]
 * @property {number} [junction]
 * @property {number} [signal]
 * @property {number} [object]
 */
/**
 * @typedef {object} IndexedPlan
 * @property {Plan} plan
 * @property {Grid} sections
 * @property {Grid} junctions
 * @property {Grid} signals
 * @property {Grid} objects
 * @property {Map<string, number>} roadsById
 * @property {Map<string, number>} junctionsById
 */

/** @param {Plan} plan @returns {IndexedPlan} */
function indexPlan(plan) {
  /** @param {{id: string}[]} list */
  const byId = (list) => {
    /** @type {Map<string, number>} */
    const map = new Map();
    list.forEach(({ id }, index) => {
      if (!map.has(id)) map.set(id, index);
    });
    return map;
  };
  return {
    plan,
    sections: new Grid(plan.sections.map((section) => section.box)),
    junctions: new Grid(plan.junctions.map((junction) => junction.box)),
    signals: new Grid(plan.signals.map((signal) => signal.box)),
    objects: new Grid(plan.objects.map((object) => object.box)),
    roadsById: byId(plan.roads),
    junctionsById: byId(plan.junctions),
  };
}

/** Returns both ends of a line at level 0. @param {Plan} plan @param {number} line */
function lineRange(plan, line) {
  const start = plan.levels[0]?.start;
  return [start?.[line] ?? 0, start?.[line + 1] ?? 0];
}

/**
 * Checks whether a ray to the right crosses a part of a line an odd number of times.
 *
 * @param {Plan} plan
 * @param {number} line
 * @param {number} x
 * @param {number} y
 */
function crossings(plan, line, x, y) {
  const level = /** @type {LevelOfLines} */ (plan.levels[0]);
  const [from = 0, to = 0] = lineRange(plan, line);
  let odd = false;
  for (let i = from; i + 1 < to; i++)
    odd = crosses(level.x[i], level.y[i], level.x[i + 1], level.y[i + 1], x, y) !== odd;
  return odd;
}

/**
 * @param {number|undefined} x0
 * @param {number|undefined} y0
 * @param {number|undefined} x1
 * @param {number|undefined} y1
 * @param {number} x
 * @param {number} y
 */
function crosses(x0 = 0, y0 = 0, x1 = 0, y1 = 0, x, y) {
  return y0 > y !== y1 > y && x < ((x1 - x0) * (y - y0)) / (y1 - y0) + x0;
}

/** @param {Plan} plan @param {PlanLane} lane @param {number} x @param {number} y */
function isInLane(plan, lane, x, y) {
  const level = /** @type {LevelOfLines} */ (plan.levels[0]);
  const [i0 = 0, i1 = 0] = lineRange(plan, lane.inner);
  const [o0 = 0, o1 = 0] = lineRange(plan, lane.outer);
  if (i1 === i0 || o1 === o0) return false;
  let odd = crossings(plan, lane.inner, x, y) !== crossings(plan, lane.outer, x, y);
  odd = crosses(level.x[i0], level.y[i0], level.x[o0], level.y[o0], x, y) !== odd;
  return crosses(level.x[i1 - 1], level.y[i1 - 1], level.x[o1 - 1], level.y[o1 - 1], x, y) !== odd;
}

/** Maximum number of overlapping lanes that are examined for a pointer position. */
const MOST_LANES_TRIED = 400;

/**
 * Returns the road and the lane at a point. Of several it returns the last one, which is drawn on top.
 *
 * @param {IndexedPlan} indexed
 * @param {number} x
 * @param {number} y
 * @returns {PlanSpot|null}
 */
function spotAt(indexed, x, y) {
  const { plan } = indexed;
  const near = indexed.sections.within([x, y, x, y]);
  let tried = 0;
  for (let i = near.length - 1; i >= 0; i--) {
    const section = plan.sections[near[i] ?? -1];
    if (!section) continue;
    for (const lane of section.lanes) {
      if (++tried > MOST_LANES_TRIED) return null;
      if (!isInLane(plan, lane, x, y)) continue;
      const road = plan.roads[section.road];
      const at = road ? projectOn(plan, road, x, y) : null;
      return { road: section.road, section: section.index, lane: lane.id, s: at?.s ?? section.s0, t: at?.t ?? 0 };
    }
  }
  return null;
}

/**
 * Returns the nearest station of a road's reference line.
 *
 * @param {Plan} plan
 * @param {PlanRoad} road
 * @param {number} x
 * @param {number} y
 */
function projectOn(plan, road, x, y) {
  const level = /** @type {LevelOfLines} */ (plan.levels[0]);
  const [from = 0, to = 0] = lineRange(plan, road.line);
  let best = { s: 0, t: 0, distance: Infinity };
  for (let i = from; i + 1 < to; i++) {
    const x0 = level.x[i] ?? 0;
    const y0 = level.y[i] ?? 0;
    const dx = (level.x[i + 1] ?? 0) - x0;
    const dy = (level.y[i + 1] ?? 0) - y0;
    const square = dx * dx + dy * dy;
    const share = square === 0 ? 0 : Math.min(1, Math.max(0, ((x - x0) * dx + (y - y0) * dy) / square));
    const distance = Math.hypot(x - x0 - share * dx, y - y0 - share * dy);
    if (distance >= best.distance) continue;
    const s0 = road.stations[i - from] ?? 0;
    const s1 = road.stations[i - from + 1] ?? s0;
    const left = dx * (y - y0) - dy * (x - x0);
    best = { s: s0 + share * (s1 - s0), t: left < 0 ? -distance : distance, distance };
  }
  return best.distance === Infinity ? null : best;
}

/**
 * Returns the point of a reference line at s, with the direction at this point.
 *
 * @param {Plan} plan
 * @param {PlanRoad} road
 * @param {number} s
 */
function pointAt(plan, road, s) {
  const level = /** @type {LevelOfLines} */ (plan.levels[0]);
  const [from = 0, to = 0] = lineRange(plan, road.line);
  if (to - from === 0) return null;
  let low = 0;
  let high = to - from - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((road.stations[middle] ?? 0) <= s) low = middle;
    else high = middle;
  }
  const s0 = road.stations[low] ?? 0;
  const s1 = road.stations[high] ?? s0;
  const share = s1 > s0 ? Math.min(1, Math.max(0, (s - s0) / (s1 - s0))) : 0;
  const [x0, y0] = [level.x[from + low] ?? 0, level.y[from + low] ?? 0];
  const [x1, y1] = [level.x[from + high] ?? 0, level.y[from + high] ?? 0];
  return { x: x0 + share * (x1 - x0), y: y0 + share * (y1 - y0), heading: Math.atan2(y1 - y0, x1 - x0) };
}

/** @param {Plan} plan @param {readonly number[]} lines @returns {Box} */
function boxOfLines(plan, lines) {
  const level = /** @type {LevelOfLines} */ (plan.levels[0]);
  const box = emptyBox();
  for (const line of lines) {
    const [from = 0, to = 0] = lineRange(plan, line);
    for (let i = from; i < to; i++) {
      const x = level.x[i] ?? 0;
      const y = level.y[i] ?? 0;
      growBox(box, [x, y, x, y]);
    }
  }
  return box;
}

/** @param {Plan} plan @param {PlanTarget} target */
function lanesOf(plan, target) {
  const road = target.road === undefined ? undefined : plan.roads[target.road];
  const sections =
    road?.sections.filter((section) => target.section === undefined || section.index === target.section) ?? [];
  return sections.flatMap((section) =>
    section.lanes.filter((lane) => target.lane === undefined || lane.id === target.lane),
  );
}

/**
 * Returns the box of a target, empty if it is not on the map.
 *
 * @param {Plan} plan
 * @param {PlanTarget} target
 * @returns {Box}
 */
function boxOfTarget(plan, target) {
  const section = plan.roads[target.road ?? -1]?.sections[target.section ?? -1];
  // The center lane has no width, so the center line is used.
  if (section && target.lane === 0) return boxOfLines(plan, [section.center]);
  if (section && target.lane === undefined) return section.box;
  if (target.lane !== undefined)
    return boxOfLines(
      plan,
      lanesOf(plan, target).flatMap((lane) => [lane.inner, lane.outer]),
    );
  const whole =
    plan.signals[target.signal ?? -1] ??
    plan.roads[target.road ?? -1] ??
    plan.junctions[target.junction ?? -1] ??
    plan.objects[target.object ?? -1];
  return whole?.box ?? emptyBox();
}

/** Returns a point for a target without one. @param {Plan} plan @param {PlanTarget} target */
function anchorOf(plan, target) {
  const road = plan.roads[target.road ?? -1];
  if (road) {
    const section = road.sections[target.section ?? -1];
    const point = pointAt(plan, road, section ? (section.s0 + section.s1) / 2 : road.length / 2);
    if (point) return { x: point.x, y: point.y };
  }
  const box = boxOfTarget(plan, target);
  return box[0] <= box[2] ? { x: (box[0] + box[2]) / 2, y: (box[1] + box[3]) / 2 } : null;
}

/** Returns the linearly interpolated width of a lane. @param {Float64Array} pairs @param {number} s */
function valueAt(pairs, s) {
  const count = pairs.length / 2;
  if (count === 0) return NaN;
  let i = 0;
  while (i + 1 < count && (pairs[2 * i + 2] ?? 0) <= s) i++;
  const [s0, v0] = [pairs[2 * i] ?? 0, pairs[2 * i + 1] ?? 0];
  if (i + 1 >= count) return v0;
  const [s1, v1] = [pairs[2 * i + 2] ?? s0, pairs[2 * i + 3] ?? v0];
  return s1 > s0 && s >= s0 ? v0 + ((s - s0) / (s1 - s0)) * (v1 - v0) : v0;
}
