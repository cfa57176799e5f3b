// Table of the files of a run.

/**
 * shown: the path without the common directory of all paths
 *
 * @typedef {object} RunFile
 * @property {string} path
 * @property {string} verdict
 * @property {string} page
 * @property {number} error
 * @property {number} warning
 * @property {number} information
 * @property {string} why
 * @property {number} index
 * @property {string} search
 * @property {string} shown
 */

/** @typedef {{name: string, title: string, value: (file: RunFile) => string|number}} FileColumn */

/** @type {readonly FileColumn[]} */
const FILE_COLUMNS = [
  { name: 'verdict', title: 'verdict', value: (file) => VERDICTS.indexOf(file.verdict) },
  { name: 'path', title: 'file', value: (file) => file.path },
  { name: 'error', title: 'errors', value: (file) => -file.error },
  { name: 'warning', title: 'warnings', value: (file) => -file.warning },
  { name: 'information', title: 'info', value: (file) => -file.information },
  { name: 'why', title: 'reason', value: (file) => file.why },
];

/** @param {Record<string, any>} data @returns {RunFile[]} */
function runFilesOf(data) {
  const common = commonDirectory(listOf(data.files).map((file) => textOf(file?.path))).length;
  return listOf(data.files).map((file, index) => {
    const count = (/** @type {unknown} */ value) => (isFiniteNumber(value) && value >= 0 ? Math.floor(value) : 0);
    const verdict = VERDICTS.includes(textOf(file?.verdict)) ? textOf(file.verdict) : 'undetermined';
    const [path, why] = [textOf(file?.path), textOf(file?.why)];
    return {
      path,
      shown: path.slice(common) || path,
      verdict,
      page: textOf(file?.page),
      why,
      index,
      error: count(file?.error),
      warning: count(file?.warning),
      information: count(file?.information),
      search: `${path}\n${why}`.toLowerCase(),
    };
  });
}

/**
 * Returns the address of a page beside this one. Only relative addresses are accepted, because a link must not leave
 * the report or be a script.
 *
 * @param {string} page @param {number} [finding]
 */
function pageAddress(page, finding) {
  if (page === '' || page.startsWith('/') || page.includes('\\')) return null;
  const path = page
    .split('/')
    .map((part) => encodeURIComponent(part))
    .join('/');
  return `./${path}${finding === undefined ? '' : `#finding=${finding}`}`;
}

class RunFiles {
  /** @param {RunFile[]} files @param {(file: number) => void} choose */
  constructor(files, choose) {
    this.files = files;
    this.choose = choose;
    this.sorted = FILE_COLUMNS[0];
    this.reversed = false;
    this.verdict = '';
    /** @type {RunFile[]} */
    this.shown = [];
    this.search = withAttributes(make('input', 'search'), {
      type: 'search',
      placeholder: 'Search files',
      'aria-label': 'Search files',
    });
    emptiedByEscape(this.search);
    this.search.addEventListener('input', () => this.update());
    this.count = withAttributes(make('span', 'shown-count'), { role: 'status' });
    this.head = make('div', 'file-row file-head');
    this.list = new VirtualList({ rowHeight: 30, label: 'Files', row: (position) => this.row(position) });
    this.element = make(
      'section',
      files.some(({ why }) => why !== '') ? 'files' : 'files no-why',
      make('div', 'filter-row', this.search, this.count),
      this.head,
      this.list.element,
    );
    for (const column of FILE_COLUMNS) {
      const button = makeButton(`link cell-${column.name}`, column.title, () => this.sortBy(column), 'Sort');
      this.head.append(withAttributes(button, { 'data-column': column.name }));
    }
    this.update();
  }

  /** @param {FileColumn} column */
  sortBy(column) {
    this.reversed = this.sorted === column ? !this.reversed : false;
    this.sorted = column;
    this.update();
  }

  /** @param {string} verdict empty: all */
  setVerdict(verdict) {
    this.verdict = verdict;
    this.update();
  }

  update() {
    const words = this.search.value
      .toLowerCase()
      .split(/\s+/)
      .filter((word) => word !== '');
    this.shown = this.files.filter(
      (file) =>
        (this.verdict === '' || file.verdict === this.verdict) && words.every((word) => file.search.includes(word)),
    );
    const { value } = this.sorted ?? /** @type {FileColumn} */ (FILE_COLUMNS[0]);
    const sign = this.reversed ? -1 : 1;
    this.shown.sort((a, b) => {
      const [x, y] = [value(a), value(b)];
      return (x < y ? -1 : x > y ? 1 : 0) * sign || b.error - a.error || a.index - b.index;
    });
    for (const button of this.head.querySelectorAll('button')) {
      const isSorted = button.dataset.column === this.sorted?.name;
      button.textContent = `${FILE_COLUMNS.find(({ name }) => name === button.dataset.column)?.title ?? ''}${isSorted ? (this.reversed ? ' ↑' : ' ↓') : ''}`;
      withAttributes(button, { 'aria-pressed': String(isSorted) });
    }
    this.count.textContent =
      this.shown.length === this.files.length
        ? counted(this.files.length, 'file')
        : `${COUNT_FORMAT.format(this.shown.length)} of ${counted(this.files.length, 'file')}`;
    this.list.reset(this.shown.length, -1);
  }

  /** @param {number} position */
  row(position) {
    const file = /** @type {RunFile} */ (this.shown[position]);
    const address = pageAddress(file.page);
    const name = plain(file.path, 400);
    const path = address
      ? withAttributes(make('a', '', whereElement(file.shown, 'title')), { href: address })
      : whereElement(file.shown, 'title');
    const number = (/** @type {Level} */ level) =>
      make('span', `number cell-${level}`, file[level] > 0 ? COUNT_FORMAT.format(file[level]) : '·');
    const total = file.error + file.warning + file.information;
    const only =
      total > 0
        ? makeButton('link only', 'findings', () => this.choose(file.index), 'Only the findings of this file')
        : null;
    return make(
      'div',
      'file-row',
      make('span', 'cell-verdict', verdictBadge(file.verdict)),
      withAttributes(make('span', 'cell-path', path), { title: name }),
      number('error'),
      number('warning'),
      number('information'),
      make('span', 'cell-why muted', plain(file.why, 300)),
      only,
    );
  }
}
