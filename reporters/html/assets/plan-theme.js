// Colours of the map. Kinds of lanes differ in lightness as well as in hue, so people with red-green colour blindness
// can distinguish them.

/** Kinds of lanes in drawing order. Lanes for traffic are on top. */
const LANE_KINDS = [
  { name: 'other', types: [''], light: '#dfe1e4', dark: '#30343a' },
  { name: 'none', types: ['none'], light: '#e9ebe6', dark: '#282c2b' },
  { name: 'median', types: ['median'], light: '#cbdcbb', dark: '#33452f' },
  { name: 'border, curb', types: ['border', 'curb'], light: '#c9c2ae', dark: '#4b4638' },
  { name: 'shoulder, stop', types: ['shoulder', 'stop'], light: '#d9cfa9', dark: '#5a5234' },
  {
    name: 'restricted',
    types: ['restricted', 'roadWorks', 'special1', 'special2', 'special3'],
    light: '#e0b48c',
    dark: '#70492a',
  },
  { name: 'sidewalk, walking', types: ['sidewalk', 'walking'], light: '#e3d3e4', dark: '#4f3f55' },
  { name: 'parking', types: ['parking'], light: '#a9c8e8', dark: '#2c4c6d' },
  { name: 'biking', types: ['biking'], light: '#d9958b', dark: '#7d4038' },
  { name: 'rail, tram', types: ['rail', 'tram'], light: '#8f8378', dark: '#6b6059' },
  { name: 'bus, taxi, HOV', types: ['bus', 'taxi', 'HOV', 'shared'], light: '#8ba69f', dark: '#3f5f5a' },
  {
    name: 'entry, exit, ramp',
    types: ['entry', 'exit', 'onRamp', 'offRamp', 'connectingRamp', 'slipLane', 'mwyEntry', 'mwyExit'],
    light: '#93a0b8',
    dark: '#4a5670',
  },
  { name: 'driving', types: ['driving', 'bidirectional'], light: '#a3a8b0', dark: '#4a4f57' },
];

/** @type {Map<string, number>} */
const KIND_OF_TYPE = new Map(
  LANE_KINDS.flatMap(({ types }, kind) => types.map((type) => /** @type {[string, number]} */ ([type, kind]))),
);

/** @param {string} type */
function kindOfLane(type) {
  return KIND_OF_TYPE.get(type) ?? 0;
}

/** Types of lanes that have an arrow, because traffic moves along them. */
const MOVING = new Set([
  'driving',
  'bidirectional',
  'entry',
  'exit',
  'onRamp',
  'offRamp',
  'connectingRamp',
  'slipLane',
  'mwyEntry',
  'mwyExit',
  'bus',
  'taxi',
  'HOV',
  'biking',
  'rail',
  'tram',
]);

const MAP_THEMES = {
  light: {
    ground: '#f3f4f1',
    lanes: LANE_KINDS.map(({ light }) => light),
    edge: '#727984',
    reference: '#7d4fb0',
    text: '#20242a',
    halo: '#ffffffd8',
    arrow: '#3c434d',
    junction: '#2f6f9f',
    signal: '#22262c',
    object: '#6b5a3a',
    objectFill: '#b9a37a55',
    highlight: '#0050d8',
    highlightHalo: '#ffffff',
    highlightFill: '#2f80ff40',
    cluster: '#2a2f37',
    clusterText: '#ffffff',
    grid: '#e6e8e4',
    white: '#ffffff',
    markEdge: '#9aa0a8',
    label: '#fffffff0',
    bodyEdge: '#1c2026',
    bodyMark: '#ffffffe6',
    entities: ['#00857c', '#7b4fc9', '#c2257f', '#3a7d1c', '#8a5527', '#3d4fc0', '#7a7400', '#47708f'],
  },
  dark: {
    ground: '#15181b',
    lanes: LANE_KINDS.map(({ dark }) => dark),
    edge: '#79808a',
    reference: '#bf98ee',
    text: '#eceff3',
    halo: '#101316d8',
    arrow: '#b7bec9',
    junction: '#78b7e6',
    signal: '#e6e9ee',
    object: '#cdb98f',
    objectFill: '#cdb98f30',
    highlight: '#5cb0ff',
    highlightHalo: '#05070a',
    highlightFill: '#5cb0ff45',
    cluster: '#e8ebf0',
    clusterText: '#15181b',
    grid: '#1d2125',
    white: '#f2f2f2',
    markEdge: '#8b929b',
    label: '#22272df0',
    bodyEdge: '#05070a',
    bodyMark: '#101316d8',
    entities: ['#35c9bd', '#b497f2', '#f27dbb', '#8fd16a', '#d9a273', '#93a4ff', '#d3cb57', '#8fc0e3'],
  },
};

/** @typedef {typeof MAP_THEMES.light} MapTheme */

/** Vermilion, orange and blue of Okabe and Ito. The shapes differ too. */
const LEVEL_COLORS = { error: '#d5360f', warning: '#e69f00', information: '#0072b2' };

/** @type {Record<string, string>} */
const MARK_COLORS = {
  yellow: '#e3b505',
  red: '#cc3311',
  blue: '#2a78c8',
  green: '#2e8b57',
  orange: '#ee8833',
  violet: '#8f5fbf',
  black: '#222222',
};

/** @param {string} color @param {MapTheme} theme */
function markColor(color, theme) {
  return MARK_COLORS[color] ?? theme.white;
}

/** Returns the dash pattern of a kind of road mark in metres. @param {string} type @returns {number[]} */
function markPattern(type) {
  if (type === 'broken' || type === 'broken broken') return [3, 4.5];
  if (type === 'botts dots') return [0.3, 1.2];
  if (type === 'broken solid' || type === 'solid broken') return [4.5, 1.5];
  return [];
}
