// Page of a result: combines the parts and keeps them consistent.

(() => {
  /** @type {HTMLElement} */
  const app = document.getElementById('app') ?? document.body.appendChild(make('main'));

  class ReportPage {
    /** @param {Record<string, any>} data @param {Plan|null} plan @param {string} planFault @param {Theme} theme */
    constructor(data, plan, planFault, theme) {
      this.data = data;
      this.plan = plan;
      this.theme = theme;
      this.rules = rulesOf(data);
      this.checkers = listOf(data.checkers);
      this.findings = findingsOf(data, this.rules, plan);
      this.selected = -1;
      /** Flight of the last selection. Callers can wait for it. */
      this.flight = Promise.resolve();
      this.filters = new Filters(
        this.findings,
        [this.ruleFacet()],
        () => this.filtered(),
        plan ? { label: 'only without a place on the map', passes: (finding) => finding.anchor === null } : null,
      );
      this.list = new VirtualList({
        rowHeight: 66,
        label: 'Findings',
        row: (position) => this.row(position),
        detail: (position) => this.detail(position),
      });
      this.table = new FindingsTable(this.findings, this.rules, (index) => this.choose(index));
      this.chooser = withAttributes(make('div', 'chooser'), {
        hidden: true,
        role: 'dialog',
        'aria-label': 'Findings at this place',
      });
      this.help = helpDialog(KEYS);
      this.empty = make(
        'p',
        'empty muted',
        this.findings.length === 0 ? 'There are no findings.' : 'No finding passes the filters.',
      );
      this.view = plan ? this.mapView(plan) : null;
      this.panel = this.view ? this.roadPanel(this.view) : null;
      this.scene = data.story
        ? new Scene(new StoryModel(data, this.findings), this.findings, this.view, theme, {
            finding: (index) => this.choose(index, true),
          })
        : null;
      this.stage = make('section', 'stage', this.view?.element, this.panel?.element, this.chooser, this.table.element);
      if (!this.view || this.view.plan.roads.length === 0)
        this.stage.append(make('div', 'no-map muted', planFault || noPlanSentence(data)));
      if (this.view) this.stage.append(this.legends(this.view));
      if (this.view && data.map?.own === false)
        this.stage.append(make('div', 'map-name muted', 'map: ', whereElement(textOf(data.map.path))));
      this.side = make('aside', 'side', this.filters.element, this.empty, this.list.element);
      this.modeButton = makeButton('tool mode', 'Table', () => this.setTable(!this.tableShown), 'Table or map (t)');
      this.tableShown = false;
    }

    /** @returns {Facet<Finding>} */
    ruleFacet() {
      const used = new Set(this.findings.map(({ rule }) => rule).filter((rule) => rule >= 0));
      const rules = [...used].sort((a, b) => (this.rules[a]?.uid ?? '').localeCompare(this.rules[b]?.uid ?? ''));
      const position = new Map(rules.map((rule, index) => [rule, index]));
      return {
        name: 'rule',
        all: `All rules (${rules.length})`,
        values: rules.map((rule) => shortRule(this.rules[rule]?.uid ?? '')),
        of: ({ rule }) => position.get(rule) ?? -1,
      };
    }

    /** @param {PlanView} view */
    legends(view) {
      const lanes = view.plan.roads.length > 0 ? legend(view, this.theme) : null;
      return make('div', 'legends', this.scene ? sceneLegend(this.scene.story) : null, lanes);
    }

    /** @param {Plan} plan */
    mapView(plan) {
      return new PlanView(plan, this.theme, {
        finding: (index) => this.choose(index, true),
        several: (members, x, y) => this.openChooser(members, x, y),
        road: (road, x) => {
          this.showRoad(road, false);
          // The clicked point stays visible.
          const { camera } = /** @type {PlanView} */ (this.view);
          const over = x - (camera.width - camera.hidden - 60);
          if (camera.hidden > 0 && over > 0) camera.pan(-over, 0);
        },
        nothing: () => {
          this.chooser.hidden = true;
          this.scene?.select(null, 'map');
        },
        actor: (index) => this.scene?.select({ kind: 'entity', index }, 'map'),
        course: (index) => this.scene?.selectCourse(index),
      });
    }

    /** @param {PlanView} view */
    roadPanel(view) {
      this.theme.listeners.push(() => this.panel?.draw(null));
      return new RoadPanel(view.indexed, this.findings, () => view.colors, {
        road: (road) => this.showRoad(road, true),
        junction: (junction) => {
          const box = view.plan.junctions[junction]?.box;
          if (box && box[0] <= box[2]) void view.camera.fit(box);
        },
        close: () => this.hideRoad(),
        station: (s) => {
          view.station = s;
          view.refresh();
        },
      });
    }

    mount() {
      app.className = 'report';
      const notes = make(
        'div',
        'notes',
        checkersNote(this.checkers),
        cutsNote('Left out of this report', this.data.cuts),
        cutsNote('Left out of the map', this.data.map?.cuts, this.plan?.cuts),
      );
      const stage = this.scene ? this.scene.around(this.stage) : this.stage;
      app.replaceChildren(this.head(notes), make('div', 'body', this.side, stage), this.help);
      this.scene?.arrange();
      this.setTable(false);
      this.view?.resize();
      this.filtered();
      document.addEventListener('keydown', (event) => this.key(event));
      printing(
        () => this.beforePrint(),
        () => this.afterPrint(),
      );
      addEventListener('hashchange', () => this.followHash());
      this.followHash();
    }

    /** @param {HTMLElement} notes */
    head(notes) {
      const { file } = this.data;
      const name = textOf(file?.path) || textOf(file?.name) || 'a result';
      document.title = plain(`${name} – ${textOf(file?.verdict)}`, 200);
      const counts = make('span', 'head-counts');
      for (const level of LEVELS) {
        const count = this.findings.filter((finding) => finding.level === level).length;
        counts.append(
          make(
            'span',
            'head-count',
            levelBadge(level),
            make('b', '', COUNT_FORMAT.format(count)),
            ` ${LEVEL_NAMES[level][count === 1 ? 0 : 1].replace(/informations?/, 'info')}`,
          ),
        );
      }
      const tools = make(
        'div',
        'tools',
        ...this.fitButtons(),
        this.modeButton,
        this.theme.button(),
        withAttributes(
          makeButton('tool', '?', () => this.help.showModal(), 'Keys (?)'),
          { 'aria-label': 'Keys' },
        ),
      );
      const digest = textOf(file?.sha256);
      const title = withAttributes(make('h1', '', whereElement(name, 'title')), {
        title: digest ? `sha256 ${plain(digest, 80)}` : null,
      });
      const top = make('div', 'head-line', verdictBadge(file?.verdict), title, counts, tools);
      const second = make(
        'div',
        'head-line second',
        make('span', 'reason', plain(verdictReason(this.data, this.findings))),
        notes,
        make('span', 'muted generator', plain(this.data.generator, 80)),
      );
      return make('header', 'head', top, second);
    }

    fitButtons() {
      const { view } = this;
      if (!view) return [];
      const roads = (/** @type {string} */ label, /** @type {string} */ hint) =>
        makeButton('tool', label, () => void view.fitRoads(), hint);
      if (!view.home) return [roads('Fit', 'All roads (f)')];
      const scenario = makeButton('tool', 'Scenario', () => void view.fit(), 'Entities, routes and trajectories (f)');
      return view.plan.roadBox ? [scenario, roads('All roads', 'The whole map (a)')] : [scenario];
    }

    /** @param {number} position */
    row(position) {
      const index = this.filters.shown[position] ?? -1;
      const finding = /** @type {Finding} */ (this.findings[index]);
      return findingRow(finding, this.rules[finding.rule], index === this.selected, this.view !== null, () =>
        this.choose(index === this.selected ? -1 : index),
      );
    }

    /** @param {number} position */
    detail(position) {
      const finding = this.findings[this.filters.shown[position] ?? -1];
      return finding
        ? findingDetail(finding, this.rules, this.checkers, this.plan, {
            go: (place) => this.goTo(finding, place),
            road: (road) => this.showRoad(road, false),
          })
        : null;
    }

    filtered() {
      const position = this.filters.shown.indexOf(this.selected);
      this.list.reset(this.filters.shown.length, position);
      this.list.reveal(position);
      this.empty.hidden = this.filters.shown.length > 0;
      if (this.tableShown || !this.view) this.table.show(this.filters.shown, this.selected);
      this.view?.markers.set(this.findings, this.filters.shown);
      this.view?.refresh();
    }

    /**
     * Selects a finding, shows it in the list and flies there.
     *
     * @param {number} index -1: none
     * @param {boolean} [focus]
     */
    choose(index, focus = false) {
      this.chooser.hidden = true;
      this.selected = index;
      const finding = this.findings[index];
      this.scene?.point(finding ? index : -1);
      if (finding && !this.filters.shown.includes(index)) {
        this.filters.clear();
      } else {
        const position = this.filters.shown.indexOf(index);
        this.list.open(position);
        this.list.reveal(position);
        if (focus) this.list.focus(position);
      }
      for (const row of this.table.body.querySelectorAll('tr'))
        row.classList.toggle('selected', finding !== undefined && row.dataset.finding === String(finding.id));
      if (this.view) {
        const main = finding?.places.find(({ anchor }) => anchor !== null);
        this.view.selected = index;
        this.view.targets = finding?.places.flatMap(({ on }) => on) ?? [];
        this.view.further =
          finding?.places.flatMap((place) => (place.anchor && place !== main ? [place.anchor] : [])) ?? [];
        this.sayAbout(main ?? finding?.places[0]);
        this.view.refresh();
        this.flight = finding ? this.view.show(finding) : Promise.resolve();
      }
      return this.flight;
    }

    /** Says why the map may show nothing at a place. @param {FindingPlace|undefined} place */
    sayAbout(place) {
      this.view?.say(place && isOnUndrawableRoad(place, this.plan) ? UNDRAWABLE : '');
    }

    /** @param {Finding} finding @param {FindingPlace} place */
    goTo(finding, place) {
      if (this.tableShown) this.setTable(false);
      this.sayAbout(place);
      if (place.anchor)
        this.flight = this.view?.show({ ...finding, anchor: place.anchor, wholeElement: false }) ?? Promise.resolve();
    }

    /** @param {number} by */
    move(by) {
      const { shown } = this.filters;
      if (shown.length === 0) return;
      const now = shown.indexOf(this.selected);
      const next = now < 0 ? (by > 0 ? 0 : shown.length - 1) : Math.min(shown.length - 1, Math.max(0, now + by));
      void this.choose(shown[next] ?? -1);
      this.list.focus(next);
    }

    /** @param {number} road @param {boolean} fly */
    showRoad(road, fly) {
      const { view, panel } = this;
      if (!view || !panel) return;
      if (this.tableShown) this.setTable(false);
      view.road = road;
      view.station = null;
      panel.show(road);
      // The panel moves the middle of the visible part, but the map does not move.
      const hidden = this.stage.clientWidth > 640 ? panel.element.offsetWidth + 12 : 0;
      view.camera.x -= (hidden - view.camera.hidden) / 2 / view.camera.k;
      view.camera.hidden = hidden;
      const box = view.plan.roads[road]?.box;
      if (fly && box && box[0] <= box[2]) void view.camera.fit(box);
      view.refresh();
    }

    hideRoad() {
      const { view, panel } = this;
      if (!view || !panel) return;
      panel.hide();
      view.road = -1;
      view.station = null;
      view.camera.x += view.camera.hidden / 2 / view.camera.k;
      view.camera.hidden = 0;
      view.refresh();
    }

    /** @param {number[]} members @param {number} x @param {number} y */
    openChooser(members, x, y) {
      this.chooser.replaceChildren(...chooserContent(members, this.findings, (index) => void this.choose(index, true)));
      this.chooser.hidden = false;
      const left = Math.max(8, Math.min(x + 14, this.stage.clientWidth - this.chooser.offsetWidth - 8));
      const top = Math.max(8, Math.min(y - 10, this.stage.clientHeight - this.chooser.offsetHeight - 8));
      this.chooser.style.left = `${left}px`;
      this.chooser.style.top = `${top}px`;
      this.chooser.querySelector('button')?.focus({ preventScroll: true });
    }

    /** @param {boolean} shown */
    setTable(shown) {
      this.tableShown = shown || !this.view;
      this.stage.classList.toggle('as-table', this.tableShown);
      this.modeButton.textContent = this.tableShown ? 'Map' : 'Table';
      this.modeButton.hidden = !this.view;
      this.chooser.hidden = true;
      if (this.tableShown) this.table.show(this.filters.shown, this.selected);
    }

    /** @param {KeyboardEvent} event */
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey || this.help.open) return;
      if (isTyping(event)) {
        if (event.key === 'Escape' && event.target instanceof HTMLElement) event.target.blur();
        return;
      }
      if (this.act(event)) event.preventDefault();
    }

    /** @param {KeyboardEvent} event @returns {boolean} whether the key is handled */
    act(event) {
      const camera = this.view?.camera;
      const arrows = /** @type {Record<string, [number, number]>} */ ({
        ArrowLeft: [90, 0],
        ArrowRight: [-90, 0],
        ArrowUp: [0, 90],
        ArrowDown: [0, -90],
      });
      const arrow = arrows[event.key];
      if (event.shiftKey && arrow) camera?.pan(...arrow);
      else if (event.key === 'j' || event.key === 'ArrowDown') this.move(1);
      else if (event.key === 'k' || event.key === 'ArrowUp') this.move(-1);
      else if (event.key === '/') this.filters.search.focus();
      else if (event.key === 'Escape') this.escape();
      else if (event.key === 'f') void this.view?.fit();
      else if (event.key === 'a' && this.scene) void this.view?.fitRoads();
      else if (event.key === '+' || event.key === '=') camera?.zoom(1.5);
      else if (event.key === '-') camera?.zoom(1 / 1.5);
      else if (event.key === 't') this.setTable(!this.tableShown);
      else if (event.key === 'd') this.theme.toggle();
      else if (event.key === '?') this.help.showModal();
      else if (event.key === 'Enter') return this.enter(event);
      else return false;
      return true;
    }

    /** Handles Enter. On a button it is a click, except on the selected row. @param {KeyboardEvent} event */
    enter(event) {
      const finding = this.findings[this.selected];
      const target = event.target instanceof Element ? event.target.closest('button, a, summary, input') : null;
      if (!finding || (target && !(target instanceof HTMLElement && target.dataset.finding === String(finding.id))))
        return false;
      if (this.tableShown) this.setTable(false);
      this.flight = this.view?.show(finding) ?? Promise.resolve();
      return true;
    }

    escape() {
      if (!this.chooser.hidden) this.chooser.hidden = true;
      else if (this.panel && !this.panel.element.hidden) this.hideRoad();
      else if (this.scene?.selected) this.scene.select(null, 'map');
      else if (this.selected >= 0) void this.choose(-1);
      else if (this.filters.active) this.filters.clear();
    }

    followHash() {
      const id = /^#finding=(\d{1,15})$/.exec(location.hash)?.[1];
      if (id !== undefined) void this.select(Number(id));
    }

    /** @param {number} id */
    select(id) {
      const index = this.findings.findIndex((finding) => finding.id === id);
      return index < 0 ? Promise.resolve() : this.choose(index);
    }

    beforePrint() {
      this.afterPrint();
      app.append(printedTable(this.findings, this.filters.shown, this.rules));
      if (!this.view) return;
      this.view.printing = true;
      this.view.paintWhole();
    }

    afterPrint() {
      for (const printed of app.querySelectorAll('.printed')) printed.remove();
      if (!this.view) return;
      this.view.printing = false;
      this.view.refresh();
    }
  }

  /** @param {Record<string, any>} data */
  function noPlanSentence(data) {
    if (data.story && !data.map) return 'There is no readable map; places are in world coordinates.';
    return data.map
      ? 'The map of this report is missing from the file.'
      : 'There is no road network to show; see the findings in the list and in the table.';
  }

  /** @returns {Promise<{plan: Plan|null, fault: string}>} */
  async function readPlan() {
    try {
      const bytes = await readBlock('plan');
      return { plan: bytes ? decodePlan(bytes) : null, fault: '' };
    } catch (error) {
      return {
        plan: null,
        fault: error instanceof BlockError ? error.message : 'The map in this report cannot be read.',
      };
    }
  }

  /** Returns a plan without roads for a scenario whose map cannot be read. @param {Record<string, any>} data @returns {Plan|null} */
  function planOfPlaces(data) {
    const [first] = data.story ? new StoryModel(data, []).places() : [];
    return first ? decodePlan(emptyPlan(...first)) : null;
  }

  const times = { decodeMs: 0, firstPaintMs: 0 };
  /** @type {ReportPage|null} */
  let page = null;
  const theme = new Theme();

  const ready = whenParsed(() =>
    startPage(app, async () => {
      const began = performance.now();
      const data = await readData();
      const { plan, fault } = await readPlan();
      times.decodeMs = performance.now() - began;
      page = new ReportPage(data, plan ?? planOfPlaces(data), fault, theme);
      page.mount();
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    }),
  );

  Object.assign(window, {
    qcbus: {
      ready,
      /** @param {number} id */
      select: (id) => page?.select(id),
      /** Resolves at the end of the last flight. */
      settled: () => page?.flight,
      /** Middle of the visible part in metres of the map; scale in CSS pixels per metre. */
      view: () => {
        const view = page?.view;
        return view
          ? {
              x: view.plan.origin.x + view.camera.x / 100,
              y: view.plan.origin.y + view.camera.y / 100,
              scale: view.camera.k * 100,
            }
          : null;
      },
      /** Position of a point of the map on the page in CSS pixels. @param {number} x metres @param {number} y */
      screen: (x, y) => {
        const view = page?.view;
        if (!view) return null;
        const [px, py] = onFrame(view.camera.frame(), (x - view.plan.origin.x) * 100, (y - view.plan.origin.y) * 100);
        const { left, top } = view.canvas.getBoundingClientRect();
        return { x: left + px, y: top + py };
      },
      /** Entities and selection of a scenario, for tests. */
      story: () => {
        const scene = page?.scene;
        const actors = page?.view?.actors;
        return scene
          ? {
              rows: scene.timeline.rows.length,
              selected: scene.selected,
              range: [scene.timeline.range.from, scene.timeline.range.to],
              emphasized: actors?.focus ? [...actors.focus.entities] : [],
              courses: actors?.focus ? [...actors.focus.courses] : [],
              labels: actors?.labels.map(({ entity }) => entity) ?? [],
            }
          : null;
      },
      stats: () => {
        const frames = page?.view?.frames;
        return {
          ...times,
          firstPaintMs: frames?.firstPaint ?? 0,
          fps: frames && frames.gap > 0 ? 1000 / frames.gap : 0,
          frames: frames?.painted ?? 0,
          longestFrameMs: frames?.longest ?? 0,
          meanFrameMs: frames && frames.painted > 0 ? frames.total / frames.painted : 0,
          tilePaintMs: page?.view?.tiles.lastPaint ?? 0,
          busy: page?.view?.pending ?? false,
          lanes: page?.plan?.laneCount ?? 0,
          points: page?.plan?.levels[0]?.x.length ?? 0,
          findings: page?.findings.length ?? 0,
        };
      },
    },
  });
})();
