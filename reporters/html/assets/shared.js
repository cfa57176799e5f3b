'use strict';
// Common parts of the pages of results and of runs. The reporter concatenates the files of a page into one script
// (they are plain declarations; the last file starts the page):
//
//   result  shared.js markdown.js list.js plan-data.js plan-grid.js plan-pick.js plan-theme.js plan-paint.js
//           plan-detail.js plan-tile.js plan-camera.js plan-markers.js plan-actors.js plan-view.js model.js
//           story-model.js story-bars.js timeline-rows.js timeline.js scene.js filters.js detail.js table.js
//           profile.js road-panel.js help.js report.js
//   run     shared.js markdown.js list.js filters.js run-files.js run.js
//
// All data in a report come from untrusted files. `make` adds text to the page only through `textContent`. `plain`
// first makes characters visible that a browser does not show or that change the direction of text.

/** @typedef {'error'|'warning'|'information'} Level */

/** @type {readonly Level[]} */
const LEVELS = ['error', 'warning', 'information'];

/** @type {Record<Level, readonly [one: string, many: string]>} */
const LEVEL_NAMES = {
  error: ['error', 'errors'],
  warning: ['warning', 'warnings'],
  information: ['information', 'informations'],
};

const VERDICTS = ['rejected', 'undetermined', 'accepted'];

/**
 * Returns a new element with its children. Strings become text.
 *
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {string} [className]
 * @param {...(Node|string|null|undefined)} children
 * @returns {HTMLElementTagNameMap[T]}
 */
function make(tag, className, ...children) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  for (const child of children) {
    if (child !== null && child !== undefined) element.append(child);
  }
  return element;
}

/**
 * Sets attributes and returns the element. `false` and `null` leave one out.
 *
 * @template {Element} E
 * @param {E} element
 * @param {Record<string, string|number|boolean|null|undefined>} attributes
 * @returns {E}
 */
function withAttributes(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value === false || value === null || value === undefined) element.removeAttribute(name);
    else element.setAttribute(name, value === true ? '' : String(value));
  }
  return element;
}

/**
 * @param {string} className
 * @param {string} label
 * @param {(event: MouseEvent) => void} action
 * @param {string} [hint]
 */
function makeButton(className, label, action, hint) {
  const button = make('button', className, label);
  button.type = 'button';
  if (hint) button.title = hint;
  button.addEventListener('click', action);
  return button;
}

/** Control characters, marks of text direction and characters without width. They must not act invisibly. */
// eslint-disable-next-line no-control-regex
const UNSEEN =
  /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\uffff]|[\ud800-\udbff](?![\udc00-\udfff])|(?<![\ud800-\udbff])[\udc00-\udfff]/g;

/**
 * Returns untrusted text with invisible characters made visible, for example `‹U+202E›` for a direction mark.
 *
 * @param {unknown} value
 * @param {number} [most] maximum number of characters
 */
function plain(value, most = 20000) {
  const text = typeof value === 'string' ? value : value === null || value === undefined ? '' : String(value);
  const shown = text.length > most ? `${text.slice(0, most)}…` : text;
  return shown.replace(UNSEEN, (character) => {
    const code = character.codePointAt(0) ?? 0;
    return `‹U+${code.toString(16).toUpperCase().padStart(4, '0')}›`;
  });
}

/** @param {unknown} value @returns {value is number} */
function isFiniteNumber(value) {
  return typeof value === 'number' && Number.isFinite(value);
}

/** @param {unknown} value @returns {any[]} */
function listOf(value) {
  return Array.isArray(value) ? value : [];
}

/** @param {unknown} value @returns {string} */
function textOf(value) {
  return typeof value === 'string' ? value : '';
}

/** @param {unknown} value @returns {Level} */
function levelOf(value) {
  return value === 'error' || value === 'warning' ? value : 'information';
}

const COUNT_FORMAT = new Intl.NumberFormat('en-US');

/** @param {number} count @param {string} one @param {string} [many] */
function counted(count, one, many = `${one}s`) {
  return `${COUNT_FORMAT.format(count)} ${count === 1 ? one : many}`;
}

/** @param {number} value @param {number} [digits] */
function fixed(value, digits = 2) {
  return Number.isFinite(value) ? value.toFixed(digits) : '–';
}

/** Returns the last part of a rule's uid. @param {string} uid */
function shortRule(uid) {
  const name = uid.slice(uid.lastIndexOf(':') + 1);
  return plain(name || uid, 120);
}

/**
 * Code in text. It begins with a backtick that does not follow a word, and ends with one before no word, without space
 * at either end. A backtick within a word belongs to an id and stays. An unpaired one stays too, because otherwise code
 * and text would swap after it. The length is limited, because a text may consist of opening backticks only.
 */
const CODE =
  /((?<![\p{L}\p{N}_`])`(?!\s)(?:[^`\n]|(?<=[\p{L}\p{N}_])`(?=[\p{L}\p{N}_])){1,600}(?<!\s)`(?![\p{L}\p{N}_`]))/u;

/**
 * Returns text of a finding. Text between backticks is code.
 *
 * @param {unknown} value
 * @param {number} [most]
 * @returns {(Node|string)[]}
 */
function withCode(value, most) {
  return plain(value, most)
    .split(CODE)
    .map((part, index) => (index % 2 === 1 ? make('code', '', part.slice(1, -1)) : part));
}

const NAME_PARTS = /[^._]+[._]*|[._]+/g;

/**
 * Returns a name that breaks after dots and underscores, and elsewhere only if one part is wider than its column.
 *
 * @param {unknown} value
 * @param {number} [most]
 * @returns {(Node|string)[]}
 */
function breakable(value, most) {
  const parts = plain(value, most).match(NAME_PARTS) ?? [];
  return parts.flatMap((part, index) => (index === 0 ? [part] : [make('wbr'), part]));
}

/**
 * Returns a place in a file. If space is short, the directories are cut from the left, then the beginning of the name.
 * The row is never cut.
 *
 * @param {string} where
 * @param {string} [className]
 */
function whereElement(where, className = 'where') {
  const shown = plain(where, 600);
  const name = Math.max(shown.lastIndexOf('/'), shown.lastIndexOf('\\')) + 1;
  const element = make(
    'span',
    className,
    name > 0 ? make('span', 'directory', withAttributes(make('bdi', '', shown.slice(0, name)), { dir: 'ltr' })) : null,
    make('span', 'file-name', withAttributes(make('bdi', '', shown.slice(name)), { dir: 'ltr' })),
  );
  return withAttributes(element, { title: shown });
}

/** Returns the common directory of all paths. @param {readonly string[]} paths */
function commonDirectory(paths) {
  let common = paths[0] ?? '';
  for (const path of paths) while (!path.startsWith(common)) common = common.slice(0, -1);
  return common.slice(0, common.lastIndexOf('/') + 1);
}

/** @param {Level} level */
function levelBadge(level) {
  const badge = make('span', `level ${level}`);
  return withAttributes(badge, { role: 'img', 'aria-label': level, title: level });
}

/** @param {unknown} verdict */
function verdictBadge(verdict) {
  const word = VERDICTS.includes(textOf(verdict)) ? textOf(verdict) : 'undetermined';
  return make('span', `verdict ${word}`, word);
}

/** Returns a link out of the report, or text if it is no web address. @param {unknown} address @param {string} label */
function outwardLink(address, label) {
  const target = textOf(address);
  if (!/^https?:\/\/[^\s]+$/i.test(target)) return target ? make('span', 'muted', plain(target, 500)) : null;
  const link = make('a', 'outward', label);
  return withAttributes(link, {
    href: target,
    rel: 'noopener noreferrer',
    target: '_blank',
    title: plain(target, 500),
  });
}

/** Error in a block of data, with a sentence for the user. */
class BlockError extends Error {}

/** @param {string} base64 @returns {Uint8Array<ArrayBuffer>} */
function fromBase64(base64) {
  const native = /** @type {{fromBase64?: (text: string) => Uint8Array<ArrayBuffer>}} */ (
    /** @type {unknown} */ (Uint8Array)
  ).fromBase64;
  if (native) return native.call(Uint8Array, base64);
  const binary = atob(base64);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; i++) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

/**
 * Returns the bytes of a block of data, or null if the page has no block of this name.
 *
 * @param {string} id
 * @returns {Promise<Uint8Array<ArrayBuffer>|null>}
 */
async function readBlock(id) {
  const block = document.getElementById(id);
  if (!block) return null;
  if (typeof DecompressionStream === 'undefined') {
    throw new BlockError('This browser is too old for this report: it has no gzip. Use one of 2023 or later.');
  }
  try {
    const packed = fromBase64((block.textContent ?? '').trim());
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  } catch {
    throw new BlockError(`The block “${id}” of this file is damaged: it cannot be unpacked.`);
  }
}

/** @returns {Promise<Record<string, any>>} */
async function readData() {
  const bytes = await readBlock('data');
  if (!bytes) throw new BlockError('This file has no block “data”; it is truncated or not a report.');
  let data;
  try {
    data = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(bytes));
  } catch {
    throw new BlockError('The block “data” of this file is damaged: it is not JSON.');
  }
  if (data === null || typeof data !== 'object' || data.schema !== 1) {
    throw new BlockError('The block “data” of this file has an unknown format.');
  }
  return data;
}

/** @param {HTMLElement} app @param {unknown} error */
function showFailure(app, error) {
  const sentence = error instanceof BlockError ? error.message : 'A part of this report cannot be shown.';
  const detail =
    error instanceof BlockError || !(error instanceof Error) ? null : make('pre', '', plain(error.message, 2000));
  app.replaceChildren(
    withAttributes(make('div', 'failure', make('h1', '', 'This report cannot be shown'), make('p', '', sentence), detail), {
      role: 'alert',
    }),
  );
}

/**
 * Returns a note about data that were left out. Each sentence appears once, with its number of occurrences. A sentence
 * in two lists is about the same data.
 *
 * @param {string} title
 * @param {...unknown} lists sentences
 */
function cutsNote(title, ...lists) {
  /** @type {Map<string, number>} */
  const times = new Map();
  for (const list of lists) {
    /** @type {Map<string, number>} */
    const own = new Map();
    for (const cut of listOf(list)) {
      const sentence = plain(cut, 1000);
      if (sentence !== '') own.set(sentence, (own.get(sentence) ?? 0) + 1);
    }
    for (const [sentence, count] of own) times.set(sentence, Math.max(count, times.get(sentence) ?? 0));
  }
  if (times.size === 0) return null;
  const items = [...times].map(([sentence, count]) =>
    make('li', '', ...withCode(sentence), count > 1 ? ` (${COUNT_FORMAT.format(count)} times)` : null),
  );
  const summary = make('summary', '', `${title} (${COUNT_FORMAT.format(times.size)})`);
  return make('details', 'note cuts', summary, make('ul', '', ...items));
}

/** Dark or light theme: the last choice of the user, otherwise the system setting. */
class Theme {
  constructor() {
    /** @type {(() => void)[]} */
    this.listeners = [];
    this.system = matchMedia('(prefers-color-scheme: dark)');
    this.chosen = Theme.remembered();
    this.apply();
    this.system.addEventListener('change', () => this.apply());
  }

  get dark() {
    return this.chosen === null ? this.system.matches : this.chosen === 'dark';
  }

  toggle() {
    this.chosen = this.dark ? 'light' : 'dark';
    try {
      localStorage.setItem('qcbus-theme', this.chosen);
    } catch {
      // A browser may refuse storage to local files. The choice is then lost with the page.
    }
    this.apply();
  }

  apply() {
    document.documentElement.dataset.theme = this.dark ? 'dark' : 'light';
    for (const listener of this.listeners) listener();
  }

  /** @returns {string|null} */
  static remembered() {
    try {
      const stored = localStorage.getItem('qcbus-theme');
      return stored === 'dark' || stored === 'light' ? stored : null;
    } catch {
      return null;
    }
  }

  button() {
    return withAttributes(
      makeButton('tool', '◐', () => this.toggle(), 'Dark or light (d)'),
      { 'aria-label': 'Dark or light' },
    );
  }
}

/** Checks whether a key belongs to the focused element, such as a text field. @param {KeyboardEvent} event */
function isTyping(event) {
  const target = event.target;
  if (target instanceof HTMLInputElement) return target.type === 'search' || target.type === 'text';
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

/**
 * Makes Escape clear a search field. The browser would clear it only after it has lost the focus, without an event.
 *
 * @param {HTMLInputElement} search
 */
function emptiedByEscape(search) {
  search.addEventListener('keydown', (event) => {
    if (event.key !== 'Escape' || search.value === '') return;
    search.value = '';
    search.dispatchEvent(new Event('input', { bubbles: true }));
  });
}

/** @param {HTMLElement} app @param {(app: HTMLElement) => Promise<void>} build */
async function startPage(app, build) {
  try {
    await build(app);
  } catch (error) {
    showFailure(app, error);
  }
}

/**
 * Runs after the markup is parsed, regardless of the script's position.
 *
 * @param {() => Promise<void>} start
 * @returns {Promise<void>}
 */
function whenParsed(start) {
  if (document.readyState !== 'loading') return start();
  return new Promise((resolve) => {
    document.addEventListener('DOMContentLoaded', () => resolve(start()), { once: true });
  });
}

/** Maximum number of printed rows. A browser needs a minute to lay out more. */
const MOST_PRINTED = 2000;

/**
 * Returns the heading of a printed table, with the number of rows that are left out.
 *
 * @param {number} all
 * @param {string} one
 * @returns {HTMLElement[]}
 */
function printedHead(all, one) {
  if (all <= MOST_PRINTED) return [make('h2', '', counted(all, one))];
  const left = all - MOST_PRINTED;
  return [
    make('h2', '', `${COUNT_FORMAT.format(MOST_PRINTED)} of ${counted(all, one)}`),
    make(
      'p',
      'left-out',
      `${counted(left, one)} ${left === 1 ? 'is' : 'are'} not printed; use the filters to see fewer.`,
    ),
  ];
}

/**
 * Calls functions before and after every printing of the page.
 *
 * @param {() => void} before
 * @param {() => void} after
 */
function printing(before, after) {
  addEventListener('beforeprint', before);
  addEventListener('afterprint', after);
  matchMedia('print').addEventListener('change', ({ matches }) => (matches ? before() : after()));
}
