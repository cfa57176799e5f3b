// Reader of the binary `plan` of docs/html-report.md. It fills flat arrays: a big map has two million points, and an
// object for each is slow to create and to draw. All lengths and coordinates are in centimetres from the origin.

/** @typedef {[number, number, number, number]} Box least x, least y, greatest x, greatest y */

/**
 * @typedef {object} PlanLane
 * @property {number} id 0 if the id in the file is not an integer
 * @property {boolean} left whether it is left of the center line
 * @property {string} type
 * @property {number} inner line towards the center
 * @property {number} outer its own line
 * @property {Float64Array} widths pairs of s from the start of the section and width
 */

/**
 * @typedef {object} PlanSection
 * @property {number} road
 * @property {number} index in its road
 * @property {number} s0
 * @property {number} s1
 * @property {number} center line
 * @property {PlanLane[]} lanes left lanes from the center outwards, then right lanes from the center outwards
 * @property {Box} box
 */

/** @typedef {{kind: number, id: string}} PlanLink kind 0: none, 1: road, 2: junction */

/**
 * @typedef {object} PlanRoad
 * @property {string} id
 * @property {string} name
 * @property {number} junction -1: none
 * @property {boolean} leftHand
 * @property {boolean} drawable
 * @property {number} length
 * @property {number} line the reference line
 * @property {Float64Array} stations s of the points of the reference line
 * @property {Float64Array} elevation pairs of s and z
 * @property {PlanLink} predecessor
 * @property {PlanLink} successor
 * @property {PlanSection[]} sections
 * @property {Box} box
 */

/**
 * @typedef {object} PlanJunction
 * @property {string} id
 * @property {string} name
 * @property {string} type
 * @property {[number, number][]} connections
 * @property {Int32Array} outline
 * @property {Box} box
 */
/**
 * @typedef {object} PlanSignal
 * @property {string} id
 * @property {string} name
 * @property {string} type
 * @property {string} subtype
 * @property {number} road
 * @property {number} s
 * @property {number} t
 * @property {number} x
 * @property {number} y
 * @property {number} heading
 * @property {boolean} dynamic
 * @property {Box} box
 */
/**
 * @typedef {object} PlanObject
 * @property {string} id
 * @property {string} name
 * @property {string} type
 * @property {number} road
 * @property {number} s
 * @property {number} t
 * @property {Int32Array} outline
 * @property {Box} box
 */

/** Growing list of numbers. */
class NumberPool {
  constructor() {
    this.array = new Int32Array(4096);
    this.length = 0;
  }

  /** @param {number} value */
  push(value) {
    if (this.length === this.array.length) {
      const grown = new Int32Array(this.array.length * 2);
      grown.set(this.array);
      this.array = grown;
    }
    this.array[this.length++] = value;
  }
}

/** Points of all lines at each of the three levels of detail. */
class PlanLines {
  constructor() {
    this.x = [new NumberPool(), new NumberPool(), new NumberPool()];
    this.y = [new NumberPool(), new NumberPool(), new NumberPool()];
    this.starts = [new NumberPool(), new NumberPool(), new NumberPool()];
    /** Six numbers each: line, first point, points, type, color, width. */
    this.marks = new NumberPool();
    this.markStarts = new NumberPool();
    this.count = 0;
  }

  begin() {
    for (let level = 0; level < 3; level++) this.starts[level]?.push(this.x[level]?.length ?? 0);
    this.markStarts.push(this.marks.length);
    return this.count++;
  }

  /** @param {number} x @param {number} y @param {number} coarsest */
  add(x, y, coarsest) {
    for (let level = 0; level <= coarsest; level++) {
      this.x[level]?.push(x);
      this.y[level]?.push(y);
    }
  }

  /**
   * Returns plain arrays of one level; line `i` has the points from `start[i]` up to `start[i + 1]`, exclusive.
   *
   * @param {number} level
   */
  level(level) {
    const x = /** @type {NumberPool} */ (this.x[level]);
    const y = /** @type {NumberPool} */ (this.y[level]);
    const starts = /** @type {NumberPool} */ (this.starts[level]);
    return {
      x: x.array.subarray(0, x.length),
      y: y.array.subarray(0, y.length),
      start: starts.array.subarray(0, starts.length),
    };
  }
}

/** @typedef {{x: Int32Array, y: Int32Array, start: Int32Array}} LevelOfLines */

/** Reader of numbers. A missing or impossible value is an error, so it never reads past the end. */
class PlanReader {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
    /** @type {string[]} */
    this.strings = [];
  }

  /** @param {string} what @returns {never} */
  fail(what) {
    throw new BlockError(`The map in this report is damaged: ${what} at byte ${this.at}.`);
  }

  unsigned() {
    let value = 0;
    let scale = 1;
    for (let i = 0; i < 8; i++) {
      const byte = this.bytes[this.at++];
      if (byte === undefined) this.fail('it ends early');
      value += (byte & 127) * scale;
      if (byte < 128) {
        if (value > Number.MAX_SAFE_INTEGER) this.fail('a number is too large');
        return value;
      }
      scale *= 128;
    }
    return this.fail('a number is too long');
  }

  signed() {
    const value = this.unsigned();
    return value % 2 === 0 ? value / 2 : -(value + 1) / 2;
  }

  double() {
    if (this.at + 8 > this.bytes.length) this.fail('it ends early');
    const value = this.view.getFloat64(this.at, true);
    this.at += 8;
    if (!Number.isFinite(value)) this.fail('its origin is not finite');
    return value;
  }

  /** Reads the number of items, each with at least this number of bytes. @param {number} least */
  count(least) {
    const count = this.unsigned();
    if (count * least > this.bytes.length - this.at) this.fail('a list is longer than the remaining data');
    return count;
  }

  /** Checks that a coordinate fits into the array. @param {number} value */
  coordinate(value) {
    if (value < -0x7fffffff || value > 0x7fffffff) this.fail('a coordinate is too large');
    return value;
  }

  text() {
    const index = this.unsigned();
    return this.strings[index] ?? this.fail('a name is missing');
  }

  readStrings() {
    const decoder = new TextDecoder();
    for (let left = this.count(1); left > 0; left--) {
      const length = this.count(1);
      this.strings.push(decoder.decode(this.bytes.subarray(this.at, this.at + length)));
      this.at += length;
    }
  }

  /** @returns {Int32Array} x and y of each point */
  outline() {
    const count = this.count(2);
    const points = new Int32Array(count * 2);
    let x = 0;
    let y = 0;
    for (let i = 0; i < count; i++) {
      x = this.coordinate(x + this.signed());
      y = this.coordinate(y + this.signed());
      points[2 * i] = x;
      points[2 * i + 1] = y;
    }
    return points;
  }

  /**
   * Reads pairs of s, which is stored as a difference, and a value.
   *
   * @param {boolean} differences whether the value is stored as a difference too
   */
  profile(differences) {
    const count = this.count(2);
    const pairs = new Float64Array(count * 2);
    let s = 0;
    let value = 0;
    for (let i = 0; i < count; i++) {
      s += this.unsigned();
      value = differences ? value + this.signed() : this.unsigned();
      pairs[2 * i] = s;
      pairs[2 * i + 1] = value;
    }
    return pairs;
  }

  /** @template T @param {number} least bytes of an item @param {(index: number) => T} item @returns {T[]} */
  items(least, item) {
    const count = this.count(least);
    /** @type {T[]} */
    const list = [];
    for (let i = 0; i < count; i++) list.push(item(i));
    return list;
  }
}

/** @returns {Box} */
function emptyBox() {
  return [Infinity, Infinity, -Infinity, -Infinity];
}

/** @param {Box} box @param {Box} other */
function growBox(box, other) {
  box[0] = Math.min(box[0], other[0]);
  box[1] = Math.min(box[1], other[1]);
  box[2] = Math.max(box[2], other[2]);
  box[3] = Math.max(box[3], other[3]);
}

/** @param {Int32Array} points @returns {Box} */
function boxOfPoints(points) {
  const box = emptyBox();
  for (let i = 0; i + 1 < points.length; i += 2) {
    const x = points[i] ?? 0;
    const y = points[i + 1] ?? 0;
    growBox(box, [x, y, x, y]);
  }
  return box;
}

/** Reader of roads, the largest part of a plan. */
class RoadReader {
  /** @param {PlanReader} reader @param {PlanLines} lines */
  constructor(reader, lines) {
    this.reader = reader;
    this.lines = lines;
    /** Box of the last part that was read. */
    this.box = emptyBox();
  }

  /** @param {number} index @returns {PlanRoad} */
  road(index) {
    const { reader } = this;
    const id = reader.text();
    const name = reader.text();
    const junction = reader.unsigned() - 1;
    const flags = reader.unsigned();
    const length = reader.unsigned();
    const { line, stations } = this.referenceLine();
    const box = emptyBox();
    growBox(box, this.box);
    const elevation = reader.profile(true);
    const predecessor = { kind: reader.unsigned(), id: reader.text() };
    const successor = { kind: reader.unsigned(), id: reader.text() };
    const sections = reader.items(8, (section) => this.section(index, section));
    for (const section of sections) growBox(box, section.box);
    return {
      id,
      name,
      junction,
      leftHand: (flags & 1) !== 0,
      drawable: (flags & 2) === 0,
      length,
      line,
      stations,
      elevation,
      predecessor,
      successor,
      sections,
      box,
    };
  }

  referenceLine() {
    const { reader, lines } = this;
    this.box = emptyBox();
    const line = lines.begin();
    const count = reader.count(4);
    const stations = new Float64Array(count);
    let [x, y, s] = [0, 0, 0];
    for (let i = 0; i < count; i++) {
      x += reader.signed();
      y += reader.signed();
      s += reader.unsigned();
      stations[i] = s;
      this.point(x, y);
    }
    return { line, stations };
  }

  /** @param {number} x @param {number} y */
  point(x, y) {
    const { reader, box } = this;
    const level = reader.unsigned();
    if (level > 2) reader.fail('a level of detail is unknown');
    reader.coordinate(x);
    reader.coordinate(y);
    if (x < box[0]) box[0] = x;
    if (y < box[1]) box[1] = y;
    if (x > box[2]) box[2] = x;
    if (y > box[3]) box[3] = y;
    this.lines.add(x, y, level);
  }

  /** Reads a border and its marks. @returns {number} the line */
  border() {
    const { reader, lines } = this;
    const line = lines.begin();
    let x = 0;
    let y = 0;
    const points = reader.count(3);
    for (let i = 0; i < points; i++) {
      x += reader.signed();
      y += reader.signed();
      this.point(x, y);
    }
    for (let left = reader.count(5); left > 0; left--) {
      const first = reader.unsigned();
      const count = reader.unsigned();
      if (first + count > points) reader.fail('a road mark is longer than its border');
      lines.marks.push(line);
      lines.marks.push(first);
      lines.marks.push(count);
      lines.marks.push(this.stringIndex());
      lines.marks.push(this.stringIndex());
      lines.marks.push(Math.min(reader.unsigned(), 1000));
    }
    return line;
  }

  stringIndex() {
    const index = this.reader.unsigned();
    if (index >= this.reader.strings.length) this.reader.fail('a name is missing');
    return index;
  }

  /** @param {number} road @param {number} index @returns {PlanSection} */
  section(road, index) {
    const { reader } = this;
    const s0 = reader.unsigned();
    const s1 = reader.unsigned();
    this.box = emptyBox();
    const center = this.border();
    const lanes = [...this.side(center, true), ...this.side(center, false)];
    return { road, index, s0, s1, center, lanes, box: this.box };
  }

  /**
   * Reads the lanes of a side from the center outwards. Each begins at the border of the previous one.
   *
   * @param {number} center
   * @param {boolean} left
   */
  side(center, left) {
    let inner = center;
    return this.reader.items(5, () => {
      const id = this.reader.signed();
      const type = this.reader.text();
      const outer = this.border();
      const lane = { id, left, type, inner, outer, widths: this.reader.profile(false) };
      inner = outer;
      return lane;
    });
  }
}

/** @param {PlanReader} reader @returns {PlanJunction} */
function readJunction(reader) {
  const id = reader.text();
  const name = reader.text();
  const type = reader.text();
  const connections = reader.items(
    2,
    () => /** @type {[number, number]} */ ([reader.unsigned() - 1, reader.unsigned() - 1]),
  );
  const outline = reader.outline();
  return { id, name, type, connections, outline, box: boxOfPoints(outline) };
}

/** @param {PlanReader} reader @returns {PlanSignal} */
function readSignal(reader) {
  const [id, name, type, subtype] = [reader.text(), reader.text(), reader.text(), reader.text()];
  const [road, s, t] = [reader.unsigned(), reader.unsigned(), reader.signed()];
  const x = reader.coordinate(reader.signed());
  const y = reader.coordinate(reader.signed());
  const heading = reader.signed() / 1000;
  const flags = reader.unsigned();
  const box = (flags & 2) === 0 ? /** @type {Box} */ ([x, y, x, y]) : emptyBox();
  return { id, name, type, subtype, road, s, t, x, y, heading, dynamic: (flags & 1) !== 0, box };
}

/** @param {PlanReader} reader @returns {PlanObject} */
function readObject(reader) {
  const [id, name, type] = [reader.text(), reader.text(), reader.text()];
  const [road, s, t] = [reader.unsigned(), reader.unsigned(), reader.signed()];
  const outline = reader.outline();
  return { id, name, type, road, s, t, outline, box: boxOfPoints(outline) };
}

/** @typedef {ReturnType<typeof decodePlan>} Plan */

/** @param {Uint8Array} bytes */
function decodePlan(bytes) {
  const reader = new PlanReader(bytes);
  if (bytes.length < 5 || String.fromCharCode(...bytes.subarray(0, 4)) !== 'QCPL')
    reader.fail('the signature is wrong');
  reader.at = 4;
  if (reader.unsigned() !== 1) reader.fail('its version is unknown');
  const origin = { x: reader.double(), y: reader.double() };
  reader.readStrings();
  const lines = new PlanLines();
  const roadReader = new RoadReader(reader, lines);
  const roads = reader.items(12, (index) => roadReader.road(index));
  const junctions = reader.items(5, () => readJunction(reader));
  const signals = reader.items(11, () => readSignal(reader));
  const objects = reader.items(7, () => readObject(reader));
  const cuts = reader.items(1, () => reader.text());
  lines.begin(); // Ends the last line.
  const box = emptyBox();
  for (const road of roads) growBox(box, road.box);
  const roadBox = /** @type {Box} */ ([...box]);
  for (const junction of junctions) growBox(box, junction.box);
  for (const signal of signals) growBox(box, signal.box);
  for (const object of objects) growBox(box, object.box);
  const sections = roads.flatMap((road) => road.sections);
  return {
    origin,
    roads,
    sections,
    junctions,
    signals,
    objects,
    cuts,
    strings: reader.strings,
    box: box[0] <= box[2] ? box : null,
    /** Box of the roads only, or of everything if no road can be drawn. */
    roadBox: roadBox[0] <= roadBox[2] ? roadBox : box[0] <= box[2] ? box : null,
    levels: [lines.level(0), lines.level(1), lines.level(2)],
    marks: lines.marks.array.subarray(0, lines.marks.length),
    markStarts: lines.markStarts.array.subarray(0, lines.markStarts.length),
    laneCount: sections.reduce((sum, section) => sum + section.lanes.length, 0),
  };
}
