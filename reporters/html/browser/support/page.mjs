// Builds a page like the reporter: markup, style, script with their digests, blocks of data.

import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { gzipSync } from 'node:zlib';

const ASSETS = new URL('../../assets/', import.meta.url);

/** Reads the order of the files from the comment at the top of shared.js, its only definition. */
function scriptsOf(kind) {
  const text = readFileSync(new URL('shared.js', ASSETS), 'utf8');
  const comment = text.slice(0, text.indexOf('\n\n'));
  const lines = comment.split('\n').map((line) => line.replace(/^\/\/\s?/, '').trim());
  const start = lines.findIndex((line) => line.startsWith(`${kind} `));
  const names = [];
  for (let i = start; i < lines.length && lines[i] !== '' && (i === start || !/^(result|run) /.test(lines[i])); i++) {
    names.push(...lines[i].split(/\s+/).filter((word) => word.endsWith('.js')));
  }
  return names;
}

const digest = (text) => `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
const block = (id, bytes) =>
  `<script type="application/octet-stream" id="${id}">${gzipSync(bytes).toString('base64')}</script>`;

/** @param {'result'|'run'} kind @param {object} data @param {Uint8Array} [plan] @param {(html: string) => string} [damage] */
export function makePage(kind, data, plan, damage = (html) => html) {
  const script = scriptsOf(kind)
    .map((name) => readFileSync(new URL(name, ASSETS), 'utf8'))
    .join('\n');
  const style = readFileSync(new URL('style.css', ASSETS), 'utf8');
  const policy = `default-src 'none'; script-src ${digest(script)}; style-src ${digest(style)}`;
  const blocks = [block('data', JSON.stringify(data)), plan ? block('plan', plan) : ''].join('\n');
  return damage(`<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta http-equiv="Content-Security-Policy" content="${policy}">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>report</title><style>${style}</style></head>
<body><main id="app"></main><noscript>This report needs JavaScript.</noscript>
${blocks}
<script>${script}</script></body></html>`);
}
