// Model of the story of a scenario: entities, lines and the tree of the storyboard. Values of a wrong type become null
// or empty, because the data are not trusted.

/** @typedef {{earliest: number, latest: number}} Moment in seconds; Infinity: never */

/**
 * @typedef {object} StoryEntity
 * @property {number} index
 * @property {string} name
 * @property {string} kind `Vehicle`, `Pedestrian`, `MiscObject` or another word
 * @property {string} category
 * @property {[number, number]} size length and width in metres
 * @property {boolean} sized whether the size is known
 * @property {[number, number]} center vector from the reference point to the centre of the box
 * @property {{x: number, y: number, heading: number}|null} at in metres of the map
 * @property {number|null} speed
 * @property {string} text
 */

/**
 * @typedef {object} StoryCourse
 * @property {number} index
 * @property {'route'|'trajectory'|'target'} kind
 * @property {string} name
 * @property {number} element -1: an action of `Init`
 * @property {number[]} entities
 * @property {number[]} points x and y in metres of the map, in turns
 * @property {number[]} stops likewise
 * @property {boolean} exact
 * @property {number} unplaced number of positions without a known place
 */

/**
 * @typedef {object} StoryElement
 * @property {number} index
 * @property {string} kind
 * @property {string} name
 * @property {string} action
 * @property {number} parent -1: none
 * @property {number} depth
 * @property {number[]} children
 * @property {number[]} actors entities of the maneuver group at or around it, or of all groups below it
 * @property {string} file
 * @property {boolean} own whether it is in the checked file
 * @property {number} row
 * @property {number} lastRow
 * @property {number} column
 * @property {Moment} start
 * @property {Moment} end
 * @property {string} head
 * @property {string} text
 * @property {number[]} findings indices
 */

/** Box of an entity without a known size, in metres. @type {Record<string, [number, number]>} */
const DEFAULT_SIZES = { Vehicle: [4.5, 1.8], Pedestrian: [0.6, 0.6] };

/** Greatest length of a box in metres; a longer one is a mistake and would cover the map. */
const LONGEST_BOX = 200;

const STORY_KINDS = ['story', 'act', 'maneuverGroup', 'maneuver', 'event', 'action'];

/** @param {unknown} value @returns {Moment} */
function momentOf(value) {
  const [earliest, latest] = listOf(value);
  return { earliest: numberOrNull(earliest) ?? Infinity, latest: numberOrNull(latest) ?? Infinity };
}

/** @param {unknown} value @param {number} length @returns {number[]} */
function indicesOf(value, length) {
  return listOf(value).filter((index) => indexInto(index, length) >= 0);
}

/** @param {unknown} value @returns {[number, number]|null} */
function pairOf(value) {
  const [a, b] = listOf(value);
  return isFiniteNumber(a) && isFiniteNumber(b) ? [a, b] : null;
}

/** @param {unknown} value @returns {number[]} an even number of finite numbers */
function pointsOf(value) {
  const list = listOf(value);
  /** @type {number[]} */
  const points = [];
  for (let i = 0; i + 1 < list.length; i += 2) {
    const [x, y] = [list[i], list[i + 1]];
    if (isFiniteNumber(x) && isFiniteNumber(y)) points.push(x, y);
  }
  return points;
}

/** @param {any} raw @param {number} index @returns {StoryEntity} */
function storyEntity(raw, index) {
  const kind = textOf(raw?.kind);
  const [x, y, heading] = listOf(raw?.at);
  const size = pairOf(raw?.size);
  const sized = size !== null && size[0] > 0 && size[1] > 0 && Math.max(...size) <= LONGEST_BOX;
  return {
    index,
    name: textOf(raw?.name),
    kind,
    category: textOf(raw?.category),
    size: sized ? size : (DEFAULT_SIZES[kind] ?? [1, 1]),
    sized,
    center: sized ? (pairOf(raw?.center) ?? [0, 0]) : [0, 0],
    at: isFiniteNumber(x) && isFiniteNumber(y) ? { x, y, heading: numberOrNull(heading) ?? 0 } : null,
    speed: numberOrNull(raw?.speed),
    text: textOf(raw?.text),
  };
}

/** @param {any} raw @param {number} index @param {string} checked @param {number} entities @returns {StoryElement} */
function storyElement(raw, index, checked, entities) {
  const [row, lastRow] = listOf(raw?.rows);
  const kind = textOf(raw?.kind);
  return {
    index,
    kind: STORY_KINDS.includes(kind) ? kind : 'element',
    name: textOf(raw?.name),
    action: textOf(raw?.action),
    parent: indexInto(raw?.parent, index),
    depth: 0,
    children: [],
    actors: indicesOf(raw?.actors, entities),
    file: textOf(raw?.file) || checked,
    own: typeof raw?.file !== 'string',
    row: numberOrNull(row) ?? 0,
    lastRow: numberOrNull(lastRow) ?? 0,
    column: numberOrNull(raw?.column) ?? 1,
    start: momentOf(raw?.start),
    end: momentOf(raw?.end),
    head: textOf(raw?.head) || 'element',
    text: textOf(raw?.text),
    findings: [],
  };
}

/** @param {any} raw @param {number} index @param {number} elements @param {number} entities @returns {StoryCourse} */
function storyCourse(raw, index, elements, entities) {
  const kind = raw?.kind === 'route' || raw?.kind === 'trajectory' ? raw.kind : 'target';
  return {
    index,
    kind,
    name: textOf(raw?.name),
    element: indexInto(raw?.element, elements),
    entities: indicesOf(raw?.entities, entities),
    points: pointsOf(raw?.points),
    stops: pointsOf(raw?.stops),
    exact: raw?.exact === true,
    unplaced: numberOrNull(raw?.unplaced) ?? 0,
  };
}

class StoryModel {
  /** @param {Record<string, any>} data of the whole page @param {readonly Finding[]} findings */
  constructor(data, findings) {
    const raw = data.story;
    const checked = textOf(data.file?.path) || textOf(data.file?.name);
    this.timed = raw?.timed !== false;
    this.entities = listOf(raw?.entities).map(storyEntity);
    const { length } = this.entities;
    this.elements = listOf(raw?.elements).map((element, index) => storyElement(element, index, checked, length));
    this.courses = listOf(raw?.courses).map((course, index) =>
      storyCourse(course, index, this.elements.length, length),
    );
    this.globals = listOf(raw?.globals).map(textOf);
    this.gaps = listOf(raw?.gaps).map((gap) => ({
      text: textOf(gap?.text),
      where: whereOf({ file: textOf(gap?.file) || checked, row: numberOrNull(gap?.row), column: null }),
    }));
    this.cuts = listOf(raw?.cuts);
    this.run = { end: momentOf(raw?.run?.end), text: textOf(raw?.run?.text) };
    /** Elements without a parent. @type {number[]} */
    this.roots = [];
    this.grow();
    this.point(findings);
  }

  /** Sets children, depths and inherited actors. */
  grow() {
    for (const element of this.elements) {
      const parent = this.elements[element.parent];
      if (!parent) {
        this.roots.push(element.index);
        continue;
      }
      parent.children.push(element.index);
      element.depth = parent.depth + 1;
      if (element.actors.length === 0 && parent.depth >= 2) element.actors = parent.actors;
    }
    // A story and an act have the actors of all groups in them.
    for (const element of [...this.elements].reverse()) {
      const parent = this.elements[element.parent];
      if (!parent || parent.depth > 1) continue;
      parent.actors = [...new Set([...parent.actors, ...element.actors])].sort((a, b) => a - b);
    }
  }

  /** Lists the findings of each element: those within its rows, but in none of its children. @param {readonly Finding[]} findings */
  point(findings) {
    /** @type {Map<string, StoryElement[]>} */
    const byFile = new Map();
    for (const element of this.elements) {
      const list = byFile.get(element.file) ?? [];
      list.push(element);
      byFile.set(element.file, list);
    }
    for (const list of byFile.values()) list.sort((a, b) => a.row - b.row || a.index - b.index);
    for (const finding of findings) {
      for (const { file, row } of finding.places) {
        const element = row === null ? null : this.innermost(byFile.get(file) ?? [], row);
        if (element && element.findings.at(-1) !== finding.index) element.findings.push(finding.index);
      }
    }
  }

  /** @param {StoryElement[]} list by rows @param {number} row @returns {StoryElement|null} */
  innermost(list, row) {
    let [low, high] = [0, list.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if ((list[middle]?.row ?? 0) <= row) low = middle + 1;
      else high = middle;
    }
    /** @type {StoryElement|undefined} */
    let element = list[low - 1];
    while (element && element.lastRow < row) {
      /** @type {StoryElement|undefined} */
      const parent = this.elements[element.parent];
      element = parent?.file === element.file ? parent : undefined;
    }
    return element ?? null;
  }

  /** Returns the element that a finding points at, or -1. @param {number} finding */
  elementOf(finding) {
    return this.elements.findIndex(({ findings }) => findings.includes(finding));
  }

  /** Returns an element and the elements around it. @param {number} index */
  around(index) {
    /** @type {number[]} */
    const all = [];
    for (let at = index; this.elements[at]; at = this.elements[at]?.parent ?? -1) all.push(at);
    return all;
  }

  /** Returns the lines of an element and of the elements in it. @param {number} index @returns {StoryCourse[]} */
  coursesOf(index) {
    return this.courses.filter(({ element }) => this.around(element).includes(index));
  }

  /** Returns the colour index of an element, or -1 if it has several actors or none. @param {StoryElement} element */
  colorOf({ actors }) {
    return actors.length === 1 ? (actors[0] ?? -1) : -1;
  }

  /** Returns all points that are drawn, in turns x and y. @returns {Generator<[number, number], void, void>} */
  *places() {
    for (const { at } of this.entities) if (at) yield [at.x, at.y];
    for (const { points, stops } of this.courses)
      for (const list of [points, stops])
        for (let i = 0; i + 1 < list.length; i += 2) yield [list[i] ?? 0, list[i + 1] ?? 0];
  }
}

/** Returns the bytes of a plan without roads around a point. @param {number} x metres @param {number} y */
function emptyPlan(x, y) {
  const bytes = new Uint8Array(27);
  bytes.set([81, 67, 80, 76, 1]);
  const view = new DataView(bytes.buffer);
  view.setFloat64(5, x, true);
  view.setFloat64(13, y, true);
  return bytes;
}
