// Panel of the clicked road: its facts, links, lanes and profiles.

/**
 * @typedef {object} RoadActions
 * @property {(road: number) => void} road
 * @property {(junction: number) => void} junction
 * @property {() => void} close
 * @property {(s: number|null) => void} station
 */

/** Maximum number of lines in a plot. More cannot be distinguished in a small plot. */
const MOST_PROFILE_LINES = 400;

class RoadPanel {
  /**
   * @param {IndexedPlan} indexed
   * @param {readonly Finding[]} findings
   * @param {() => MapTheme} colors
   * @param {RoadActions} actions
   */
  constructor(indexed, findings, colors, actions) {
    this.indexed = indexed;
    this.findings = findings;
    this.colors = colors;
    this.actions = actions;
    /** @type {ProfilePlot[]} */
    this.plots = [];
    this.element = withAttributes(make('aside', 'road-panel'), { hidden: true, 'aria-label': 'Road' });
  }

  hide() {
    this.element.hidden = true;
    this.plots = [];
  }

  /** @param {number} index */
  show(index) {
    const road = this.indexed.plan.roads[index];
    if (!road) return;
    const close = withAttributes(
      makeButton('tool close', '×', () => this.actions.close()),
      { 'aria-label': 'Close the road' },
    );
    const title = make('h2', '', `Road ${plain(road.id, 60)}`);
    if (road.name) title.append(make('span', 'muted', ` ${plain(road.name, 120)}`));
    const marks = this.marksOf(index, road);
    const station = (/** @type {number|null} */ s) => {
      this.draw(s);
      this.actions.station(s);
    };
    this.plots = [
      new ProfilePlot('Elevation', road.length, [this.elevationLine(road)], marks, station),
      new ProfilePlot('Width of lanes', road.length, this.widthLines(road), marks, station),
    ];
    this.element.replaceChildren(
      close,
      title,
      this.facts(road, marks.length),
      ...this.plots.map(({ element }) => element),
      this.lanes(road),
    );
    this.element.hidden = false;
    this.draw(null);
  }

  /** @param {number|null} station */
  draw(station) {
    for (const plot of this.plots) plot.draw(this.colors(), station);
  }

  /** Returns the stations of the findings on a road. @param {number} index @param {PlanRoad} road */
  marksOf(index, road) {
    /** @type {{s: number, level: Level}[]} */
    const marks = [];
    for (const finding of this.findings) {
      for (const place of finding.places) {
        const isOn =
          place.on.some((target) => target.road === index) || (place.road !== null && place.road[0] === road.id);
        if (!isOn) continue;
        const projected =
          place.road || !place.anchor ? null : projectOn(this.indexed.plan, road, place.anchor.x, place.anchor.y);
        const s = place.road ? place.road[1] * 100 : projected?.s;
        if (isFiniteNumber(s)) marks.push({ s, level: finding.level });
        break;
      }
    }
    return marks;
  }

  /** @param {PlanRoad} road @param {number} findings */
  facts(road, findings) {
    const junction = this.indexed.plan.junctions[road.junction];
    const list = make('dl', 'road-facts');
    const add = (/** @type {string} */ name, /** @type {Node|string} */ value) =>
      list.append(make('dt', '', name), make('dd', '', value));
    add('length', `${fixed(road.length / 100)} m`);
    add('traffic', road.leftHand ? 'left-hand' : 'right-hand');
    if (junction)
      add(
        'in junction',
        makeButton('link', plain(junction.id, 60), () => this.actions.junction(road.junction)),
      );
    add('predecessor', this.link(road.predecessor));
    add('successor', this.link(road.successor));
    if (findings > 0) add('findings', COUNT_FORMAT.format(findings));
    if (!road.drawable) add('note', 'cannot be drawn');
    return list;
  }

  /** @param {PlanLink} link @returns {Node|string} */
  link(link) {
    if (link.kind === 0) return 'none';
    const isRoad = link.kind === 1;
    const index = (isRoad ? this.indexed.roadsById : this.indexed.junctionsById).get(link.id);
    const label = `${isRoad ? 'road' : 'junction'} ${plain(link.id, 60)}`;
    if (index === undefined) return `${label} (not in this map)`;
    return makeButton(
      'link',
      label,
      () => (isRoad ? this.actions.road(index) : this.actions.junction(index)),
      'Fly there',
    );
  }

  /** @param {PlanRoad} road @returns {ProfileLine} */
  elevationLine(road) {
    return {
      name: '',
      color: PROFILE_COLORS[0] ?? '',
      pairs: road.elevation,
      from: 0,
      to: road.length,
      labelled: false,
    };
  }

  /** @param {PlanRoad} road @returns {ProfileLine[]} */
  widthLines(road) {
    /** @type {ProfileLine[]} */
    const lines = [];
    const lastSection = road.sections.length - 1;
    for (const section of road.sections) {
      for (const lane of section.lanes) {
        if (lines.length >= MOST_PROFILE_LINES) return lines;
        const color = PROFILE_COLORS[(Math.abs(lane.id) * 2 + (lane.id > 0 ? 1 : 0)) % PROFILE_COLORS.length] ?? '';
        lines.push({
          name: String(lane.id),
          color,
          pairs: lane.widths,
          from: section.s0,
          to: section.s1,
          labelled: section.index === lastSection && section.lanes.length < 9,
        });
      }
    }
    return lines;
  }

  /** @param {PlanRoad} road */
  lanes(road) {
    const rows = road.sections.slice(0, 60).map((section) => {
      const ordered = [...section.lanes].sort((a, b) => b.id - a.id).slice(0, 60);
      const chips = ordered.map((lane) =>
        make('span', 'lane-chip', `${lane.id} `, make('span', 'muted', plain(lane.type, 30))),
      );
      return make(
        'li',
        '',
        make('span', 'muted', `s ${fixed(section.s0 / 100, 1)}–${fixed(section.s1 / 100, 1)} `),
        ...chips,
      );
    });
    const title =
      road.sections.length > rows.length
        ? `Lanes (the first ${rows.length} of ${road.sections.length} sections)`
        : `Lanes (${counted(rows.length, 'section')})`;
    return withAttributes(make('details', 'lanes', make('summary', '', title), make('ul', '', ...rows)), {
      open: rows.length < 3,
    });
  }
}
