// Filters of findings: levels, facets with one chosen value (rule, file, verdict), words, and a switch. The count
// beside each choice is the number of findings that it would show with the other filters unchanged.

/** @typedef {{level: Level, search: string}} Filterable */

/**
 * @template {Filterable} F
 * @typedef {object} Facet
 * @property {string} name
 * @property {string} all label of the choice without a filter
 * @property {string[]} values
 * @property {(finding: F) => number} of returns the index into the values
 */

/** Maximum number of values with counts. Counting more takes longer than the filter itself. */
const MOST_COUNTED = 600;

/** @template {Filterable} F */
class Filters {
  /**
   * @param {readonly F[]} findings @param {Facet<F>[]} facets @param {() => void} changed
   * @param {{label: string, passes: (finding: F) => boolean}|null} toggle
   */
  constructor(findings, facets, changed, toggle) {
    this.findings = findings;
    this.facets = facets.map((facet) => ({ ...facet, chosen: -1, select: make('select', 'facet') }));
    this.changed = changed;
    this.toggle = toggle;
    /** @type {Set<Level>} */
    this.levels = new Set(LEVELS);
    /** @type {string[]} */
    this.words = [];
    /** Indices of the findings that pass. @type {number[]} */
    this.shown = [];
    this.search = withAttributes(make('input', 'search'), {
      type: 'search',
      placeholder: 'Search  ( / )',
      'aria-label': 'Search in findings',
      autocomplete: 'off',
      spellcheck: 'false',
    });
    this.switch = withAttributes(make('input'), { type: 'checkbox' });
    /** @type {Record<Level, HTMLElement>} */
    this.counts = { error: make('b'), warning: make('b'), information: make('b') };
    this.total = withAttributes(make('span', 'shown-count'), { role: 'status' });
    this.clearButton = makeButton('link', 'clear', () => this.clear(), 'Show all findings again');
    this.element = this.build();
    this.apply();
  }

  build() {
    emptiedByEscape(this.search);
    this.search.addEventListener('input', () => {
      this.words = this.search.value
        .toLowerCase()
        .split(/\s+/)
        .filter((word) => word !== '');
      this.update();
    });
    this.switch.addEventListener('change', () => this.update());
    const levels = LEVELS.map((level) => this.levelBox(level));
    const bar = make(
      'div',
      'filters',
      make('div', 'filter-row', this.search),
      make('div', 'filter-row levels', ...levels),
    );
    const facets = make('div', 'filter-row');
    for (const facet of this.facets) {
      withAttributes(facet.select, { 'aria-label': facet.name });
      facet.select.append(
        new Option(facet.all, '-1'),
        ...facet.values.map((value, index) => new Option(plain(value, 120), String(index))),
      );
      facet.select.addEventListener('change', () => {
        facet.chosen = Number(facet.select.value);
        this.update();
      });
      facets.append(facet.select);
    }
    if (this.facets.length > 0) bar.append(facets);
    const last = make('div', 'filter-row last', this.total, this.clearButton);
    if (this.toggle) last.prepend(make('label', 'check', this.switch, ` ${this.toggle.label}`));
    bar.append(last);
    return withAttributes(bar, { role: 'search' });
  }

  /** @param {Level} level */
  levelBox(level) {
    const box = withAttributes(make('input'), {
      type: 'checkbox',
      checked: true,
      'data-level': level,
      'aria-label': LEVEL_NAMES[level][1],
    });
    box.addEventListener('change', () => {
      if (box.checked) this.levels.add(level);
      else this.levels.delete(level);
      this.update();
    });
    return make(
      'label',
      'check',
      box,
      levelBadge(level),
      this.counts[level],
      ` ${level === 'information' ? 'info' : LEVEL_NAMES[level][1]}`,
    );
  }

  /** @param {string} name name of a facet @param {number} value -1: all */
  choose(name, value) {
    for (const facet of this.facets) {
      if (facet.name !== name) continue;
      facet.chosen = value;
      facet.select.value = String(value);
    }
    this.update();
  }

  clear() {
    this.levels = new Set(LEVELS);
    for (const box of this.element.querySelectorAll('input[data-level]'))
      if (box instanceof HTMLInputElement) box.checked = true;
    this.words = [];
    this.search.value = '';
    this.switch.checked = false;
    for (const facet of this.facets) {
      facet.chosen = -1;
      facet.select.value = '-1';
    }
    this.update();
  }

  get active() {
    return (
      this.levels.size < LEVELS.length ||
      this.words.length > 0 ||
      this.switch.checked ||
      this.facets.some(({ chosen }) => chosen >= 0)
    );
  }

  update() {
    this.apply();
    this.changed();
  }

  apply() {
    /** @type {Record<Level, number>} */
    const levelCounts = { error: 0, warning: 0, information: 0 };
    const facetCounts = this.facets.map(({ values }) => new Int32Array(values.length));
    this.shown = [];
    this.findings.forEach((finding, index) => {
      const other =
        !this.words.every((word) => finding.search.includes(word)) ||
        (this.switch.checked && !this.toggle?.passes(finding));
      if (other) return;
      const levelFails = !this.levels.has(finding.level);
      let failed = -1;
      let fails = 0;
      this.facets.forEach((facet, position) => {
        if (facet.chosen < 0 || facet.of(finding) === facet.chosen) return;
        failed = position;
        fails++;
      });
      if (fails === 0) levelCounts[finding.level]++;
      if (fails === 0 && !levelFails) this.shown.push(index);
      if (levelFails || fails > 1) return;
      this.facets.forEach((facet, position) => {
        const value = facet.of(finding);
        if ((fails === 0 || failed === position) && value >= 0)
          /** @type {Int32Array} */ (facetCounts[position])[value]++;
      });
    });
    this.tell(levelCounts, facetCounts);
  }

  /** @param {Record<Level, number>} levelCounts @param {Int32Array[]} facetCounts */
  tell(levelCounts, facetCounts) {
    for (const level of LEVELS) this.counts[level].textContent = COUNT_FORMAT.format(levelCounts[level]);
    this.facets.forEach((facet, position) => {
      if (facet.values.length > MOST_COUNTED) return;
      facet.values.forEach((value, index) => {
        const option = facet.select.options[index + 1];
        const count = facetCounts[position]?.[index] ?? 0;
        if (option) option.text = `${plain(value, 120)} (${COUNT_FORMAT.format(count)})`;
      });
    });
    const all = this.findings.length;
    this.total.textContent =
      this.shown.length === all
        ? counted(all, 'finding')
        : `${COUNT_FORMAT.format(this.shown.length)} of ${counted(all, 'finding')}`;
    this.clearButton.hidden = !this.active;
  }
}
