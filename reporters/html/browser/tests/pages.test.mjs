// Pages written by the reporter in the directory QCBUS_PAGES.

import assert from 'node:assert/strict';
import { existsSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { atRest, findChromium, launch, open } from '../support/browser.mjs';

const directory = process.env.QCBUS_PAGES;
const files = directory
  ? readdirSync(directory, { recursive: true })
      .map(String)
      .filter((name) => name.endsWith('.html'))
      .sort()
  : [];

describe(
  'pages of the reporter',
  { skip: !directory ? 'QCBUS_PAGES is not set' : findChromium() ? false : 'no Chromium' },
  () => {
    let browser;
    before(async () => {
      assert.notEqual(files.length, 0, `no page in ${directory}`);
      browser = await launch();
    });
    after(() => browser?.close());

    /** Returns the data block of a page, decoded independently by the test. */
    const dataOf = (page) =>
      page.evaluate(async () => {
        const packed = Uint8Array.from(atob(document.getElementById('data').textContent.trim()), (character) =>
          character.charCodeAt(0),
        );
        return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'))).json();
      });

    for (const name of files) {
      test(name, async () => {
        const { page, troubles, context } = await open(browser, resolve(join(directory, name)));
        assert.equal(await page.locator('[role=alert]').count(), 0);
        const data = await dataOf(page);
        if (data.findings.length > 0) assert.ok((await page.locator('.finding-row').count()) > 0);
        const hasMap = data.file !== undefined && (await page.evaluate(() => window.qcbus.view())) !== null;
        // A scenario without a readable map has its places in the world.
        const hasPlaces = data.story?.entities.some(({ at }) => at) || data.story?.courses.some(({ points, stops }) => points.length + stops.length > 0);
        assert.equal(hasMap, Boolean(data.map) || Boolean(hasPlaces), 'a map is shown if the data have one');
        assert.equal(await page.locator('.timeline').count(), data.story ? 1 : 0);
        for (const finding of hasMap ? data.findings : []) {
          const at = finding.places.map((place) => place.at ?? null).find((point) => point !== null);
          if (!at) continue;
          const first = finding.places.find((place) => place.at || place.on?.length);
          await page.evaluate((id) => window.qcbus.select(id), finding.id);
          const view = await page.evaluate(() => window.qcbus.view());
          assert.ok(Number.isFinite(view.x + view.y) && view.scale > 0);
          if (first?.at !== at) continue;
          assert.ok(
            Math.hypot(view.x - at[0], view.y - at[1]) < 0.05,
            `finding ${finding.id}: ${JSON.stringify(view)} is not ${at}`,
          );
        }
        for (const file of data.file === undefined ? data.files : []) {
          // eslint-disable-next-line no-undef
          const address = await page.evaluate(
            (to) => (to === '' ? '' : new URL(pageAddress(to), location.href).href),
            file.page,
          );
          assert.ok(address === '' || existsSync(fileURLToPath(address)), `${address} is a page`);
        }
        assert.deepEqual(troubles, []);
        await context.close();
      });
    }
  },
);
