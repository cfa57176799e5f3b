// Rows of the timeline: the tree that is shown, and the elements of a row.

/**
 * A row: a heading of the entities, an entity, or a storyboard element.
 *
 * @typedef {object} TimelineRow
 * @property {'init'|'entity'|'element'} kind
 * @property {number} index of the entity or the element
 * @property {number} depth
 * @property {boolean} parent whether it has rows below it
 * @property {boolean} open
 * @property {number} position among its siblings, from 1
 * @property {number} siblings
 */

const KIND_WORDS = /** @type {Record<string, string>} */ ({ maneuverGroup: 'group' });

/** Key of a row in the set of closed rows. @param {TimelineRow} row */
function rowKey({ kind, index }) {
  return kind === 'init' ? 'init' : `${kind} ${index}`;
}

/** Returns the rows that are shown. @param {StoryModel} story @param {Set<string>} closed @returns {TimelineRow[]} */
function shownRows(story, closed) {
  /** @type {TimelineRow[]} */
  const rows = [];
  const top = story.roots.length + (story.entities.length > 0 ? 1 : 0);
  if (story.entities.length > 0) {
    const open = !closed.has('init');
    rows.push({ kind: 'init', index: 0, depth: 0, parent: true, open, position: 1, siblings: top });
    const siblings = story.entities.length;
    for (const { index } of open ? story.entities : [])
      rows.push({ kind: 'entity', index, depth: 1, parent: false, open: false, position: index + 1, siblings });
  }
  const before = top - story.roots.length;
  /** @type {{list: number[], next: number}[]} */
  const stack = [{ list: story.roots, next: 0 }];
  // A loop instead of recursion, because the data are not trusted.
  while (stack.length > 0) {
    const level = /** @type {{list: number[], next: number}} */ (stack.at(-1));
    const element = story.elements[level.list[level.next] ?? -1];
    if (!element) {
      stack.pop();
      continue;
    }
    level.next++;
    const parent = element.children.length > 0;
    const open = parent && !closed.has(`element ${element.index}`);
    const shift = stack.length === 1 ? before : 0;
    const place = { position: level.next + shift, siblings: level.list.length + shift };
    rows.push({ kind: 'element', index: element.index, depth: element.depth, parent, open, ...place });
    if (open) stack.push({ list: element.children, next: 0 });
  }
  return rows;
}

/** Returns the name of a row. @param {StoryModel} story @param {TimelineRow} row @returns {HTMLElement} */
function rowLabel(story, row) {
  const label = make('div', 'tl-label');
  const twist = make('span', `tl-twist${row.parent ? (row.open ? ' open' : ' closed') : ''}`);
  withAttributes(twist, { 'aria-hidden': 'true' });
  label.append(twist);
  label.style.paddingLeft = `${6 + Math.min(row.depth, 12) * 11}px`;
  if (row.kind === 'init') {
    label.append(make('span', 'tl-name', 'Init'), make('span', 'tl-kind', counted(story.entities.length, 'entity', 'entities')));
    return label;
  }
  if (row.kind === 'entity') {
    const entity = story.entities[row.index];
    const kind = entity?.category || (entity?.kind ?? '').toLowerCase();
    label.append(
      make('span', 'tl-swatch'),
      make('span', 'tl-name', plain(entity?.name, 80) || 'without a name'),
      make('span', 'tl-kind', plain(kind, 40)),
    );
    return label;
  }
  const element = story.elements[row.index];
  if (!element) return label;
  label.append(
    make('span', 'tl-kind first', KIND_WORDS[element.kind] ?? element.kind),
    make('span', 'tl-name', plain(element.name, 120) || 'without a name'),
  );
  if (element.action) label.append(make('span', 'tl-kind', plain(element.action, 60)));
  if (element.kind === 'maneuverGroup')
    for (const actor of element.actors.slice(0, 6)) {
      const swatch = withAttributes(make('span', 'tl-swatch small'), { title: plain(story.entities[actor]?.name, 80) });
      swatch.dataset.entity = String(actor);
      label.append(swatch);
    }
  return label;
}

/** Returns the reason why an element never starts, without the words before it. @param {StoryElement} element */
function neverReason({ text }) {
  return /^never starts, because (.*?)(; waits until .*)?$/s.exec(text)?.[1] ?? '';
}

/**
 * Fills the part of a row with the bar.
 *
 * @param {HTMLElement} track
 * @param {StoryModel} story
 * @param {TimelineRow} row
 * @param {TimeRange} range
 */
function fillTrack(track, story, row, range) {
  track.replaceChildren();
  if (row.kind === 'entity') {
    track.append(make('span', 'tl-note', ...withCode(story.entities[row.index]?.text, 400)));
    return;
  }
  if (row.kind === 'init') {
    if (story.globals.length > 0)
      track.append(make('span', 'tl-note', ...withCode(`global: \`${story.globals.slice(0, 20).join('`, `')}\``, 400)));
    return;
  }
  const element = story.elements[row.index];
  if (!element || !story.timed) return;
  if (element.start.earliest === Infinity) {
    const why = neverReason(element);
    track.append(
      make('span', 'tl-never'),
      make('span', 'tl-note tl-why', 'never starts', ...(why ? [': ', ...withCode(why, 400)] : [])),
    );
    return;
  }
  for (const part of barParts(element, story)) {
    const bar = barElement(part, range);
    if (bar) track.append(bar);
  }
}

/** Returns the element of a part of a bar, or null if it is out of sight. @param {BarPart} part @param {TimeRange} range */
function barElement({ kind, from, to }, range) {
  const [left, right] = [range.at(from), range.at(to)];
  if (right < 0 || left > 1) return null;
  const bar = make('span', `tl-bar ${kind}`);
  const begin = Math.max(0, left);
  bar.style.left = `${begin * 100}%`;
  if (kind === 'start') return left < 0 ? null : bar;
  bar.style.width = `${(Math.min(1, right) - begin) * 100}%`;
  if (to === Infinity) bar.classList.add('endless');
  else if (right > 1) bar.classList.add('beyond');
  return bar;
}
