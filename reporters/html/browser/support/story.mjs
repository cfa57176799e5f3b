// Stories of scenarios for test pages.

const FOREVER = [null, null];

/** Returns an element; `more` replaces its values. */
export function element(kind, name, parent, start, end, more = {}) {
  return {
    kind,
    name,
    parent,
    action: kind === 'action' ? 'SpeedAction' : null,
    actors: [],
    file: null,
    rows: [1, 1],
    column: 5,
    start,
    end,
    head: `${kind} \`${name}\``,
    text: `starts at ${start[0]} s`,
    ...more,
  };
}

/** Returns an entity at a place, or at none. */
export function entity(name, at, more = {}) {
  return { name, kind: 'Vehicle', category: 'car', size: [4.5, 1.8], center: [0, 0], at, speed: 10, text: '10 m/s', ...more };
}

/** Returns a story on the small town of roads.mjs: two cars, a route, a trajectory, and events of every kind. */
export function townStory([x, y]) {
  return {
    timed: true,
    gaps: [],
    entities: [
      entity('ego', [x + 20, y - 1.75, 0]),
      entity('lorry', [x + 60, y - 1.75, Math.PI / 2], { category: 'truck', size: [12, 2.5] }),
      entity('ghost', null),
    ],
    globals: ['EnvironmentAction'],
    elements: [
      element('story', 'main', null, [0, 0], [9, 9.6], { rows: [100, 200] }),
      element('act', 'drive', 0, [0, 0.1], [9, 9.5], { rows: [101, 199] }),
      element('maneuverGroup', 'of ego', 1, [0, 0.1], [7, 7.4], { actors: [0], rows: [102, 140] }),
      element('event', 'brake', 2, [3, 3.1], [7, 7.3], { rows: [103, 110] }),
      element('action', 'slow', 3, [3, 3.1], [7, 7.2], { rows: [104, 106] }),
      element('event', 'blocked', 2, FOREVER, FOREVER, {
        rows: [111, 120],
        text: 'never starts, because the `rising` edge is over',
      }),
      element('maneuverGroup', 'of lorry', 1, [0, 0.1], [9, 9.4], { actors: [1], rows: [141, 190] }),
      element('event', 'later', 6, [2, 5], [6, 20], { rows: [142, 150] }),
      element('event', 'perhaps', 6, [4, null], [4, null], { rows: [151, 160] }),
      element('event', 'unknown', 6, [0, null], [0, null], { rows: [161, 170] }),
      element('event', 'endless', 6, [1, 1.1], FOREVER, { rows: [171, 180] }),
    ],
    run: { end: [30, 30.1], text: 'The run ends at 30 s' },
    courses: [
      {
        kind: 'trajectory',
        name: 'swerve',
        element: 4,
        entities: [0],
        points: [x + 20, y - 1.75, x + 40, y - 1.75, x + 50, y + 2],
        stops: [],
        exact: true,
        unplaced: 0,
      },
      {
        kind: 'route',
        name: 'home',
        element: null,
        entities: [1],
        points: [x + 60, y - 20, x + 60, y + 40],
        stops: [x + 60, y - 20, x + 60, y + 40],
        exact: false,
        unplaced: 1,
      },
    ],
    cuts: [],
  };
}

/** Returns a story with this many events in groups of 50. */
export function hugeStory([x, y], events) {
  const story = townStory([x, y]);
  story.elements = [
    element('story', 'main', null, [0, 0], FOREVER),
    element('act', 'drive', 0, [0, 0], FOREVER),
  ];
  for (let i = 0; i < events; i++) {
    if (i % 50 === 0) story.elements.push(element('maneuverGroup', `group ${i / 50}`, 1, [0, 0], FOREVER, { actors: [(i / 50) % 2] }));
    const parent = story.elements.length - 1 - (i % 50);
    const start = (i * 7) % 1000;
    story.elements.push(element('event', `event ${i}`, parent, [start, start + 0.1], [start + 3, start + 3.2]));
  }
  story.courses = [];
  return story;
}
