// Road networks for test pages: arcs and straight roads with lanes, a junction, and a town of any size.

/** Returns a road along `shape(s) = [x, y, heading]` with lanes `[id, type, width]` in `sections` equal sections. */
export function makeRoad({
  id,
  name = '',
  length,
  shape,
  lanes,
  step = 2,
  sections = 1,
  junction = -1,
  elevation = [],
  predecessor,
  successor,
  flags = 0,
  narrow = 0,
}) {
  const count = Math.max(2, Math.ceil(length / step) + 1);
  const stations = Array.from({ length: count }, (_, i) => (i * length) / (count - 1));
  const line = stations.map((s) => shape(s).slice(0, 2));
  const list = [];
  for (let index = 0; index < sections; index++) {
    const [s0, s1] = [(index * length) / sections, ((index + 1) * length) / sections];
    list.push(makeSection({ s0, s1, shape, lanes, step, narrow }));
  }
  return { id, name, length, line, stations, junction, elevation, predecessor, successor, flags, sections: list };
}

function makeSection({ s0, s1, shape, lanes, step, narrow }) {
  const count = Math.max(2, Math.ceil((s1 - s0) / step) + 1);
  const stations = Array.from({ length: count }, (_, i) => s0 + (i * (s1 - s0)) / (count - 1));
  const offsetLine = (t) =>
    stations.map((s) => {
      const [x, y, heading] = shape(s);
      const offset = typeof t === 'function' ? t((s - s0) / (s1 - s0)) : t;
      return [x - Math.sin(heading) * offset, y + Math.cos(heading) * offset];
    });
  const widths = (width) => [
    [0, width],
    [(s1 - s0) / 2, width * (1 - narrow)],
    [s1 - s0, width],
  ];
  const side = (sign) => {
    let t = 0;
    const own = lanes.filter(([id]) => Math.sign(id) === sign);
    return own.map(([id, type, width], index) => {
      t += sign * width;
      const driving = type === 'driving' && own[index + 1]?.[1] === 'driving';
      return {
        id,
        type,
        points: offsetLine(t),
        marks: [mark(count, driving ? 'broken' : 'solid', 'white')],
        widths: widths(width),
      };
    });
  };
  return {
    s0,
    s1,
    center: { points: offsetLine(0), marks: [mark(count, 'solid solid', 'yellow')] },
    left: side(1),
    right: side(-1),
  };
}

function mark(points, type, color) {
  return { first: 0, points, type, color, width: 12 };
}

export const straight = (x, y, heading) => (s) => [x + s * Math.cos(heading), y + s * Math.sin(heading), heading];
export const arc = (x, y, heading, curvature) => (s) => {
  const end = heading + s * curvature;
  return [
    x + (Math.sin(end) - Math.sin(heading)) / curvature,
    y - (Math.cos(end) - Math.cos(heading)) / curvature,
    end,
  ];
};

const STREET = [
  [1, 'driving', 3.5],
  [2, 'biking', 1.5],
  [3, 'sidewalk', 2],
  [-1, 'driving', 3.5],
  [-2, 'parking', 2.2],
  [-3, 'border', 0.4],
  [-4, 'sidewalk', 2],
];
const HIGHWAY = [
  [1, 'driving', 3.75],
  [2, 'driving', 3.75],
  [3, 'shoulder', 2.5],
  [-1, 'driving', 3.75],
  [-2, 'driving', 3.75],
  [-3, 'shoulder', 2.5],
];
const TRAM = [
  [1, 'driving', 3.25],
  [-1, 'median', 1.5],
  [-2, 'tram', 3],
  [-3, 'driving', 3.25],
  [-4, 'sidewalk', 2.5],
];

/** Returns a crossing with four arms and its turns, a curved road from it, and a highway beside it. */
export function smallTown() {
  const roads = [];
  const arms = [0, 1, 2, 3].map((quarter) => (quarter * Math.PI) / 2);
  arms.forEach((heading, index) => {
    const [x, y] = [Math.cos(heading) * 16, Math.sin(heading) * 16];
    roads.push(
      makeRoad({
        id: String(index + 1),
        name: ['East Street', 'North Street', 'West Street', 'South Street'][index],
        length: 120 + index * 25,
        shape: straight(x, y, heading),
        lanes: index === 2 ? TRAM : STREET,
        sections: index === 0 ? 3 : 1,
        narrow: 0.2,
        elevation: [
          [0, 0],
          [40, 1.5],
          [80, 0.8],
          [120 + index * 25, 3],
        ],
        predecessor: { kind: 2, id: '100' },
        successor: index === 0 ? { kind: 1, id: '20' } : undefined,
      }),
    );
  });
  arms.forEach((heading, from) => {
    arms.forEach((leaving, to) => {
      if (from === to) return;
      const [x, y] = [Math.cos(heading) * 16, Math.sin(heading) * 16];
      const entering = heading + Math.PI;
      const change = Math.atan2(Math.sin(leaving - entering), Math.cos(leaving - entering));
      const shape =
        Math.abs(change) < 0.01 ? straight(x, y, entering) : arc(x, y, entering, change / ((16 * Math.PI) / 2));
      roads.push(
        makeRoad({
          id: `10${from}${to}`,
          length: Math.abs(change) < 0.01 ? 32 : (16 * Math.PI) / 2,
          shape,
          lanes: [[-1, 'driving', 3.5]],
          step: 1,
          junction: 0,
          predecessor: { kind: 1, id: String(from + 1) },
          successor: { kind: 1, id: String(to + 1) },
        }),
      );
    });
  });
  roads.push(
    makeRoad({
      id: '20',
      name: 'River Road',
      length: 260,
      shape: arc(136, 0, 0, 1 / 140),
      lanes: STREET,
      sections: 2,
      predecessor: { kind: 1, id: '1' },
      elevation: [
        [0, 3],
        [130, 9],
        [260, 4],
      ],
    }),
  );
  roads.push(
    makeRoad({
      id: '30',
      name: 'A 99',
      length: 520,
      shape: straight(-220, -190, 0.18),
      lanes: HIGHWAY,
      sections: 2,
    }),
  );
  const signals = [0, 1, 2, 3].map((index) => ({
    id: `s${index}`,
    name: 'signal',
    type: index % 2 ? '206' : '1000001',
    road: index,
    s: 2,
    t: -8,
    dynamic: index % 2 === 0,
    x: Math.cos(arms[index]) * 18 + Math.sin(arms[index]) * 8.5,
    y: Math.sin(arms[index]) * 18 - Math.cos(arms[index]) * 8.5,
    heading: arms[index],
  }));
  const objects = [
    {
      id: 'o1',
      name: 'house',
      type: 'building',
      road: 0,
      s: 60,
      t: 14,
      outline: [
        [60, 16],
        [78, 16],
        [78, 30],
        [70, 34],
        [60, 30],
      ],
    },
    {
      id: 'o2',
      name: 'crossing',
      type: 'crosswalk',
      road: 0,
      s: 8,
      t: 0,
      outline: [
        [20, -4],
        [23, -4],
        [23, 4],
        [20, 4],
      ],
    },
    { id: 'o3', name: 'tree', type: 'tree', road: 1, s: 50, t: 12, outline: [[14, 60]] },
  ];
  const junctions = [
    {
      id: '100',
      name: 'Market',
      connections: roads.slice(4, 16).map((_, index) => [Math.floor(index / 3), index + 4]),
      outline: [
        [16, -9],
        [16, 9],
        [9, 16],
        [-9, 16],
        [-16, 9],
        [-16, -9],
        [-9, -16],
        [9, -16],
      ],
    },
  ];
  return { origin: [690000, 5330000], roads, junctions, signals, objects, cuts: [] };
}

/** Returns a grid of curved streets with at least `lanes` lanes. */
export function bigTown(lanes, pointsPerLane) {
  const perRoad = STREET.length;
  const side = Math.ceil(Math.sqrt(lanes / perRoad));
  const roads = [];
  const step = 100 / (pointsPerLane - 1);
  for (let i = 0; roads.length * perRoad < lanes; i++) {
    const [column, row] = [i % side, Math.floor(i / side)];
    const flat = (column + row) % 2 === 0;
    const shape = arc(column * 110, row * 110, flat ? 0.1 : Math.PI / 2 - 0.1, flat ? 0.004 : -0.004);
    roads.push(makeRoad({ id: String(i), length: 100, shape, lanes: STREET, step }));
  }
  return { origin: [0, 0], roads, junctions: [], signals: [], objects: [], cuts: [] };
}

/** Returns `count` lanes at one place. */
export function stacked(count) {
  const roads = Array.from({ length: count / 2 }, (_, i) =>
    makeRoad({
      id: `r${i}`,
      length: 60,
      shape: straight(0, 0, 0.3),
      lanes: [
        [1, 'driving', 3.5],
        [-1, 'driving', 3.5],
      ],
      step: 10,
    }),
  );
  return { origin: [0, 0], roads, junctions: [], signals: [], objects: [], cuts: [] };
}
