// Table of the findings: for users who cannot use the map, for copying and for printing.

const ROWS_AT_ONCE = 500;
const COLUMNS = ['level', 'finding', 'place', 'rule', 'x', 'y', 'XPath'];

/** @param {Finding} finding @param {readonly RuleInfo[]} rules @returns {string[]} one text for each column */
function tableCells(finding, rules) {
  const at = finding.places.find((place) => place.at)?.at;
  return [
    finding.level,
    plain(finding.text),
    plain(finding.where),
    plain(rules[finding.rule]?.uid ?? ''),
    at ? coordinate(at.x) : '',
    at ? coordinate(at.y) : '',
    plain(finding.places[0]?.xpath ?? '', 2000),
  ];
}

/** Returns text for spreadsheets. Cells that look like a formula become text. @param {readonly string[][]} rows */
function tabSeparated(rows) {
  return rows
    .map((cells) =>
      cells
        .map((cell) => {
          const flat = cell.replace(/[\t\r\n]+/g, ' ');
          return /^[=+@]|^-[^\d.]/.test(flat) ? `'${flat}` : flat;
        })
        .join('\t'),
    )
    .join('\n');
}

class FindingsTable {
  /**
   * @param {readonly Finding[]} findings
   * @param {readonly RuleInfo[]} rules
   * @param {(index: number) => void} choose
   */
  constructor(findings, rules, choose) {
    this.findings = findings;
    this.rules = rules;
    this.choose = choose;
    /** @type {readonly number[]} */
    this.shown = [];
    this.built = 0;
    this.selected = -1;
    this.body = make('tbody');
    this.status = withAttributes(make('span', 'muted'), { role: 'status' });
    this.more = makeButton('tool', 'Show all rows', () => this.grow(this.shown.length));
    const copy = makeButton(
      'tool',
      'Copy as table',
      () => void this.copy(),
      'Copies all filtered findings, separated by tabs',
    );
    const head = make('tr', '', ...COLUMNS.map((name) => withAttributes(make('th', '', name), { scope: 'col' })));
    const table = make(
      'table',
      'findings-table',
      make('caption', 'sr-only', 'Findings'),
      make('thead', '', head),
      this.body,
    );
    this.scroll = withAttributes(make('div', 'table-scroll', table), {
      tabindex: 0,
      role: 'region',
      'aria-label': 'Findings as a table',
    });
    this.element = make('div', 'table-pane', make('div', 'table-tools', copy, this.more, this.status), this.scroll);
    this.scroll.addEventListener(
      'scroll',
      () => {
        const { scrollTop, clientHeight, scrollHeight } = this.scroll;
        if (scrollTop + 2 * clientHeight > scrollHeight) this.grow(this.built + ROWS_AT_ONCE);
      },
      { passive: true },
    );
  }

  /** @param {readonly number[]} shown @param {number} selected */
  show(shown, selected) {
    this.shown = shown;
    this.selected = selected;
    this.built = 0;
    this.body.replaceChildren();
    this.grow(ROWS_AT_ONCE);
  }

  /** @param {number} upTo */
  grow(upTo) {
    const end = Math.min(upTo, this.shown.length);
    const rows = document.createDocumentFragment();
    for (; this.built < end; this.built++) rows.append(this.row(this.shown[this.built] ?? -1));
    this.body.append(rows);
    this.more.hidden = this.built >= this.shown.length;
    this.status.textContent = `${COUNT_FORMAT.format(this.built)} of ${counted(this.shown.length, 'row')}`;
  }

  /** @param {number} index */
  row(index) {
    const finding = this.findings[index];
    if (!finding) return make('tr');
    const cells = tableCells(finding, this.rules).map((text, column) =>
      make('td', COLUMNS[column] === 'XPath' || column === 2 ? 'mono' : '', column === 0 ? null : text),
    );
    cells[0]?.append(levelBadge(finding.level), ` ${finding.level}`);
    const button = makeButton('link cell', '', () => this.choose(index), 'Show this finding');
    button.append(...withCode(finding.text));
    cells[1]?.replaceChildren(button);
    return withAttributes(make('tr', index === this.selected ? 'selected' : '', ...cells), {
      'data-finding': finding.id,
    });
  }

  async copy() {
    const rows = this.shown.flatMap((index) => {
      const finding = this.findings[index];
      return finding ? [tableCells(finding, this.rules)] : [];
    });
    const text = tabSeparated([COLUMNS, ...rows]);
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      copyBySelection(text);
    }
    this.status.textContent = `${counted(rows.length, 'row')} copied`;
  }
}

/** Copies by a selection, because some browsers deny the clipboard to local files. @param {string} text */
function copyBySelection(text) {
  const area = make('textarea', 'sr-only');
  area.value = text;
  document.body.append(area);
  area.select();
  document.execCommand('copy');
  area.remove();
}

/**
 * Returns the filtered findings for printing. The section exists only while the page is printed.
 *
 * @param {readonly Finding[]} findings
 * @param {readonly number[]} shown
 * @param {readonly RuleInfo[]} rules
 */
function printedTable(findings, shown, rules) {
  const rows = shown.slice(0, MOST_PRINTED).flatMap((index) => {
    const finding = findings[index];
    if (!finding) return [];
    const cells = tableCells(finding, rules)
      .slice(0, 4)
      .map((text, column) => make('td', '', ...(column === 1 ? withCode(finding.text) : [text])));
    return [make('tr', '', ...cells)];
  });
  const head = make('tr', '', ...COLUMNS.slice(0, 4).map((name) => make('th', '', name)));
  return make(
    'section',
    'printed',
    ...printedHead(shown.length, 'finding'),
    make('table', 'findings-table', make('thead', '', head), make('tbody', '', ...rows)),
  );
}
