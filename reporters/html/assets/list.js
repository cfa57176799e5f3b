// List of any length with elements only for the visible rows. All rows have the same height. One row can be open and
// has a detail below it, which is measured.

/** Number of rows above and below the visible ones that have elements too. */
const SPARE_ROWS = 8;

/**
 * @typedef {object} ListSource
 * @property {number} rowHeight CSS pixels
 * @property {string} label name of the list for screen readers
 * @property {(position: number) => HTMLElement} row returns the element of a row
 * @property {(position: number) => HTMLElement|null} [detail] returns the element below an open row
 */

class VirtualList {
  /** @param {ListSource} source */
  constructor(source) {
    this.source = source;
    this.count = 0;
    this.opened = -1;
    this.detailHeight = 0;
    /** @type {Map<number, HTMLElement>} */
    this.rows = new Map();
    this.scheduled = false;
    this.space = withAttributes(make('ul', 'virtual-space'), { role: 'list', 'aria-label': source.label });
    this.element = withAttributes(make('div', 'virtual-list', this.space), { tabindex: -1 });
    this.element.addEventListener('scroll', () => this.schedule(), { passive: true });
    this.measure = new ResizeObserver((entries) => this.measured(entries));
    new ResizeObserver(() => this.schedule()).observe(this.element);
  }

  /** Replaces all rows. @param {number} count @param {number} opened */
  reset(count, opened) {
    const focused = this.drawnFocus()?.querySelector('button')?.dataset.finding;
    this.count = count;
    this.drop();
    this.open(opened);
    if (focused === undefined) return;
    // The focus follows its row or moves to the list. Otherwise the keyboard would restart at the top of the page.
    const rows = [...this.rows.values()].map((row) => row.querySelector('button'));
    (rows.find((button) => button?.dataset.finding === focused) ?? this.element).focus({ preventScroll: true });
  }

  /** Position of the row that has the focus. */
  drawnFocus() {
    const active = document.activeElement;
    return active === null ? undefined : [...this.rows.values()].find((row) => row.contains(active));
  }

  /** @param {number} position -1: none */
  open(position) {
    const focused = [this.opened, position].find((at) => this.rows.get(at)?.contains(document.activeElement));
    for (const at of [this.opened, position]) {
      this.rows.get(at)?.remove();
      this.rows.delete(at);
    }
    this.measure.disconnect();
    this.opened = position >= 0 && position < this.count ? position : -1;
    this.detailHeight = 0;
    this.paint();
    if (focused !== undefined) this.focus(focused);
  }

  /** Scrolls to a row, with as much of its detail as fits. @param {number} position */
  reveal(position) {
    if (position < 0) return;
    const top = this.top(position);
    const height = this.source.rowHeight + (position === this.opened ? this.detailHeight : 0);
    const { scrollTop, clientHeight } = this.element;
    if (top < scrollTop || height > clientHeight) this.element.scrollTop = top;
    else if (top + height > scrollTop + clientHeight) this.element.scrollTop = top + height - clientHeight;
    this.paint();
  }

  /** @param {number} position */
  focus(position) {
    const target = this.rows.get(position)?.querySelector('button');
    if (target instanceof HTMLElement) target.focus({ preventScroll: true });
  }

  /** @param {number} position */
  top(position) {
    const above = this.opened >= 0 && position > this.opened ? this.detailHeight : 0;
    return position * this.source.rowHeight + above;
  }

  drop() {
    for (const row of this.rows.values()) row.remove();
    this.rows.clear();
  }

  schedule() {
    if (this.scheduled) return;
    this.scheduled = true;
    requestAnimationFrame(() => {
      this.scheduled = false;
      this.paint();
    });
  }

  paint() {
    const { rowHeight } = this.source;
    this.space.style.height = `${this.top(this.count)}px`;
    const { scrollTop, clientHeight } = this.element;
    const first = Math.max(0, Math.floor((scrollTop - this.detailHeight) / rowHeight) - SPARE_ROWS);
    const last = Math.min(this.count - 1, Math.ceil((scrollTop + clientHeight) / rowHeight) + SPARE_ROWS);
    for (const [position, row] of this.rows) {
      // The row with the focus stays, because otherwise scrolling would remove the focus.
      if ((position >= first && position <= last) || row.contains(document.activeElement)) continue;
      row.remove();
      this.rows.delete(position);
    }
    for (let position = first; position <= last; position++) {
      if (!this.rows.has(position)) this.add(position);
    }
    for (const [position, row] of this.rows) row.style.top = `${this.top(position)}px`;
  }

  /** @param {number} position */
  add(position) {
    const item = make('li', 'virtual-row', this.source.row(position));
    withAttributes(item, { 'aria-setsize': this.count, 'aria-posinset': position + 1 });
    if (position === this.opened) {
      const detail = this.source.detail?.(position) ?? null;
      if (detail) {
        item.append(detail);
        this.measure.observe(detail);
        this.detailHeight ||= 1;
      }
    }
    this.rows.set(position, item);
    const next = [...this.rows.keys()].filter((other) => other > position).sort((a, b) => a - b)[0];
    this.space.insertBefore(item, next === undefined ? null : (this.rows.get(next) ?? null));
    if (position === this.opened) this.detailHeight = item.offsetHeight - this.source.rowHeight;
  }

  /** @param {ResizeObserverEntry[]} entries */
  measured(entries) {
    const row = this.rows.get(this.opened);
    if (!row || entries.length === 0) return;
    const height = row.offsetHeight - this.source.rowHeight;
    if (height === this.detailHeight || row.offsetHeight === 0) return;
    this.detailHeight = height;
    this.schedule();
  }
}
