// The page of a run in a browser.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { findChromium, launch, open, store } from '../support/browser.mjs';
import { makePage } from '../support/page.mjs';
import { runOf } from '../support/samples.mjs';

describe('the page of a run', { skip: findChromium() ? false : 'no Chromium' }, () => {
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  test('filters, sorts and leads to pages', async () => {
    const { page, troubles, context } = await open(browser, store('run.html', makePage('run', runOf(300, 12))));
    const shown = () => page.evaluate(() => window.qcbus.shown());
    assert.deepEqual(await shown(), { files: 300, findings: 1800 });
    assert.equal(await page.locator('.verdict-count[data-verdict=rejected] b').textContent(), '75');
    await page.locator('.verdict-count[data-verdict=rejected]').click();
    assert.deepEqual(await shown(), { files: 75, findings: 900 });
    await page.locator('.verdict-count[data-verdict=rejected]').click();
    await page.locator('.mend-row').first().click();
    const byRule = (await shown()).findings;
    assert.ok(byRule > 0 && byRule < 1800);
    await page.locator('.filters .link').click();
    await page.getByLabel('Search files').fill('district-3');
    assert.equal((await shown()).files, 25);
    await page.getByLabel('Search files').fill('');
    await page.locator('.file-head button[data-column=path]').click();
    assert.match(await page.locator('span.cell-path').first().textContent(), /district-0\/road-network-0\.xodr/);
    assert.match(await page.locator('.cell-path a').first().getAttribute('href'), /^\.\/pages\/0%20a\.html$/);
    await page.locator('.only').first().click();
    assert.equal((await shown()).findings, 12);
    await page.keyboard.press('j');
    assert.match(await page.locator('.detail a').first().getAttribute('href'), /#finding=0$/);
    assert.deepEqual(troubles, []);
    await context.close();
  });

  test('10,000 files and 60,000 findings', async () => {
    const { page, troubles, context } = await open(browser, store('run-big.html', makePage('run', runOf(10000, 12))));
    assert.deepEqual(await page.evaluate(() => window.qcbus.shown()), { files: 10000, findings: 60000 });
    assert.ok((await page.locator('.file-row').count()) < 100);
    await page.locator('.files .virtual-list').evaluate((list) => list.scrollTo(0, 150000));
    await page.waitForFunction(() =>
      [...document.querySelectorAll('.files li')].some((item) => Number(item.getAttribute('aria-posinset')) > 5000),
    );
    const took = await page.evaluate(() => {
      const box = document.querySelector('.side input[type=search]');
      const began = performance.now();
      box.value = 'network-77';
      box.dispatchEvent(new Event('input'));
      return performance.now() - began;
    });
    console.log(`    a search in 60,000 findings: ${took.toFixed(0)} ms`);
    assert.deepEqual(troubles, []);
    await context.close();
  });
});
