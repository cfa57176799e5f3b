// A headless browser, and pages that record every error and every request.

import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { delimiter, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

export const OUT = fileURLToPath(new URL('../out/', import.meta.url));

const NAMES = ['chromium-headless-shell', 'chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable'];

/** Returns the path of the browser to use, or null if none is found. */
export function findChromium() {
  const given = process.env.QCBUS_CHROMIUM;
  if (given) return existsSync(given) ? given : null;
  const directories = ['/usr/bin', ...(process.env.PATH ?? '').split(delimiter)];
  return (
    NAMES.flatMap((name) => directories.map((directory) => join(directory, name))).find((path) => existsSync(path)) ??
    null
  );
}

export async function launch() {
  const args = process.getuid?.() === 0 ? ['--no-sandbox'] : [];
  return chromium.launch({ executablePath: findChromium() ?? undefined, args });
}

/** Writes a page into the output directory. */
export function store(name, html) {
  mkdirSync(OUT, { recursive: true });
  const path = join(OUT, name);
  writeFileSync(path, html);
  return path;
}

/** Opens a file. `troubles` collects errors, warnings, requests and dialogs. */
export async function open(browser, path, options = {}) {
  const context = await browser.newContext({
    viewport: { width: 1440, height: 900 },
    reducedMotion: 'reduce',
    ...options,
  });
  const page = await context.newPage();
  const troubles = [];
  const own = pathToFileURL(path).href;
  page.on('console', (message) => {
    // The tests themselves read the canvas, so this warning is not about the page.
    if (message.text().includes('willReadFrequently')) return;
    if (message.type() === 'error' || message.type() === 'warning') troubles.push(`console: ${message.text()}`);
  });
  page.on('pageerror', (error) => troubles.push(`error: ${error.stack}`));
  page.on('request', (request) => {
    if (request.url().split('#')[0] !== own) troubles.push(`request: ${request.url()}`);
  });
  page.on('dialog', (dialog) => {
    troubles.push(`dialog: ${dialog.message()}`);
    void dialog.dismiss();
  });
  await page.goto(own + (options.hash ?? ''));
  await page.evaluate(() => window.qcbus.ready);
  return { page, troubles, context };
}

/** Waits until the map is completely drawn. */
export async function atRest(page) {
  await page.evaluate(() => window.qcbus.settled());
  await page.waitForFunction(() => !window.qcbus.stats().busy);
}
