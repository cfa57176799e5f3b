// Details of one finding: the source line, its places, its facts and the page of its rule.

/**
 * @typedef {object} DetailActions
 * @property {(place: FindingPlace) => void} go
 * @property {(road: number) => void} road
 */

/** Returns the source line with the marked part underlined. Positions count code points. @param {SourceLine} line */
function sourceLineElement(line) {
  // Indentation is cut, because it takes space from the text.
  const all = Array.from(line.text);
  const indent = Math.min(
    all.findIndex((character) => character !== ' ' && character !== '\t'),
    line.mark?.[0] ?? all.length,
  );
  const characters = all.slice(Math.max(0, indent));
  const mark = line.mark ? [line.mark[0] - (all.length - characters.length), line.mark[1]] : null;
  const code = make('code', 'source');
  if (line.skipped > 0) code.append(make('span', 'muted', '… '));
  const [first = 0, count = 0] = mark ?? [];
  if (mark && first < characters.length) {
    code.append(
      plain(characters.slice(0, first).join('')),
      make('mark', '', plain(characters.slice(first, first + Math.max(count, 1)).join(''))),
      plain(characters.slice(first + Math.max(count, 1)).join('')),
    );
  } else {
    code.append(plain(characters.join('')));
  }
  if (line.more) code.append(make('span', 'muted', ' …'));
  return make('pre', 'source-line', code);
}

const UNDRAWABLE = 'this road cannot be drawn';

/** @param {FindingPlace} place @param {Plan|null} plan @param {DetailActions} actions */
function placeElement(place, plan, actions) {
  const where = withAttributes(whereElement(shortWhereOf(place)), { title: plain(whereOf(place), 600) });
  const head = make('div', 'place-head', where);
  if (place.anchor) head.append(makeButton('link', 'on the map', () => actions.go(place), 'Fly to this place'));
  /** @type {HTMLElement[]} */
  const parts = [head];
  if (place.text) parts.push(make('div', 'place-text', ...withCode(place.text)));
  if (place.line) parts.push(sourceLineElement(place.line));
  if (place.xpath) parts.push(make('div', 'xpath', plain(place.xpath, 2000)));
  const spots = [];
  if (place.road)
    spots.push(`road ${plain(place.road[0], 60)}, s ${fixed(place.road[1])} m, t ${fixed(place.road[2])} m`);
  if (place.at) spots.push(`x ${coordinate(place.at.x)}, y ${coordinate(place.at.y)}`);
  if (place.time !== null) spots.push(`at ${fixed(place.time, 3)} s`);
  if (place.at && plan && !place.anchor) spots.push('too far away to be shown on the map');
  if (spots.length > 0) parts.push(make('div', 'spot muted', spots.join(' · ')));
  for (const target of place.on) {
    const road = plan?.roads[target.road ?? -1];
    if (!road || target.road === undefined) continue;
    const index = target.road;
    parts[parts.length - 1]?.append(
      ' ',
      makeButton('link', `road ${plain(road.id, 40)}`, () => actions.road(index), 'Show the profile of this road'),
    );
    break;
  }
  if (isOnUndrawableRoad(place, plan)) parts.push(make('div', 'undrawable', UNDRAWABLE));
  return make('div', 'place', ...parts);
}

/** @param {number} value */
function coordinate(value) {
  return Math.abs(value) < 1e12 ? value.toFixed(2) : value.toExponential(3);
}

/** @param {RuleInfo} rule */
function ruleElement(rule) {
  const body = make('div', 'rule-body', make('div', 'uid', plain(rule.uid, 300)));
  if (rule.page) body.append(markdownPage(rule.page));
  else if (rule.about) body.append(make('p', '', ...withCode(rule.about)));
  const link = outwardLink(rule.link, 'to the standard');
  if (link) body.append(make('p', '', link));
  return make('details', 'why', make('summary', '', 'Why this is a finding'), body);
}

/** Returns the whole text if the row shows only its beginning. @param {string} text */
function wholeText(text) {
  return text.length > 90 || text.includes('\n') ? make('p', 'detail-text', ...withCode(text)) : null;
}

/**
 * @param {Finding} finding @param {readonly RuleInfo[]} rules @param {readonly any[]} checkers @param {Plan|null} plan
 * @param {DetailActions} actions
 */
function findingDetail(finding, rules, checkers, plan, actions) {
  const detail = make('div', 'detail', wholeText(finding.text));
  finding.places.slice(0, 100).forEach((place, index) => {
    if (index === 1) detail.append(make('h4', '', `Further places (${finding.places.length - 1})`));
    detail.append(placeElement(place, plan, actions));
  });
  if (finding.places.length > 100)
    detail.append(make('p', 'muted', `and ${counted(finding.places.length - 100, 'further place')}`));
  if (finding.places.length === 0) detail.append(make('p', 'muted', 'This finding has no place in a file.'));
  if (finding.facts.length > 0) {
    const facts = finding.facts
      .slice(0, 200)
      .flatMap(([name, text]) => [
        make('dt', '', ...breakable(name, 200)),
        make('dd', '', ...breakable(text, 2000)),
      ]);
    detail.append(make('dl', 'facts', ...facts));
  }
  const rule = rules[finding.rule];
  if (rule) detail.append(ruleElement(rule));
  const checker = textOf(checkers[finding.checker]?.id);
  detail.append(make('div', 'muted small', `finding ${finding.id}${checker ? ` · ${plain(checker, 200)}` : ''}`));
  return detail;
}

/**
 * Returns the row of a finding in the list.
 *
 * @param {Finding} finding
 * @param {RuleInfo|undefined} rule
 * @param {boolean} selected
 * @param {boolean} hasMap
 * @param {() => void} choose
 */
function findingRow(finding, rule, selected, hasMap, choose) {
  const button = makeButton('finding-row', '', choose);
  const [first] = finding.places;
  const where = whereElement(shortWhereOf(first), first?.own === false ? 'where' : 'where own');
  if (first) withAttributes(where, { title: plain(finding.where, 600) });
  const meta = make('span', 'meta', where, make('span', 'rule-name', rule ? shortRule(rule.uid) : ''));
  if (hasMap && !finding.anchor)
    meta.append(
      withAttributes(make('span', 'off-map', 'not on map'), { title: 'This finding has no place on the map' }),
    );
  button.append(levelBadge(finding.level), make('span', 'row-text', ...withCode(finding.text, 400)), meta);
  return withAttributes(button, { 'aria-expanded': String(selected), 'data-finding': finding.id });
}

/**
 * Returns a list to choose from if several findings are at one place.
 *
 * @param {number[]} members
 * @param {readonly Finding[]} findings
 * @param {(index: number) => void} choose
 * @returns {Node[]}
 */
function chooserContent(members, findings, choose) {
  const items = members.slice(0, 100).map((index) => {
    const finding = findings[index];
    const button = makeButton('chooser-item', '', () => choose(index));
    button.append(levelBadge(finding?.level ?? 'information'), make('span', '', ...withCode(finding?.text, 160)));
    return make('li', '', button);
  });
  const content = [make('h2', '', `${counted(members.length, 'finding')} here`), make('ul', '', ...items)];
  const more = members.length - items.length;
  if (more > 0) content.push(make('p', 'muted', `and ${COUNT_FORMAT.format(more)} more; use the filters to see fewer`));
  return content;
}

/** Returns a table with the status of each checker, those without an answer first. @param {readonly any[]} checkers */
function checkersNote(checkers) {
  if (checkers.length === 0) return null;
  const rank = (/** @type {any} */ checker) =>
    checker?.status === 'error' ? 0 : checker?.blocked ? 1 : checker?.status ? 3 : 2;
  const rows = [...checkers]
    .sort((a, b) => rank(a) - rank(b))
    .map((checker) => {
      const status = checker?.blocked
        ? 'blocked'
        : checker?.status === 'error'
          ? 'failed'
          : textOf(checker?.status) || 'unknown';
      const name = withAttributes(make('td', 'mono name', ...breakable(checker?.id, 200)), {
        title: plain(checker?.about, 500),
      });
      return make(
        'tr',
        '',
        make('td', `status ${['blocked', 'failed', 'unknown'].includes(status) ? 'trouble' : ''}`, status),
        name,
        make('td', 'number', COUNT_FORMAT.format(numberOrNull(checker?.findings) ?? 0)),
        make('td', 'summary', ...withCode(checker?.summary, 500)),
      );
    });
  const trouble = checkers.filter((checker) => rank(checker) < 3).length;
  const label = `${counted(checkers.length, 'checker')}${trouble > 0 ? `, ${trouble} without an answer` : ''}`;
  return make('details', 'note checkers', make('summary', '', label), make('table', '', make('tbody', '', ...rows)));
}
