'use strict';
// What the pages of results and of runs have in common. The reporter puts the files of a page one after the other
// into its one script (they are plain declarations; the last file starts everything):
//
//   result  shared.js markdown.js list.js plan-data.js plan-grid.js plan-pick.js plan-theme.js plan-paint.js
//           plan-detail.js plan-tile.js plan-camera.js plan-markers.js plan-view.js model.js filters.js detail.js
//           table.js profile.js road-panel.js help.js report.js
//   run     shared.js markdown.js list.js filters.js run-files.js run.js
//
// Everything in a report comes from files of others. Text goes into the page through `textContent` alone, by `make`,
// and whatever is not shown by a browser, or turns the text around it, is made visible by `plain` before.

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
 * A new element with its children; strings become text.
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
 * The element with attributes set; `false` and `null` leave one out.
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

/** Controls, marks that turn the direction of text, and what has no width: nothing of these may act unseen. */
// eslint-disable-next-line no-control-regex
const UNSEEN =
  /[\u0000-\u0008\u000b-\u001f\u007f-\u009f\u00ad\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\uffff]|[\ud800-\udbff](?![\udc00-\udfff])|(?<![\ud800-\udbff])[\udc00-\udfff]/g;

/**
 * Text of others, so that all of it is seen: `‹U+202E›` instead of a mark that turns the rest of the line around.
 *
 * @param {unknown} value
 * @param {number} [most] how many characters at most
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

/** The part of a rule's uid that tells it from its neighbours. @param {string} uid */
function shortRule(uid) {
  const name = uid.slice(uid.lastIndexOf(':') + 1);
  return plain(name || uid, 120);
}

/**
 * Code begins with a backtick that does not follow a word and ends with one that no word follows, without space at
 * either end. A backtick within a word is of an id: it stays where it is, and so does any other without its partner, or
 * all code after it would be turned inside out. Of limited length, as text may consist of beginnings only.
 */
const CODE =
  /((?<![\p{L}\p{N}_`])`(?!\s)(?:[^`\n]|(?<=[\p{L}\p{N}_])`(?=[\p{L}\p{N}_])){1,600}(?<!\s)`(?![\p{L}\p{N}_`]))/u;

/**
 * Text of a finding; what stands between backticks is code.
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
 * A name that is broken after dots and underscores; elsewhere only where a part alone is wider than its column.
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
 * A place in a file. Where there is no room for all of it the directories give way from the left, then the beginning of
 * the name; the row stays.
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

/** How much all paths begin with: directories that say nothing. @param {readonly string[]} paths */
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

/** A link out of the report; anything but a web address stays text. @param {unknown} address @param {string} label */
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

/** What is wrong with a block of data, in a sentence for people. */
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
 * The bytes of a block of data, null where the page has none of this name.
 *
 * @param {string} id
 * @returns {Promise<Uint8Array<ArrayBuffer>|null>}
 */
async function readBlock(id) {
  const block = document.getElementById(id);
  if (!block) return null;
  if (typeof DecompressionStream === 'undefined') {
    throw new BlockError('This browser is too old for this report: it cannot unpack gzip. Any of 2023 or later can.');
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
  if (!bytes) throw new BlockError('This file has no block “data”; it was cut short or is no report.');
  let data;
  try {
    data = JSON.parse(new TextDecoder('utf-8', { fatal: true }).decode(bytes));
  } catch {
    throw new BlockError('The block “data” of this file is damaged: what it holds is no JSON.');
  }
  if (data === null || typeof data !== 'object' || data.schema !== 1) {
    throw new BlockError('The block “data” of this file has a form that this page does not know.');
  }
  return data;
}

/** @param {HTMLElement} app @param {unknown} error */
function showFailure(app, error) {
  const said = error instanceof BlockError ? error.message : 'Something in this report could not be shown.';
  const detail =
    error instanceof BlockError || !(error instanceof Error) ? null : make('pre', '', plain(error.message, 2000));
  app.replaceChildren(
    withAttributes(make('div', 'failure', make('h1', '', 'This report cannot be shown'), make('p', '', said), detail), {
      role: 'alert',
    }),
  );
}

/**
 * What was left out. A sentence is there once, with how often it was said; where two lists say the same they are about
 * the same thing.
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

/** Dark or light: what was chosen here before, else what the system says. */
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
      // A browser may refuse storage to files; the choice then lasts as long as the page.
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

/** Whether a key belongs to what has the focus: text fields, selects. @param {KeyboardEvent} event */
function isTyping(event) {
  const target = event.target;
  if (target instanceof HTMLInputElement) return target.type === 'search' || target.type === 'text';
  return target instanceof HTMLTextAreaElement || target instanceof HTMLSelectElement;
}

/**
 * Escape empties a field for searching, too; the browser's own emptying would come after it has lost the focus, without
 * an event that says so.
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
 * Runs once the markup is there, wherever the script stands.
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

/** More rows than this take a browser a minute to put on pages, and nobody reads them. */
const MOST_PRINTED = 2000;

/**
 * Heading of what is printed, with what is left out.
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
      `${counted(left, one)} ${left === 1 ? 'is' : 'are'} not printed; the filters make them fewer.`,
    ),
  ];
}

/**
 * Calls before and after the page is printed, whoever prints.
 *
 * @param {() => void} before
 * @param {() => void} after
 */
function printing(before, after) {
  addEventListener('beforeprint', before);
  addEventListener('afterprint', after);
  matchMedia('print').addEventListener('change', ({ matches }) => (matches ? before() : after()));
}
