// Grid over boxes. Finds the boxes in a part of the map without a scan of all boxes.

/** Boxes that cover more cells are kept in a separate list and always scanned. */
const MOST_CELLS_OF_ONE = 4096;
const MOST_CELLS = 262144;

class Grid {
  /** @param {readonly Box[]} boxes empty ones are never found */
  constructor(boxes) {
    this.boxes = boxes;
    this.extent = emptyBox();
    let valid = 0;
    for (const box of boxes) {
      if (!(box[0] <= box[2])) continue;
      growBox(this.extent, box);
      valid++;
    }
    const width = Math.max(1, this.extent[2] - this.extent[0]);
    const height = Math.max(1, this.extent[3] - this.extent[1]);
    const wanted = Math.min(MOST_CELLS, Math.max(1, valid * 2));
    /** Side length of a cell. */
    this.side = Math.max(1000, Math.sqrt((width * height) / wanted), Math.max(width, height) / 4096);
    this.columns = Math.max(1, Math.ceil(width / this.side));
    this.rows = Math.max(1, Math.ceil(height / this.side));
    /** @type {number[]} */
    this.everywhere = [];
    this.cellStart = new Int32Array(this.columns * this.rows + 1);
    this.items = new Int32Array(0);
    this.seen = new Int32Array(boxes.length);
    this.query = 0;
    if (valid > 0) this.fill();
  }

  fill() {
    const next = this.cellStart;
    this.eachCell((cell) => next[cell + 1]++);
    for (let cell = 0; cell + 1 < next.length; cell++) next[cell + 1] += next[cell] ?? 0;
    this.items = new Int32Array(next[next.length - 1] ?? 0);
    const position = next.slice();
    this.eachCell((cell, item) => {
      this.items[position[cell]++] = item;
    }, false);
  }

  /**
   * @param {(cell: number, item: number) => void} visit
   * @param {boolean} [first] whether large boxes are moved to their list now
   */
  eachCell(visit, first = true) {
    this.boxes.forEach((box, item) => {
      if (!(box[0] <= box[2])) return;
      const [c0, r0, c1, r1] = this.cellsOf(box);
      if ((c1 - c0 + 1) * (r1 - r0 + 1) > MOST_CELLS_OF_ONE) {
        if (first) this.everywhere.push(item);
        return;
      }
      for (let row = r0; row <= r1; row++) {
        for (let column = c0; column <= c1; column++) visit(row * this.columns + column, item);
      }
    });
  }

  /** @param {Box} box @returns {Box} first column, first row, last column, last row */
  cellsOf(box) {
    const column = (/** @type {number} */ x) =>
      Math.min(this.columns - 1, Math.max(0, Math.floor((x - this.extent[0]) / this.side)));
    const row = (/** @type {number} */ y) =>
      Math.min(this.rows - 1, Math.max(0, Math.floor((y - this.extent[1]) / this.side)));
    return [column(box[0]), row(box[1]), column(box[2]), row(box[3])];
  }

  /** Returns the boxes that touch a box, in the order of the list. @param {Box} box @returns {number[]} */
  within(box) {
    const mark = ++this.query;
    /** @type {number[]} */
    const found = [];
    const look = (/** @type {number} */ item) => {
      if (this.seen[item] === mark) return;
      this.seen[item] = mark;
      const other = this.boxes[item];
      if (other && other[0] <= box[2] && other[2] >= box[0] && other[1] <= box[3] && other[3] >= box[1])
        found.push(item);
    };
    this.everywhere.forEach(look);
    if (this.items.length === 0 || box[0] > this.extent[2] || box[2] < this.extent[0]) return found;
    const [c0, r0, c1, r1] = this.cellsOf(box);
    for (let row = r0; row <= r1; row++) {
      const from = this.cellStart[row * this.columns + c0] ?? 0;
      const to = this.cellStart[row * this.columns + c1 + 1] ?? 0;
      for (let i = from; i < to; i++) look(this.items[i] ?? 0);
    }
    return found.sort((a, b) => a - b);
  }
}
