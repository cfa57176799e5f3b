// Model of the findings of a result. Missing values and values of a wrong type become null or empty, because the data
// may be from another version and are not trusted.

/** @typedef {{text: string, skipped: number, more: boolean, mark: [number, number]|null}} SourceLine */

/**
 * @typedef {object} FindingPlace
 * @property {string} file path to display
 * @property {boolean} own whether it is the checked file
 * @property {number|null} row
 * @property {number|null} column
 * @property {string} xpath
 * @property {string} text
 * @property {SourceLine|null} line
 * @property {[string, number, number]|null} road id, s and t in metres
 * @property {number|null} time
 * @property {{x: number, y: number}|null} at in metres of the map
 * @property {{x: number, y: number}|null} anchor in cm from the plan's origin
 * @property {string} how
 * @property {PlanTarget[]} on
 */

/**
 * @typedef {object} Finding
 * @property {number} index
 * @property {number} id
 * @property {Level} level
 * @property {number} rule -1: none
 * @property {number} checker -1: none
 * @property {string} text
 * @property {FindingPlace[]} places
 * @property {[string, string][]} facts
 * @property {string} where path:row:column of the first place
 * @property {{x: number, y: number}|null} anchor
 * @property {boolean} wholeElement whether the finding is about a whole element and not a point
 * @property {string} search
 */

/** @typedef {{uid: string, checker: string, about: string, page: string, link: string}} RuleInfo */

/** Maximum distance from the origin in cm (2,000 km); no plan is larger. */
const FARTHEST = 2e8;

/** @param {unknown} value @returns {number|null} */
function numberOrNull(value) {
  return isFiniteNumber(value) ? value : null;
}

/** @param {unknown} value @param {number} length @returns {number} */
function indexInto(value, length) {
  return Number.isInteger(value) && /** @type {number} */ (value) >= 0 && /** @type {number} */ (value) < length
    ? /** @type {number} */ (value)
    : -1;
}

/** @param {any} line @returns {SourceLine|null} */
function sourceLine(line) {
  if (line === null || typeof line !== 'object') return null;
  const [first, count] = listOf(line.mark);
  const mark =
    Number.isInteger(first) && Number.isInteger(count) && first >= 0 && count >= 0
      ? /** @type {[number, number]} */ ([first, count])
      : null;
  return { text: textOf(line.text), skipped: numberOrNull(line.skipped) ?? 0, more: line.more === true, mark };
}

/** @param {any} target @returns {PlanTarget} */
function planTarget(target) {
  /** @type {Record<string, number>} */
  const known = {};
  for (const name of ['road', 'section', 'lane', 'junction', 'signal', 'object']) {
    if (Number.isInteger(target?.[name])) known[name] = target[name];
  }
  return known;
}

/**
 * @param {any} place
 * @param {string} checked path of the checked file
 * @param {Plan|null} plan
 * @returns {FindingPlace}
 */
function findingPlace(place, checked, plan) {
  const [x, y] = listOf(place?.at);
  const at = isFiniteNumber(x) && isFiniteNumber(y) ? { x, y } : null;
  const [road, s, t] = listOf(place?.road);
  const on = listOf(place?.on).map(planTarget);
  return {
    file: typeof place?.file === 'string' ? place.file : checked,
    own: typeof place?.file !== 'string' || place.file === checked,
    row: numberOrNull(place?.row),
    column: numberOrNull(place?.column),
    xpath: textOf(place?.xpath),
    text: textOf(place?.text),
    line: sourceLine(place?.line),
    road: typeof road === 'string' && isFiniteNumber(s) ? [road, s, numberOrNull(t) ?? 0] : null,
    time: numberOrNull(place?.time),
    at,
    anchor: plan ? anchorInPlan(plan, at, on) : null,
    how: textOf(place?.how),
    on,
  };
}

/** @param {Plan} plan @param {{x: number, y: number}|null} at @param {PlanTarget[]} on */
function anchorInPlan(plan, at, on) {
  if (at) {
    const anchor = { x: (at.x - plan.origin.x) * 100, y: (at.y - plan.origin.y) * 100 };
    return Math.abs(anchor.x) < FARTHEST && Math.abs(anchor.y) < FARTHEST ? anchor : null;
  }
  for (const target of on) {
    const anchor = anchorOf(plan, target);
    if (anchor) return anchor;
  }
  return null;
}

/** @param {{file: string, row: number|null, column: number|null}|undefined} place */
function whereOf(place) {
  if (!place) return '';
  const row = place.row === null ? '' : `:${place.row}${place.column === null ? '' : `:${place.column}`}`;
  return `${place.file}${row}`;
}

/** Returns a place for the list, without the checked file. @param {FindingPlace|undefined} place */
function shortWhereOf(place) {
  if (!place) return 'no place';
  return place.own ? whereOf({ ...place, file: '' }) || 'this file' : whereOf(place);
}

/**
 * Checks whether a place is on a road that cannot be drawn. The map then shows only the marker.
 *
 * @param {FindingPlace} place
 * @param {Plan|null} plan
 */
function isOnUndrawableRoad(place, plan) {
  if (!plan) return false;
  const targets = place.on.flatMap(({ road }) => plan.roads[road ?? -1] ?? []);
  if (targets.length > 0) return targets.some(({ drawable }) => !drawable);
  const named = plan.roads.filter(({ id }) => id === place.road?.[0]);
  return named.length > 0 && named.every(({ drawable }) => !drawable);
}

/** @param {Record<string, any>} data */
function rulesOf(data) {
  return listOf(data.rules).map(
    (rule) =>
      /** @type {RuleInfo} */ ({
        uid: textOf(rule?.uid),
        checker: textOf(rule?.checker),
        about: textOf(rule?.about),
        page: textOf(rule?.page),
        link: textOf(rule?.link),
      }),
  );
}

/**
 * Returns the findings, worst first, otherwise in the order of the result.
 *
 * @param {Record<string, any>} data
 * @param {readonly RuleInfo[]} rules
 * @param {Plan|null} plan
 * @returns {Finding[]}
 */
function findingsOf(data, rules, plan) {
  const checked = textOf(data.file?.path) || textOf(data.file?.name);
  const checkers = listOf(data.checkers).length;
  const findings = listOf(data.findings).map((raw, order) => {
    const places = listOf(raw?.places).map((place) => findingPlace(place, checked, plan));
    const first = places.find(({ anchor }) => anchor !== null);
    const rule = indexInto(raw?.rule, rules.length);
    const facts = listOf(raw?.facts).map(
      (fact) => /** @type {[string, string]} */ ([textOf(fact?.[0]), textOf(fact?.[1])]),
    );
    const text = textOf(raw?.text);
    const where = whereOf(places[0]);
    return {
      index: order,
      id: numberOrNull(raw?.id) ?? order,
      level: levelOf(raw?.level),
      rule,
      checker: indexInto(raw?.checker, checkers),
      text,
      places,
      facts,
      where,
      anchor: first?.anchor ?? null,
      wholeElement: first?.how === 'element' || (first !== undefined && first.at === null),
      search: [
        text,
        where,
        rules[rule]?.uid,
        ...places.map(({ xpath, text: placeText }) => `${xpath} ${placeText}`),
        ...facts.flat(),
      ]
        .join('\n')
        .toLowerCase(),
    };
  });
  findings.sort((a, b) => LEVELS.indexOf(a.level) - LEVELS.indexOf(b.level) || a.index - b.index);
  findings.forEach((finding, index) => {
    finding.index = index;
  });
  return findings;
}

/**
 * Returns a short reason for the verdict.
 *
 * @param {Record<string, any>} data
 * @param {readonly Finding[]} findings
 */
function verdictReason(data, findings) {
  const errors = findings.filter(({ level }) => level === 'error').length;
  if (data.file?.verdict === 'rejected')
    return errors > 0 ? `${counted(errors, 'error')} to fix` : 'an error was found';
  if (data.file?.verdict === 'accepted') return 'all required checks are complete, without an error';
  const checkers = listOf(data.checkers);
  const failed = checkers.filter((checker) => checker?.status === 'error').length;
  const blocked = checkers.filter((checker) => checker?.blocked === true).length;
  const silent = checkers.filter((checker) => checker?.status === null || checker?.status === undefined).length;
  const reasons = [
    failed > 0 ? `${counted(failed, 'checker')} failed` : '',
    blocked > 0 ? `${counted(blocked, 'checker')} did not run because of failed preconditions` : '',
    silent > 0 ? `${counted(silent, 'checker')} reported no status` : '',
  ].filter((reason) => reason !== '');
  if (reasons.length > 0) return `no error found, but ${reasons.join(', and ')}`;
  return checkers.some((checker) => checker?.status === 'completed')
    ? 'the file was not checked completely'
    : 'no checker has checked this file';
}
