// The scenario on the page of a result: keeps the map, the timeline and the findings on the same selection.

/**
 * @typedef {object} SceneEvents
 * @property {(finding: number) => void} finding
 */

/** Share of the timeline in percent, and its bounds. */
const SHARES = { first: 50, least: 15, most: 85 };

class Scene {
  /**
   * @param {StoryModel} story @param {readonly Finding[]} findings @param {PlanView|null} view @param {Theme} theme
   * @param {SceneEvents} events
   */
  constructor(story, findings, view, theme, events) {
    this.story = story;
    this.view = view;
    /** @type {StorySelection} */
    this.selected = null;
    const colors = () => (theme.dark ? MAP_THEMES.dark : MAP_THEMES.light);
    this.timeline = new TimelineView(story, findings, colors, {
      select: (selection) => this.select(selection, 'timeline'),
      finding: events.finding,
    });
    theme.listeners.push(() => this.timeline.redraw());
    this.splitter = this.makeSplitter();
    this.element = make('div', 'scene');
    this.share = SHARES.first;
    if (view) {
      view.actors = new ActorLayer(story, view.plan);
      view.home = view.actors.box;
    }
  }

  /** Puts the map and the timeline beside each other. @param {HTMLElement} stage */
  around(stage) {
    this.element.append(stage, this.splitter, this.timeline.element);
    new ResizeObserver(() => this.arrange()).observe(this.element);
    this.setShare(this.share);
    return this.element;
  }

  /** Puts the timeline beside the map if there is room for both, otherwise below. */
  arrange() {
    const beside = this.element.clientWidth >= 1180;
    this.element.classList.toggle('beside', beside);
    withAttributes(this.splitter, { 'aria-orientation': beside ? 'vertical' : 'horizontal' });
  }

  makeSplitter() {
    const splitter = withAttributes(make('div', 'splitter'), {
      role: 'separator',
      tabindex: 0,
      'aria-label': 'Size of the timeline',
      'aria-valuemin': SHARES.least,
      'aria-valuemax': SHARES.most,
    });
    splitter.addEventListener('pointerdown', (event) => {
      splitter.setPointerCapture(event.pointerId);
      event.preventDefault();
    });
    splitter.addEventListener('pointermove', (event) => {
      if (splitter.hasPointerCapture(event.pointerId)) this.drag(event);
    });
    splitter.addEventListener('keydown', (event) => {
      const by = /** @type {Record<string, number>} */ ({ ArrowUp: 4, ArrowLeft: 4, ArrowDown: -4, ArrowRight: -4 });
      const step = by[event.key];
      if (step === undefined || event.shiftKey) return;
      event.preventDefault();
      event.stopPropagation();
      this.setShare(this.share + step);
    });
    return splitter;
  }

  /** @param {PointerEvent} event */
  drag(event) {
    const { left, top, width, height } = this.element.getBoundingClientRect();
    const beside = this.element.classList.contains('beside');
    const part = beside ? (event.clientX - left) / width : (event.clientY - top) / height;
    this.setShare(100 - part * 100);
  }

  /** @param {number} share percent */
  setShare(share) {
    this.share = Math.min(SHARES.most, Math.max(SHARES.least, share));
    this.element.style.setProperty('--share', `${this.share}%`);
    withAttributes(this.splitter, { 'aria-valuenow': Math.round(this.share) });
  }

  /** Selects an entity or an element everywhere. @param {StorySelection} selection @param {'timeline'|'map'|'finding'} from */
  select(selection, from) {
    this.selected = selection;
    this.timeline.show(selection);
    const { view } = this;
    if (!view?.actors) return;
    const focus = this.focusOf(selection);
    view.actors.focus = focus;
    view.refresh();
    if (from === 'timeline' && focus) this.bringIntoView(view, focus);
  }

  /** Returns the entities and lines of a selection. @param {StorySelection} selection @returns {ActorFocus} */
  focusOf(selection) {
    const { story } = this;
    if (!selection) return null;
    if (selection.kind === 'entity') {
      const own = story.courses.filter(({ entities }) => entities.includes(selection.index));
      return { entities: new Set([selection.index]), courses: new Set(own.map(({ index }) => index)) };
    }
    const courses = story.coursesOf(selection.index);
    const actors = story.elements[selection.index]?.actors ?? [];
    if (actors.length === 0 && courses.length === 0) return null;
    return { entities: new Set(actors), courses: new Set(courses.map(({ index }) => index)) };
  }

  /** Moves the map only if the selection is not in sight. @param {PlanView} view @param {{entities: Set<number>, courses: Set<number>}} focus */
  bringIntoView(view, focus) {
    const box = view.actors?.boxOf(focus);
    if (!box) return;
    const shown = boxOfFrame(view.camera.frame());
    const seen = box[0] < shown[2] && box[2] > shown[0] && box[1] < shown[3] && box[3] > shown[1];
    const middle = [(box[0] + box[2]) / 2, (box[1] + box[3]) / 2];
    const inside =
      (middle[0] ?? 0) > shown[0] && (middle[0] ?? 0) < shown[2] && (middle[1] ?? 0) > shown[1] && (middle[1] ?? 0) < shown[3];
    if (!seen || !inside) void view.camera.fit(box);
  }

  /** Selects the line at a point of the map: its action, or its entity. @param {number} index */
  selectCourse(index) {
    const course = this.story.courses[index];
    if (!course) return;
    if (course.element >= 0) this.select({ kind: 'element', index: course.element }, 'map');
    else if (course.entities[0] !== undefined) this.select({ kind: 'entity', index: course.entities[0] }, 'map');
  }

  /** Shows the element that a finding points at. @param {number} finding -1: none */
  point(finding) {
    const element = finding < 0 ? -1 : this.story.elementOf(finding);
    if (element >= 0) this.select({ kind: 'element', index: element }, 'finding');
  }
}

/** Explains the signs of the scenario on the map. @param {StoryModel} story */
function sceneLegend(story) {
  const placed = story.courses.filter(({ points, stops }) => points.length >= 4 || stops.length > 0);
  const kinds = new Set(placed.map(({ kind, exact }) => (exact ? kind : `${kind} about`)));
  const lost = story.courses.length - placed.length;
  const entry = (/** @type {string} */ sign, /** @type {string} */ text) =>
    make('li', '', make('span', `sign ${sign}`), text);
  const unplaced = story.entities.filter(({ at }) => at === null).length;
  const missing = [
    unplaced > 0 ? counted(unplaced, 'entity', 'entities') : '',
    lost > 0 ? counted(lost, 'line') : '',
  ].filter((text) => text !== '');
  const list = make(
    'ul',
    '',
    entry('body', 'entity at its place in Init'),
    story.entities.some(({ sized, at }) => at !== null && !sized) ? entry('body guessed', 'entity of unknown size') : null,
    kinds.has('trajectory') ? entry('line', 'trajectory') : null,
    kinds.has('route') ? entry('line thick', 'route along the lanes') : null,
    kinds.has('route about') ? entry('line dashed', 'route, straight between its waypoints') : null,
    kinds.has('trajectory about') ? entry('line dashed', 'trajectory, partly known') : null,
    kinds.has('target') ? entry('target', 'target position') : null,
    unplaced + lost > 0 ? make('li', 'muted', `place unknown: ${missing.join(', ')}`) : null,
  );
  return withAttributes(make('details', 'legend scene-legend', make('summary', '', 'Scenario'), list), {
    // On a small screen it would cover the map.
    open: window.innerWidth > 900,
  });
}
