// Data of results and runs for test pages.

const RULE_PAGE = `# Widths of lanes

The width of a lane **shall** be defined for the full length of its lane section, so a \`<width>\` element must exist
at \`sOffset="0"\`.

- A lane without a width cannot be drawn.
- See also [the specification](https://publications.pages.asam.net/).

\`\`\`xml
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
\`\`\`
`;

export const RULES = [
  {
    uid: 'asam.net:xodr:1.4.0:road.lane.width.defined_for_full_length',
    checker: 'check_width',
    about: 'Widths cover the section.',
    page: RULE_PAGE,
    link: 'https://publications.pages.asam.net/standards/',
  },
  {
    uid: 'asam.net:xodr:1.7.0:road.geometry.no_gap',
    checker: 'check_gap',
    about: 'Geometries have no gaps.',
    page: '',
    link: '',
  },
  {
    uid: 'asam.net:xodr:1.8.0:junctions.connection.lane_link',
    checker: 'check_link',
    about: 'Lane links lead to lanes.',
    page: RULE_PAGE,
    link: '',
  },
  {
    uid: 'qcbus.dev:xodr:1.0.0:signal.faces_traffic',
    checker: 'check_signal',
    about: 'Signals face traffic.',
    page: '',
    link: '',
  },
];

const CHECKERS = [
  {
    id: 'check_width',
    bundle: 'xodrBundle',
    status: 'completed',
    blocked: false,
    summary: 'checked 17 roads',
    about: 'widths',
    findings: 2,
  },
  { id: 'check_gap', bundle: 'xodrBundle', status: 'completed', blocked: false, summary: '', about: '', findings: 1 },
  {
    id: 'check_link',
    bundle: 'xodrBundle',
    status: 'skipped',
    blocked: true,
    summary: 'requires check_gap',
    about: '',
    findings: 0,
  },
  {
    id: 'check_signal',
    bundle: 'ownBundle',
    status: 'error',
    blocked: false,
    summary: 'crashed',
    about: '',
    findings: 0,
  },
];

export function place(more) {
  return {
    file: null,
    row: 12,
    column: 3,
    xpath: "/OpenDRIVE/road[@id='1']",
    text: 'the road',
    line: null,
    road: null,
    time: null,
    at: null,
    how: null,
    on: [],
    ...more,
  };
}

export function finding(id, level, rule, text, places, facts = []) {
  return { id, level, rule, checker: rule < 0 ? 0 : rule % 4, text, places, facts };
}

export function resultOf(findings, more = {}) {
  return {
    schema: 1,
    generator: 'qcbus 0.1.0',
    file: {
      path: 'maps/town.xodr',
      name: 'town.xodr',
      sha256: 'ab'.repeat(32),
      verdict: 'rejected',
      result: 'town.xodr.xqar',
      config: '',
    },
    checkers: CHECKERS,
    rules: RULES,
    findings,
    map: { path: 'maps/town.xodr', own: true, cuts: [] },
    cuts: [],
    ...more,
  };
}

/** Returns findings on the small town of roads.mjs. */
export function townFindings(origin) {
  const at = (x, y) => [origin[0] + x, origin[1] + y];
  const line = { text: '      <lane id="-2" type="parking" level="false">', skipped: 0, more: false, mark: [6, 14] };
  return [
    finding(
      1,
      'error',
      0,
      'The width of lane -2 starts at sOffset 3.5; the first 3.5 m of the section have no width.',
      [
        place({
          row: 148,
          column: 7,
          xpath: "/OpenDRIVE/road[@id='1']/lanes/laneSection[2]/right/lane[@id='-2']",
          line,
          at: at(76, -4.6),
          how: 'element',
          road: ['1', 60, -4.6],
          on: [{ road: 0, section: 1, lane: -2 }],
        }),
      ],
      [
        ['sOffset', '3.5'],
        ['section', '40 m to 80 m'],
      ],
    ),
    finding(
      2,
      'error',
      1,
      'The gap between two geometries of the reference line is 0.31 m.',
      [
        place({
          row: 402,
          column: 5,
          text: 'the second geometry',
          at: at(180, 7),
          how: 'position',
          road: ['20', 44, 0],
          on: [{ road: 16 }],
          line: {
            text: '<geometry s="44.0" x="690180.0" y="5330007.0" hdg="0.314" length="86.0">',
            skipped: 12,
            more: true,
            mark: [10, 8],
          },
        }),
        place({ row: 396, column: 5, text: 'the first ends here', at: at(179.7, 6.9), how: 'position' }),
      ],
      [['gap', '0.31 m']],
    ),
    finding(3, 'warning', 2, 'Lane 1 of road 1 has no connection in the junction.', [
      place({
        row: 611,
        column: 9,
        xpath: "/OpenDRIVE/junction[@id='100']",
        at: at(0, 0),
        how: 'element',
        on: [{ junction: 0 }],
      }),
    ]),
    finding(4, 'warning', 3, 'The signal faces away from its traffic.', [
      place({ row: 233, column: 11, at: at(18, -8.5), how: 'element', on: [{ signal: 0 }] }),
    ]),
    finding(5, 'information', 3, 'This object has no height and counts as flat.', [
      place({ row: 301, column: 11, at: at(69, 24), how: 'element', on: [{ object: 0 }] }),
    ]),
    finding(6, 'information', -1, 'The header has no geoReference, so the position on earth is unknown.', [
      place({ row: 2, column: 3, text: '', xpath: '/OpenDRIVE/header' }),
    ]),
    finding(7, 'warning', 0, 'The width of lane -1 changes by 0.60 m within 1 m.', [
      place({
        row: 520,
        column: 7,
        at: at(-60, -5),
        how: 'road',
        road: ['3', 44, 5],
        on: [{ road: 2, section: 0, lane: -1 }],
      }),
    ]),
    finding(8, 'error', 1, 'The road ends 1.20 m beside its successor.', [
      place({ row: 702, column: 3, at: at(136, 0.4), how: 'position', on: [{ road: 0 }, { road: 16 }] }),
    ]),
    finding(9, 'error', 1, 'The heading jumps by 0.21 rad.', [
      place({ row: 703, column: 3, at: at(136, 0.4), how: 'position', on: [{ road: 16 }] }),
    ]),
    finding(10, 'warning', 0, 'The shoulder of the motorway is narrower than 2.50 m for 40 m.', [
      place({ row: 900, column: 3, at: at(20, -150), how: 'element', on: [{ road: 17, section: 0, lane: -3 }] }),
    ]),
  ];
}

export function runOf(files, findingsPerFile) {
  const verdicts = ['rejected', 'accepted', 'accepted', 'undetermined'];
  const list = [];
  const findings = [];
  for (let file = 0; file < files; file++) {
    const verdict = verdicts[file % 4];
    const count = verdict === 'accepted' ? 0 : findingsPerFile;
    const counts = { error: 0, warning: 0, information: 0 };
    for (let i = 0; i < count; i++) {
      const level = verdict === 'rejected' && i % 3 === 0 ? 'error' : i % 3 === 1 ? 'warning' : 'information';
      counts[level]++;
      findings.push({
        file,
        level,
        rule: (file + i * i) % RULES.length,
        text: `Finding ${i} of file ${file}: the width of lane -${i + 1} ends too early`,
        row: i + 1,
        column: 3,
        id: i,
      });
    }
    list.push({
      path: `maps/district-${file % 12}/road-network-${file}.xodr`,
      verdict,
      page: verdict === 'accepted' ? '' : `pages/${file} a.html`,
      ...counts,
      why: verdict === 'undetermined' ? 'check_link did not run' : '',
    });
  }
  return {
    schema: 1,
    generator: 'qcbus 0.1.0',
    title: 'Nightly check of all maps',
    made: '2026-11-23T19:00:00Z',
    files: list,
    rules: RULES,
    findings,
    cuts: [],
  };
}
