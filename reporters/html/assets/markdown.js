// Pages of rules as elements. Supports a part of Markdown: headings, paragraphs, lists, fenced code, tables as plain
// text, and inline code, emphasis and links. Links are shown as text with their address, because a page of an untrusted
// bundle must not contain clickable links.

/** `code`, **strong**, *emphasis*, [text](address); everything else is text. */
const INLINE = /`([^`]+)`|\*\*([^*]+)\*\*|\*([^*\s][^*]*)\*|\[([^\]]*)\]\(([^)\s]*)\)/g;

/** @param {string} text @returns {(Node|string)[]} */
function inlineMarkdown(text) {
  /** @type {(Node|string)[]} */
  const parts = [];
  let end = 0;
  for (const found of text.matchAll(INLINE)) {
    parts.push(plain(text.slice(end, found.index)));
    end = found.index + found[0].length;
    const [, code, strong, emphasis, label, address] = found;
    if (code !== undefined) parts.push(make('code', '', plain(code)));
    else if (strong !== undefined) parts.push(make('strong', '', plain(strong)));
    else if (emphasis !== undefined) parts.push(make('em', '', plain(emphasis)));
    else parts.push(plain(label ? `${label} (${address})` : address));
  }
  parts.push(plain(text.slice(end)));
  return parts;
}

/** Returns the kind of a line outside of fenced code. @param {string} line */
function markdownLine(line) {
  const heading = /^(#{1,6})\s+(.*?)\s*#*$/.exec(line);
  if (heading) return { kind: 'heading', depth: (heading[1] ?? '#').length, text: heading[2] ?? '' };
  const bullet = /^\s{0,8}[-*+]\s+(.*)$/.exec(line);
  if (bullet) return { kind: 'ul', depth: 0, text: bullet[1] ?? '' };
  const number = /^\s{0,8}\d{1,6}[.)]\s+(.*)$/.exec(line);
  if (number) return { kind: 'ol', depth: 0, text: number[1] ?? '' };
  if (/^\s*\|.*\|\s*$/.test(line)) return { kind: 'table', depth: 0, text: line };
  if (line.trim() === '') return { kind: 'empty', depth: 0, text: '' };
  return { kind: 'text', depth: 0, text: line.trim() };
}

/** Groups lines into blocks. One block is open at a time. */
class MarkdownBuilder {
  constructor() {
    this.page = make('div', 'markdown');
    this.kind = 'empty';
    /** @type {string[]} */
    this.lines = [];
    this.fence = '';
  }

  /** @param {string} line */
  take(line) {
    const fence = /^\s{0,3}(```+|~~~+)/.exec(line);
    if (this.fence !== '') {
      if (fence && (fence[1] ?? '').startsWith(this.fence)) this.close();
      else this.lines.push(line);
    } else if (fence) {
      this.close();
      this.kind = 'fence';
      this.fence = fence[1] ?? '```';
    } else {
      this.takePlain(line);
    }
  }

  /** @param {string} line */
  takePlain(line) {
    const { kind, depth, text } = markdownLine(line);
    const isList = this.kind === 'ul' || this.kind === 'ol';
    if (kind === 'text' && isList && this.lines.length > 0) {
      this.lines.push(`${this.lines.pop()} ${text}`);
      return;
    }
    if (kind !== this.kind) this.close();
    if (kind === 'heading') {
      this.page.append(make(depth <= 2 ? 'h4' : 'h5', '', ...inlineMarkdown(text)));
    } else if (kind !== 'empty') {
      this.kind = kind;
      this.lines.push(text);
    }
  }

  close() {
    const { kind, lines } = this;
    this.kind = 'empty';
    this.lines = [];
    this.fence = '';
    if (kind === 'fence' || (kind === 'table' && lines.length > 0)) {
      this.page.append(make('pre', '', plain(lines.join('\n'))));
    } else if (lines.length === 0) {
      return;
    } else if (kind === 'ul' || kind === 'ol') {
      this.page.append(make(kind, '', ...lines.map((line) => make('li', '', ...inlineMarkdown(line)))));
    } else {
      this.page.append(make('p', '', ...inlineMarkdown(lines.join(' '))));
    }
  }
}

/** @param {string} source @returns {HTMLElement} */
function markdownPage(source) {
  const builder = new MarkdownBuilder();
  for (const line of source.slice(0, 200000).split(/\r?\n/)) builder.take(line);
  builder.close();
  return builder.page;
}
