// Page of a run: verdicts of all files, the rules to fix first, all findings.

(() => {
  const app = document.getElementById('app') ?? document.body.appendChild(make('main'));

  /** @typedef {{file: number, level: Level, rule: number, text: string, row: number|null, column: number|null, id: number, search: string}} RunFinding */

  /**
   * @param {Record<string, any>} data
   * @param {readonly RunFile[]} files
   * @param {readonly RuleInfo[]} rules
   * @returns {RunFinding[]}
   */
  function runFindingsOf(data, files, rules) {
    const number = (/** @type {unknown} */ value) => (isFiniteNumber(value) ? value : null);
    const index = (/** @type {unknown} */ value, /** @type {number} */ length) =>
      Number.isInteger(value) && Number(value) >= 0 && Number(value) < length ? Number(value) : -1;
    return listOf(data.findings)
      .map((finding, order) => {
        const [file, rule] = [index(finding?.file, files.length), index(finding?.rule, rules.length)];
        const text = textOf(finding?.text);
        return {
          file,
          level: levelOf(finding?.level),
          rule,
          text,
          row: number(finding?.row),
          column: number(finding?.column),
          id: number(finding?.id) ?? order,
          search: `${text}\n${files[file]?.path ?? ''}\n${rules[rule]?.uid ?? ''}`.toLowerCase(),
        };
      })
      .sort((a, b) => LEVELS.indexOf(a.level) - LEVELS.indexOf(b.level) || a.file - b.file);
  }

  class RunPage {
    /** @param {Record<string, any>} data @param {Theme} theme */
    constructor(data, theme) {
      this.data = data;
      this.theme = theme;
      this.files = runFilesOf(data);
      this.rules = listOf(data.rules).map((rule) => ({
        uid: textOf(rule?.uid),
        checker: textOf(rule?.checker),
        about: textOf(rule?.about),
        page: textOf(rule?.page),
        link: textOf(rule?.link),
      }));
      this.findings = runFindingsOf(data, this.files, this.rules);
      this.opened = -1;
      this.filters = new Filters(this.findings, this.facets(), () => this.filtered(), null);
      this.list = new VirtualList({
        rowHeight: 50,
        label: 'Findings',
        row: (position) => this.row(position),
        detail: (position) => this.detail(position),
      });
      this.table = new RunFiles(this.files, (file) => this.filters.choose('file', this.fileChoices.indexOf(file)));
      this.empty = make('p', 'empty muted', 'No finding passes the filters.');
      this.verdictButtons = VERDICTS.map((verdict) => this.verdictButton(verdict));
    }

    /** Files with findings. Files without findings are no choices of the filter. @type {number[]} */
    fileChoices = [];

    /** @returns {Facet<RunFinding>[]} */
    facets() {
      this.fileChoices = [...new Set(this.findings.map(({ file }) => file))]
        .filter((file) => file >= 0)
        .sort((a, b) => a - b);
      const filePosition = new Map(this.fileChoices.map((file, position) => [file, position]));
      return [
        {
          name: 'rule',
          all: `All rules (${this.rules.length})`,
          values: this.rules.map(({ uid }) => shortRule(uid)),
          of: ({ rule }) => rule,
        },
        {
          name: 'file',
          all: `All files (${this.fileChoices.length} with findings)`,
          values: this.fileChoices.map((file) => this.files[file]?.shown ?? ''),
          of: ({ file }) => filePosition.get(file) ?? -1,
        },
        {
          name: 'verdict',
          all: 'All verdicts',
          values: VERDICTS,
          of: ({ file }) => VERDICTS.indexOf(this.files[file]?.verdict ?? ''),
        },
      ];
    }

    /** @param {string} verdict */
    verdictButton(verdict) {
      const count = this.files.filter((file) => file.verdict === verdict).length;
      const button = makeButton(
        'verdict-count',
        '',
        () => {
          const chosen = this.table.verdict === verdict ? '' : verdict;
          this.table.setVerdict(chosen);
          this.filters.choose('verdict', VERDICTS.indexOf(chosen));
        },
        `Only files that are ${verdict}`,
      );
      button.append(make('b', '', COUNT_FORMAT.format(count)), verdictBadge(verdict));
      return withAttributes(button, { 'data-verdict': verdict, 'aria-pressed': 'false' });
    }

    mount() {
      app.className = 'run';
      const title = textOf(this.data.title) || 'Results';
      document.title = plain(title, 200);
      const made = textOf(this.data.made);
      const top = make(
        'div',
        'head-line',
        make('h1', '', plain(title, 300)),
        make('span', 'verdict-counts', ...this.verdictButtons),
        make('div', 'tools', this.theme.button()),
      );
      const second = make(
        'div',
        'head-line second',
        make('span', 'muted', plain(commonDirectory(this.files.map(({ path }) => path)), 300)),
        make('span', 'muted', made ? plain(made.replace('T', ' ').replace('Z', ' UTC'), 60) : ''),
        cutsNote('Left out of this report', this.data.cuts),
        make('span', 'muted generator', plain(this.data.generator, 80)),
      );
      const left = make('div', 'run-left', this.firstToMend(), this.table.element);
      const right = make(
        'aside',
        'side',
        make('h2', '', 'Findings'),
        this.filters.element,
        this.empty,
        this.list.element,
      );
      app.replaceChildren(make('header', 'head', top, second), make('div', 'body', left, right));
      this.filtered();
      document.addEventListener('keydown', (event) => this.key(event));
      printing(
        () => this.beforePrint(),
        () => this.afterPrint(),
      );
    }

    /** Returns the rules by level, number of files and number of findings, so the most useful fix comes first. */
    firstToMend() {
      const tallies = this.rules.map((_, rule) => ({
        rule,
        findings: 0,
        errors: 0,
        files: new Set(),
        level: /** @type {Level} */ ('information'),
      }));
      for (const { rule, file, level } of this.findings) {
        const tally = tallies[rule];
        if (!tally) continue;
        tally.findings++;
        tally.files.add(file);
        if (LEVELS.indexOf(level) < LEVELS.indexOf(tally.level)) tally.level = level;
      }
      const used = tallies
        .filter(({ findings }) => findings > 0)
        .sort(
          (a, b) =>
            LEVELS.indexOf(a.level) - LEVELS.indexOf(b.level) || b.files.size - a.files.size || b.findings - a.findings,
        );
      const most = Math.max(1, ...used.map(({ findings }) => findings));
      const rows = used.slice(0, 60).map(({ rule, findings, files, level }) => {
        const button = makeButton(
          'mend-row',
          '',
          () => this.filters.choose('rule', rule),
          plain(this.rules[rule]?.uid, 300),
        );
        const bar = make('span', `bar ${level}`);
        bar.style.width = `${Math.max(2, (findings / most) * 100)}%`;
        const about = this.rules[rule]?.about || '';
        button.append(
          levelBadge(level),
          make(
            'span',
            'mend-name',
            make('span', '', shortRule(this.rules[rule]?.uid ?? '')),
            make('span', 'muted', ' ', ...withCode(about, 160)),
          ),
          make('span', 'number', counted(findings, 'finding')),
          make('span', 'number muted', counted(files.size, 'file')),
          make('span', 'bar-box', bar),
        );
        return make('li', '', button);
      });
      if (rows.length === 0) return null;
      return make('section', 'mend', make('h2', '', 'What to fix first'), make('ul', '', ...rows));
    }

    /** @param {number} position */
    row(position) {
      const index = this.filters.shown[position] ?? -1;
      const finding = /** @type {RunFinding} */ (this.findings[index]);
      const path = this.files[finding.file]?.shown ?? '';
      const place = `${path}${finding.row === null ? '' : `:${finding.row}`}${finding.row === null || finding.column === null ? '' : `:${finding.column}`}`;
      const button = makeButton('finding-row one-line', '', () =>
        this.open(position === this.list.opened ? -1 : position),
      );
      button.append(
        levelBadge(finding.level),
        make('span', 'row-text', ...withCode(finding.text, 400)),
        make(
          'span',
          'meta',
          whereElement(place),
          make('span', 'rule-name', shortRule(this.rules[finding.rule]?.uid ?? '')),
        ),
      );
      return withAttributes(button, {
        'aria-expanded': String(index === this.opened),
        'data-finding': finding.id,
      });
    }

    /** @param {number} position */
    detail(position) {
      const finding = this.findings[this.filters.shown[position] ?? -1];
      if (!finding) return null;
      const detail = make(
        'div',
        'detail',
        finding.text.length > 70 || finding.text.includes('\n')
          ? make('p', 'detail-text', ...withCode(finding.text))
          : null,
      );
      const address = pageAddress(this.files[finding.file]?.page ?? '', finding.id);
      if (address)
        detail.append(make('p', '', withAttributes(make('a', '', 'Open on the page of the file'), { href: address })));
      const rule = this.rules[finding.rule];
      if (!rule) return detail;
      const link = outwardLink(rule.link, 'to the standard');
      const page = rule.page ? markdownPage(rule.page) : make('p', '', ...withCode(rule.about));
      detail.append(
        make(
          'details',
          'why',
          make('summary', '', 'Why this is a finding'),
          make('div', 'rule-body', make('div', 'uid', plain(rule.uid, 300)), page, link ?? ''),
        ),
      );
      return detail;
    }

    /** @param {number} position */
    open(position) {
      this.opened = this.filters.shown[position] ?? -1;
      this.list.open(position);
      this.list.reveal(position);
      this.list.focus(position);
    }

    filtered() {
      const position = this.filters.shown.indexOf(this.opened);
      this.list.reset(this.filters.shown.length, position);
      this.empty.hidden = this.filters.shown.length > 0;
      const facet = this.filters.facets.find(({ name }) => name === 'verdict');
      const verdict = VERDICTS[facet?.chosen ?? -1] ?? '';
      if (this.table.verdict !== verdict) this.table.setVerdict(verdict);
      for (const button of this.verdictButtons)
        withAttributes(button, { 'aria-pressed': String(button.dataset.verdict === verdict) });
    }

    /** @param {KeyboardEvent} event */
    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (isTyping(event)) {
        if (event.key === 'Escape' && event.target instanceof HTMLElement) event.target.blur();
        return;
      }
      const now = this.list.opened;
      if (event.key === '/') this.filters.search.focus();
      else if (event.key === 'd') this.theme.toggle();
      else if (event.key === 'j' || event.key === 'ArrowDown')
        this.open(Math.min(this.filters.shown.length - 1, now + 1));
      else if (event.key === 'k' || event.key === 'ArrowUp') this.open(Math.max(0, now - 1));
      else if (event.key === 'Escape') this.filters.clear();
      else return;
      event.preventDefault();
    }

    beforePrint() {
      this.afterPrint();
      const files = this.table.shown.slice(0, MOST_PRINTED).map((file) =>
        make(
          'tr',
          '',
          make('td', '', file.verdict),
          make('td', '', plain(file.path)),
          make('td', '', String(file.error)),
          make('td', '', String(file.warning)),
          make('td', '', plain(file.why)),
        ),
      );
      const findings = this.filters.shown.slice(0, MOST_PRINTED).map((index) => {
        const finding = /** @type {RunFinding} */ (this.findings[index]);
        return make(
          'tr',
          '',
          make('td', '', finding.level),
          make('td', '', ...withCode(finding.text)),
          make('td', '', plain(this.files[finding.file]?.path)),
          make('td', '', shortRule(this.rules[finding.rule]?.uid ?? '')),
        );
      });
      app.append(
        make(
          'section',
          'printed',
          ...printedHead(this.table.shown.length, 'file'),
          make('table', 'findings-table', make('tbody', '', ...files)),
          ...printedHead(this.filters.shown.length, 'finding'),
          make('table', 'findings-table', make('tbody', '', ...findings)),
        ),
      );
    }

    afterPrint() {
      for (const printed of app.querySelectorAll('.printed')) printed.remove();
    }
  }

  const theme = new Theme();
  /** @type {RunPage|null} */
  let page = null;
  let decodeMs = 0;
  const ready = whenParsed(() =>
    startPage(app, async () => {
      const began = performance.now();
      const data = await readData();
      decodeMs = performance.now() - began;
      page = new RunPage(data, theme);
      page.mount();
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
    }),
  );

  Object.assign(window, {
    qcbus: {
      ready,
      stats: () => ({ decodeMs, files: page?.files.length ?? 0, findings: page?.findings.length ?? 0 }),
      shown: () => ({ files: page?.table.shown.length ?? 0, findings: page?.filters.shown.length ?? 0 }),
    },
  });
})();
