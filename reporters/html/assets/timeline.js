// The timeline of a scenario: a tree of rows with bars on a time axis. Only the visible rows have elements.

const TIMELINE_ROW = 24;

/** Number of rows above and below the visible ones that have elements too. */
const TIMELINE_SPARE = 6;

/** A storyboard with more elements than this is shown with its events closed. */
const MANY_ELEMENTS = 400;

/** With more entities, their rows are closed at first. */
const MANY_ENTITIES = 4;

/** @typedef {{kind: 'entity'|'element', index: number}|null} StorySelection */

/**
 * @typedef {object} TimelineEvents
 * @property {(selection: StorySelection) => void} select
 * @property {(finding: number) => void} finding
 */

class TimelineView {
  /** @param {StoryModel} story @param {readonly Finding[]} findings @param {() => MapTheme} colors @param {TimelineEvents} events */
  constructor(story, findings, colors, events) {
    this.story = story;
    this.findings = findings;
    this.colors = colors;
    this.events = events;
    /** @type {StorySelection} */
    this.selected = null;
    /** Position of the row with the keyboard, or -1. */
    this.active = -1;
    this.hovered = -1;
    this.whole = wholeRange(story);
    this.range = this.whole;
    /** @type {Set<string>} */
    this.closed = new Set();
    if (story.elements.length > MANY_ELEMENTS) this.closeKinds(['event', 'maneuver']);
    if (story.entities.length > MANY_ENTITIES) this.closed.add('init');
    this.rows = shownRows(story, this.closed);
    /** @type {Map<number, HTMLElement>} */
    this.drawn = new Map();
    this.scheduled = false;
    this.space = withAttributes(make('div', 'tl-space'), { role: 'presentation' });
    this.tree = withAttributes(make('div', 'tl-scroll', this.space), {
      role: 'tree',
      tabindex: 0,
      'aria-label': 'Timeline: entities and storyboard',
    });
    this.ticks = withAttributes(make('div', 'tl-ticks'), { 'aria-hidden': 'true' });
    this.grid = withAttributes(make('div', 'tl-grid'), { 'aria-hidden': 'true' });
    this.facts = withAttributes(make('div', 'tl-facts'), { role: 'status' });
    const axis = make('div', 'tl-axis', make('div', 'tl-axis-name muted', 'time in s'), this.ticks);
    const body = make('div', 'tl-body', this.grid, this.tree);
    this.element = withAttributes(make('section', 'timeline', this.head(), axis, body, this.facts), {
      'aria-label': 'Timeline',
    });
    this.listen();
    this.tell();
  }

  listen() {
    this.tree.addEventListener('scroll', () => this.schedule(), { passive: true });
    this.tree.addEventListener('keydown', (event) => this.key(event));
    this.tree.addEventListener('click', (event) => this.click(event));
    this.tree.addEventListener('pointermove', (event) => this.hover(this.positionOf(event.target)));
    this.tree.addEventListener('pointerleave', () => this.hover(-1));
    this.tree.addEventListener('focus', () => this.focused());
    this.tree.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
    new ResizeObserver(() => this.resize()).observe(this.tree);
  }

  head() {
    const { story } = this;
    const never = story.elements.filter(({ start }) => start.earliest === Infinity && story.timed).length;
    const title = make('h2', '', 'Timeline');
    const run = make('span', 'tl-run', ...withCode(story.run.text, 600));
    withAttributes(run, { title: plain(story.run.text, 600) });
    const tools = make(
      'span',
      'tl-tools',
      withAttributes(makeButton('tool', '−', () => this.zoom(1.5), 'Longer time (Ctrl + wheel)'), { 'aria-label': 'Longer time' }),
      withAttributes(makeButton('tool', '+', () => this.zoom(1 / 1.5), 'Shorter time (Ctrl + wheel)'), { 'aria-label': 'Shorter time' }),
      makeButton('tool', 'Whole run', () => this.setRange(this.whole), 'Show the whole run'),
      makeButton('tool', 'Collapse', () => this.fold(true), 'Close all rows below the maneuver groups'),
      makeButton('tool', 'Expand', () => this.fold(false), 'Open all rows'),
    );
    const notes = make(
      'div',
      'tl-notes',
      run,
      never > 0 ? make('span', 'tl-alarm', `${counted(never, 'element')} never ${never === 1 ? 'starts' : 'start'}`) : null,
      story.timed ? null : this.gapsNote(),
      cutsNote('Left out of the timeline', story.cuts),
      timelineLegend(),
    );
    return make('div', 'tl-head', make('div', 'tl-line', title, tools), notes);
  }

  gapsNote() {
    const items = this.story.gaps.map(({ text, where }) => make('li', '', ...withCode(text), ' ', whereElement(where)));
    const summary = make('summary', '', 'Times unknown: a part of the storyboard is unknown');
    return make('details', 'note cuts', summary, make('ul', '', ...items));
  }

  /** @param {string[]} kinds */
  closeKinds(kinds) {
    for (const { kind, index, children } of this.story.elements)
      if (children.length > 0 && kinds.includes(kind)) this.closed.add(`element ${index}`);
  }

  /** Closes or opens all rows. @param {boolean} closed */
  fold(closed) {
    this.closed.clear();
    if (closed) this.closeKinds(['maneuverGroup', 'maneuver', 'event']);
    this.renew();
  }

  /** Computes the rows anew; the active row stays if it is still shown. */
  renew() {
    const active = this.rows[this.active];
    this.rows = shownRows(this.story, this.closed);
    this.active = active ? this.rows.findIndex((row) => rowKey(row) === rowKey(active)) : -1;
    this.hovered = -1;
    this.redraw();
    this.tell();
  }

  redraw() {
    for (const row of this.drawn.values()) row.remove();
    this.drawn.clear();
    this.paint();
  }

  resize() {
    // The axis has the width of the rows, without the scroll bar.
    this.element.style.setProperty('--tl-gap', `${this.tree.offsetWidth - this.tree.clientWidth + 4}px`);
    this.drawAxis();
    this.redraw();
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
    const { tree, space } = this;
    space.style.height = `${this.rows.length * TIMELINE_ROW}px`;
    const first = Math.max(0, Math.floor(tree.scrollTop / TIMELINE_ROW) - TIMELINE_SPARE);
    const last = Math.min(
      this.rows.length - 1,
      Math.ceil((tree.scrollTop + tree.clientHeight) / TIMELINE_ROW) + TIMELINE_SPARE,
    );
    for (const [position, row] of this.drawn) {
      if (position >= first && position <= last) continue;
      row.remove();
      this.drawn.delete(position);
    }
    for (let position = first; position <= last; position++) {
      if (this.drawn.has(position)) continue;
      const element = this.rowElement(position);
      this.drawn.set(position, element);
      space.append(element);
    }
    this.mark();
  }

  /** @param {number} position @returns {HTMLElement} */
  rowElement(position) {
    const row = /** @type {TimelineRow} */ (this.rows[position]);
    const { story } = this;
    const element = row.kind === 'element' ? story.elements[row.index] : undefined;
    const label = rowLabel(story, row);
    const track = make('div', 'tl-track');
    fillTrack(track, story, row, this.range);
    const item = make('div', `tl-row ${row.kind}`, label, track);
    const color = row.kind === 'entity' ? row.index : element ? story.colorOf(element) : -1;
    if (color >= 0) item.style.setProperty('--c', this.colorOf(color));
    for (const swatch of label.querySelectorAll('[data-entity]'))
      if (swatch instanceof HTMLElement) swatch.style.setProperty('--c', this.colorOf(Number(swatch.dataset.entity)));
    if (element && story.timed && element.start.earliest === Infinity) item.classList.add('never');
    if (element) item.classList.add(element.kind);
    const badge = element ? this.badge(element) : null;
    if (badge) label.append(badge);
    item.style.top = `${position * TIMELINE_ROW}px`;
    item.dataset.position = String(position);
    item.id = `tl-row-${position}`;
    return withAttributes(item, {
      role: 'treeitem',
      'aria-level': row.depth + 1,
      'aria-posinset': row.position,
      'aria-setsize': row.siblings,
      'aria-expanded': row.parent ? String(row.open) : null,
      'aria-label': this.sentence(row),
    });
  }

  /** @param {number} entity */
  colorOf(entity) {
    const { entities } = this.colors();
    return entities[entity % entities.length] ?? '';
  }

  /** Returns the sign of the worst finding at an element. @param {StoryElement} element */
  badge({ findings }) {
    if (findings.length === 0) return null;
    const worst = LEVELS.find((level) => findings.some((finding) => this.findings[finding]?.level === level));
    const badge = make('span', `level ${worst} tl-badge`);
    badge.dataset.finding = String(findings.find((finding) => this.findings[finding]?.level === worst) ?? -1);
    return withAttributes(badge, { title: `${counted(findings.length, 'finding')} here: show` });
  }

  /** Returns a row in words. @param {TimelineRow} row */
  sentence(row) {
    if (row.kind === 'init') return 'Init';
    if (row.kind === 'entity') {
      const entity = this.story.entities[row.index];
      return plain(`${entity?.name}: ${entity?.text}`, 600);
    }
    const element = this.story.elements[row.index];
    const facts = element?.text || (this.story.timed ? '' : 'times unknown');
    return plain(`${element?.head}${facts ? ': ' : ''}${facts}`, 2000);
  }

  drawAxis() {
    const { ticks, grid } = this;
    const width = Math.max(60, ticks.clientWidth);
    const { times, step } = this.range.ticks(Math.min(1, 64 / width));
    const end = this.story.run.end;
    const lines = times.map((time) => lineAt('tl-grid-line', this.range.at(time)));
    const labels = times.map((time) => {
      const label = lineAt('tl-tick', this.range.at(time));
      label.append(make('span', '', timeLabel(time, step)));
      return label;
    });
    if (end.earliest < Infinity && this.range.at(end.earliest) <= 1 && end.latest < Infinity) {
      const [from, to] = [this.range.at(end.earliest), Math.min(1, this.range.at(end.latest))];
      const line = lineAt('tl-end', from);
      line.style.width = `${Math.max(0, to - from) * 100}%`;
      lines.push(line);
      const label = lineAt('tl-tick end', from);
      label.append(make('span', '', 'end'));
      labels.push(label);
    }
    ticks.replaceChildren(...labels);
    grid.replaceChildren(...lines);
  }

  /** @param {TimeRange} range */
  setRange(range) {
    this.range = range;
    this.drawAxis();
    for (const [position, item] of this.drawn) {
      const row = this.rows[position];
      const track = item.querySelector('.tl-track');
      if (row && track instanceof HTMLElement) fillTrack(track, this.story, row, range);
    }
  }

  /** @param {number} factor @param {number} [middle] */
  zoom(factor, middle = 0) {
    this.setRange(this.range.zoomed(factor, middle));
  }

  /** @param {WheelEvent} event */
  wheel(event) {
    const along = event.shiftKey ? event.deltaY : event.deltaX;
    if (!event.ctrlKey && Math.abs(along) <= Math.abs(event.shiftKey ? 0 : event.deltaY)) return;
    event.preventDefault();
    const { ticks } = this;
    const { left, width } = ticks.getBoundingClientRect();
    const middle = Math.min(1, Math.max(0, (event.clientX - left) / Math.max(1, width)));
    if (event.ctrlKey) this.zoom(Math.exp(Math.max(-1, Math.min(1, event.deltaY * 0.004))), middle);
    else this.setRange(this.range.moved(Math.max(-0.5, Math.min(0.5, along / Math.max(1, width)))));
  }

  /** @param {EventTarget|null} target @returns {number} */
  positionOf(target) {
    const row = target instanceof Element ? target.closest('.tl-row') : null;
    return row instanceof HTMLElement ? Number(row.dataset.position) : -1;
  }

  /** @param {MouseEvent} event */
  click(event) {
    const position = this.positionOf(event.target);
    const row = this.rows[position];
    if (!row || !(event.target instanceof Element)) return;
    this.active = position;
    const badge = event.target.closest('.tl-badge');
    if (badge instanceof HTMLElement) {
      this.events.finding(Number(badge.dataset.finding));
      return;
    }
    if (row.kind === 'init' || event.target.closest('.tl-twist.open, .tl-twist.closed')) this.toggle(row);
    else this.choose(row);
  }

  /** @param {TimelineRow} row */
  choose({ kind, index }) {
    if (kind === 'init') return;
    const same = this.selected?.kind === kind && this.selected.index === index;
    this.events.select(same ? null : { kind, index });
  }

  /** @param {TimelineRow} row @param {boolean} [open] */
  toggle(row, open = !row.open) {
    if (!row.parent || row.open === open) return;
    if (open) this.closed.delete(rowKey(row));
    else this.closed.add(rowKey(row));
    this.renew();
  }

  focused() {
    if (this.active < 0) this.active = Math.max(0, this.positionOfSelected());
    this.reveal(this.active);
    this.mark();
    this.tell();
  }

  positionOfSelected() {
    const { selected } = this;
    return selected ? this.rows.findIndex(({ kind, index }) => kind === selected.kind && index === selected.index) : -1;
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.shiftKey) return;
    if (!this.act(event.key)) return;
    event.preventDefault();
    // The keys of the list of findings are not meant.
    event.stopPropagation();
  }

  /** @param {string} key @returns {boolean} whether the key is handled */
  act(key) {
    const row = this.rows[this.active];
    const page = Math.max(1, Math.floor(this.tree.clientHeight / TIMELINE_ROW) - 1);
    const steps = /** @type {Record<string, number>} */ ({
      ArrowDown: this.active + 1,
      ArrowUp: this.active - 1,
      PageDown: this.active + page,
      PageUp: this.active - page,
      Home: 0,
      End: this.rows.length - 1,
    });
    const to = steps[key];
    if (to !== undefined) this.move(to);
    else if (!row) return false;
    else if (key === 'ArrowRight') row.parent && !row.open ? this.toggle(row, true) : this.move(this.active + 1);
    else if (key === 'ArrowLeft') row.open ? this.toggle(row, false) : this.move(this.positionAbove(row));
    else if (key === '*') this.fold(false);
    else if (key === 'Enter' || key === ' ') row.kind === 'init' ? this.toggle(row) : this.choose(row);
    else return false;
    return true;
  }

  /** @param {TimelineRow} row */
  positionAbove({ depth }) {
    for (let at = this.active - 1; at >= 0; at--) if ((this.rows[at]?.depth ?? 0) < depth) return at;
    return this.active;
  }

  /** @param {number} position */
  move(position) {
    this.active = Math.min(this.rows.length - 1, Math.max(0, position));
    this.reveal(this.active);
    this.mark();
    this.tell();
  }

  /** @param {number} position */
  reveal(position) {
    const { tree } = this;
    if (position < 0) return;
    const top = position * TIMELINE_ROW;
    if (top < tree.scrollTop) tree.scrollTop = top;
    else if (top + TIMELINE_ROW > tree.scrollTop + tree.clientHeight)
      tree.scrollTop = top + TIMELINE_ROW - tree.clientHeight;
    this.paint();
  }

  /** @param {number} position */
  hover(position) {
    if (position === this.hovered) return;
    this.hovered = position;
    this.tell();
  }

  /** Shows a selection of the map or of a finding. @param {StorySelection} selection */
  show(selection) {
    this.selected = selection;
    if (selection) {
      this.openTo(selection);
      const first = this.firstOf(selection);
      this.active = this.positionOfSelected();
      this.reveal(Math.max(first, this.active));
      this.reveal(this.active);
    }
    this.mark();
    this.tell();
  }

  /** Opens the rows around a selection. @param {{kind: 'entity'|'element', index: number}} selection */
  openTo({ kind, index }) {
    const keys = kind === 'entity' ? ['init'] : this.story.around(this.story.elements[index]?.parent ?? -1);
    const closed = keys.map((key) => (typeof key === 'string' ? key : `element ${key}`)).filter((key) => this.closed.has(key));
    if (closed.length === 0) return;
    for (const key of closed) this.closed.delete(key);
    this.renew();
  }

  /** Returns the position of the first maneuver group of an entity. @param {{kind: 'entity'|'element', index: number}} selection */
  firstOf({ kind, index }) {
    if (kind !== 'entity') return -1;
    return this.rows.findIndex((row) => {
      const element = row.kind === 'element' ? this.story.elements[row.index] : undefined;
      return element?.kind === 'maneuverGroup' && element.actors.includes(index);
    });
  }

  /** Checks whether a row belongs to the selection. @param {TimelineRow} row */
  isRelated(row) {
    const { selected, story } = this;
    if (!selected || row.kind === 'init') return true;
    const element = row.kind === 'element' ? story.elements[row.index] : undefined;
    if (selected.kind === 'entity') return element ? element.actors.includes(selected.index) : row.index === selected.index;
    const chosen = story.elements[selected.index];
    if (!chosen) return true;
    if (!element) return chosen.actors.includes(row.index);
    const [one, other] = [story.around(element.index), story.around(chosen.index)];
    return one.includes(chosen.index) || other.includes(element.index);
  }

  /** Marks the selected, the active and the related rows. */
  mark() {
    const { selected } = this;
    for (const [position, item] of this.drawn) {
      const row = /** @type {TimelineRow} */ (this.rows[position]);
      const chosen = selected !== null && selected.kind === row.kind && selected.index === row.index;
      item.classList.toggle('chosen', chosen);
      item.classList.toggle('active', position === this.active);
      item.classList.toggle('dim', !this.isRelated(row));
      withAttributes(item, { 'aria-selected': String(chosen) });
    }
    const active = this.drawn.has(this.active) ? `tl-row-${this.active}` : null;
    withAttributes(this.tree, { 'aria-activedescendant': active });
  }

  /** Shows the hovered row in words, otherwise the selected or the active one. */
  tell() {
    const { facts } = this;
    const at = [this.hovered, this.positionOfSelected(), document.activeElement === this.tree ? this.active : -1];
    const row = this.rows[at.find((position) => position >= 0) ?? -1];
    if (!row || row.kind === 'init') {
      facts.replaceChildren(make('span', 'muted', 'Point at a row or a box, or choose it, to see what it does.'));
      return;
    }
    const element = row.kind === 'element' ? this.story.elements[row.index] : undefined;
    if (!element) {
      const entity = this.story.entities[row.index];
      facts.replaceChildren(make('b', '', plain(entity?.name, 120)), ' ', ...withCode(entity?.text, 1500));
      return;
    }
    const where = whereElement(whereOf(element));
    const own = element.text || (this.story.timed ? '' : 'times unknown');
    facts.replaceChildren(
      make('b', '', ...withCode(element.head, 600)),
      own ? ' ' : '',
      ...withCode(own, 1500),
      make('div', 'tl-place', where, ...this.findingLinks(element)),
    );
  }

  /** @param {StoryElement} element */
  findingLinks({ findings }) {
    return findings.slice(0, 4).flatMap((index) => {
      const finding = this.findings[index];
      if (!finding) return [];
      const link = makeButton('link tl-finding', '', () => this.events.finding(index));
      link.append(levelBadge(finding.level), make('span', '', ...withCode(finding.text, 90)));
      return [link];
    });
  }
}

/** @param {string} className @param {number} at fraction */
function lineAt(className, at) {
  const line = make('span', className);
  line.style.left = `${at * 100}%`;
  return line;
}

/** Explains the bars. */
function timelineLegend() {
  const entry = (/** @type {string} */ kind, /** @type {string} */ text) =>
    make('li', '', make('span', 'tl-key', make('span', `tl-bar ${kind}`)), text);
  return make(
    'details',
    'note tl-legend',
    make('summary', '', 'Legend'),
    make(
      'ul',
      '',
      entry('solid', 'runs'),
      entry('maybe', 'may run: the start or the end is known within bounds'),
      entry('unknown', 'start unknown: at any time, or never'),
      entry('maybe endless', 'no known end'),
      make('li', '', make('span', 'tl-key', make('span', 'tl-never')), 'never starts'),
      make('li', '', make('span', 'tl-key', make('span', 'tl-end')), 'end of the run'),
    ),
  );
}
