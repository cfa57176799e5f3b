// The page of a result in a browser.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { atRest, findChromium, launch, open, store } from '../support/browser.mjs';
import { encodePlan } from '../support/encode-plan.mjs';
import { makePage } from '../support/page.mjs';
import { smallTown } from '../support/roads.mjs';
import { resultOf, townFindings } from '../support/samples.mjs';

describe('the page of a result', { skip: findChromium() ? false : 'no Chromium' }, () => {
  const town = smallTown();
  const findings = townFindings(town.origin);
  const path = store('town.html', makePage('result', resultOf(findings), encodePlan(town)));
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  /** Runs a test on a fresh page, which must have no error and no request. */
  const onPage = (name, run, options) =>
    test(name, async () => {
      const { page, troubles, context } = await open(browser, path, options);
      await atRest(page);
      await run(page);
      assert.deepEqual(troubles, []);
      await context.close();
    });
  const view = (page) => page.evaluate(() => window.qcbus.view());
  const near = (actual, expected, tolerance = 0.05) =>
    assert.ok(Math.abs(actual - expected) <= tolerance, `${actual} is not ${expected}`);
  const row = (page, id) => page.locator(`.finding-row[data-finding="${id}"]`);
  const selected = (page) => page.locator('.finding-row[aria-expanded="true"]').getAttribute('data-finding');
  /** Checks whether the canvas contains the colour of highlights. */
  const isHighlighted = (page) =>
    page.evaluate(() => {
      const canvas = document.querySelector('.map-canvas');
      const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
      for (let i = 0; i < data.length; i += 4)
        if (data[i] < 12 && Math.abs(data[i + 1] - 80) < 12 && Math.abs(data[i + 2] - 216) < 12) return true;
      return false;
    });

  onPage('the head shows verdict, reason and checkers', async (page) => {
    assert.equal(await page.locator('.head .verdict').textContent(), 'rejected');
    assert.match(await page.locator('.reason').textContent(), /4 errors/);
    assert.match(await page.locator('.checkers summary').textContent(), /4 checkers, 2 without an answer/);
    const stats = await page.evaluate(() => window.qcbus.stats());
    assert.equal(stats.findings, findings.length);
    assert.equal(
      stats.lanes,
      town.roads.flatMap((road) => road.sections).reduce((sum, { left, right }) => sum + left.length + right.length, 0),
    );
  });

  onPage('a click on a finding moves the map to its place', async (page) => {
    assert.equal(await isHighlighted(page), false);
    await row(page, 1).click();
    await atRest(page);
    const now = await view(page);
    const [x, y] = findings[0].places[0].at;
    near(now.x, x);
    near(now.y, y);
    const canvas = await page.locator('.map-canvas').boundingBox();
    const high = canvas.height / now.scale;
    assert.ok(high > 40 && high < 80, `${high} m are visible`);
    assert.equal(await isHighlighted(page), true);
    assert.equal(await page.locator('.detail mark').textContent(), '<lane id="-2" '.trim().padEnd(14));
    assert.match(await page.locator('.detail .facts').textContent(), /sOffset3\.5/);
    assert.equal(
      await page.locator('.detail a.outward').getAttribute('href'),
      'https://publications.pages.asam.net/standards/',
    );
    assert.match(await page.locator('.markdown').textContent(), /the specification \(https:/);
    assert.equal(await page.locator('.markdown a').count(), 0);
  });

  onPage(
    'with motion the flight ends at the same place',
    async (page) => {
      await row(page, 3).click();
      await atRest(page);
      const now = await view(page);
      near(now.x, findings[2].places[0].at[0]);
      near(now.y, findings[2].places[0].at[1]);
    },
    { reducedMotion: 'no-preference' },
  );

  onPage('a click on a further place moves the map', async (page) => {
    await row(page, 2).click();
    await page.locator('.detail .place-head .link').nth(1).click();
    await atRest(page);
    near((await view(page)).x, findings[1].places[1].at[0]);
  });

  onPage('a click on a mark selects its finding', async (page) => {
    const [x, y] = findings[6].places[0].at;
    const point = await page.evaluate(([px, py]) => window.qcbus.screen(px, py), [x, y]);
    await page.mouse.click(point.x, point.y);
    assert.equal(await selected(page), '7');
    await atRest(page);
    near((await view(page)).x, x);
  });

  onPage('a click on several findings at one place opens a chooser', async (page) => {
    await page.evaluate(() => window.qcbus.select(8));
    await atRest(page);
    await page.keyboard.press('Escape');
    const [x, y] = findings[7].places[0].at;
    const point = await page.evaluate(([px, py]) => window.qcbus.screen(px, py), [x, y]);
    await page.mouse.click(point.x, point.y);
    assert.equal(await page.locator('.chooser-item').count(), 2);
    await page.locator('.chooser-item').nth(1).click();
    assert.equal(await selected(page), '9');
    assert.equal(await page.locator('.chooser').isVisible(), false);
  });

  onPage('a click on a road shows its profile', async (page) => {
    const point = await page.evaluate(
      ([x, y]) => window.qcbus.screen(x, y),
      [town.origin[0] + 100, town.origin[1] + 1.5],
    );
    await page.mouse.move(point.x, point.y);
    assert.match(await page.locator('.readout').textContent(), /road 1 {3}lane 1 {3}s 8\d\.\d\d/);
    await page.mouse.click(point.x, point.y);
    await page.locator('.road-panel').waitFor();
    assert.match(await page.locator('.road-panel h2').textContent(), /Road 1 East Street/);
    assert.equal(await page.locator('.plot').count(), 2);
    // The clicked point stays visible beside the panel.
    const after = await page.evaluate(
      ([x, y]) => window.qcbus.screen(x, y),
      [town.origin[0] + 100, town.origin[1] + 1.5],
    );
    near(after.y, point.y, 0.5);
    assert.ok(after.x <= point.x && after.x < (await page.locator('.road-panel').boundingBox()).x);
    await page
      .locator('.plot')
      .first()
      .hover({ position: { x: 170, y: 40 } });
    assert.match(await page.locator('.plot-value').first().textContent(), /^s 6\d\.\d/);
    await page.locator('.road-panel .link', { hasText: 'road 20' }).click();
    await atRest(page);
    assert.match(await page.locator('.road-panel h2').textContent(), /River Road/);
    // The target is in the middle of the part that is not hidden by the panel.
    await page.evaluate(() => window.qcbus.select(8));
    await atRest(page);
    const target = await page.evaluate(([x, y]) => window.qcbus.screen(x, y), findings[7].places[0].at);
    const canvas = await page.locator('.map-canvas').boundingBox();
    const panel = await page.locator('.road-panel').boundingBox();
    near(target.x, (canvas.x + panel.x) / 2, 8);
    await page.keyboard.press('Escape');
    assert.equal(await page.locator('.road-panel').isVisible(), false);
  });

  onPage('a double click zooms and selects nothing', async (page) => {
    const spot = [town.origin[0] + 60, town.origin[1] + 1.5];
    const point = await page.evaluate(([x, y]) => window.qcbus.screen(x, y), spot);
    const before = await view(page);
    await page.mouse.dblclick(point.x, point.y);
    await atRest(page);
    near((await view(page)).scale, before.scale * 2, 0.01);
    near((await page.evaluate(([x, y]) => window.qcbus.screen(x, y), spot)).x, point.x, 0.5);
    assert.equal(await page.locator('.road-panel').isVisible(), false);
  });

  onPage('keys', async (page) => {
    await page.keyboard.press('j');
    assert.equal(await selected(page), '1');
    await page.keyboard.press('ArrowDown');
    assert.equal(await selected(page), '2');
    await page.keyboard.press('k');
    assert.equal(await selected(page), '1');
    await page.keyboard.press('f');
    await atRest(page);
    const whole = await view(page);
    await page.keyboard.press('+');
    near((await view(page)).scale, whole.scale * 1.5, 0.01);
    await page.keyboard.press('-');
    near((await view(page)).scale, whole.scale, 0.01);
    await page.keyboard.press('Shift+ArrowLeft');
    assert.ok((await view(page)).x < whole.x);
    await page.keyboard.press('Enter');
    await atRest(page);
    near((await view(page)).x, findings[0].places[0].at[0]);
    await page.keyboard.press('Escape');
    assert.equal(await page.locator('.finding-row[aria-expanded="true"]').count(), 0);
    await page.keyboard.press('?');
    assert.equal(await page.locator('dialog.help').isVisible(), true);
    await page.keyboard.press('Escape');
    assert.equal(await page.locator('dialog.help').isVisible(), false);
    await page.keyboard.press('/');
    await page.keyboard.type('junction');
    assert.match(await page.locator('.shown-count').first().textContent(), /1 of 10/);
    await page.keyboard.press('Escape');
    await page.keyboard.press('Escape');
    assert.match(await page.locator('.shown-count').first().textContent(), /^10 findings/);
  });

  onPage('filters', async (page) => {
    const rows = page.locator('.finding-row');
    await page.getByLabel('warnings').uncheck();
    assert.equal(await rows.count(), 6);
    await page.locator('select.facet').selectOption({ label: 'road.geometry.no_gap (3)' });
    assert.equal(await rows.count(), 3);
    await page.locator('.clear, .filters .link').click();
    assert.equal(await rows.count(), 10);
    await page.getByText('only without a place on the map').click();
    assert.equal(await rows.count(), 1);
    assert.match(await rows.first().textContent(), /not on map/);
  });

  onPage('wheel and drag', async (page) => {
    const point = await page.evaluate(
      ([x, y]) => window.qcbus.screen(x, y),
      [town.origin[0] + 50, town.origin[1] + 20],
    );
    await page.mouse.move(point.x, point.y);
    await page.mouse.wheel(0, -400);
    await atRest(page);
    const stays = await page.evaluate(
      ([x, y]) => window.qcbus.screen(x, y),
      [town.origin[0] + 50, town.origin[1] + 20],
    );
    near(stays.x, point.x, 1);
    near(stays.y, point.y, 1);
    await page.mouse.down();
    await page.mouse.move(point.x + 60, point.y + 40, { steps: 4 });
    await page.mouse.up();
    const moved = await page.evaluate(
      ([x, y]) => window.qcbus.screen(x, y),
      [town.origin[0] + 50, town.origin[1] + 20],
    );
    near(moved.x, point.x + 60, 1);
    near(moved.y, point.y + 40, 1);
    assert.equal(await page.locator('.road-panel').isVisible(), false);
  });

  onPage('the table has every finding', async (page) => {
    await page.keyboard.press('t');
    assert.equal(await page.locator('.findings-table tbody tr').count(), 10);
    await page.getByLabel('errors').uncheck();
    assert.equal(await page.locator('.findings-table tbody tr').count(), 6);
    await page.locator('.link.cell').first().click();
    assert.equal(await page.locator('.findings-table tr.selected').count(), 1);
    await page.keyboard.press('t');
    assert.equal(await page.locator('.map').isVisible(), true);
  });

  onPage('copied cells are text in a spreadsheet', async (page) => {
    // eslint-disable-next-line no-undef
    const copied = await page.evaluate(() =>
      tabSeparated([
        ['=HYPERLINK("x")', '-1.5', '-x', 'a\tb\nc'],
        ['@a', '+b', 'c', ''],
      ]),
    );
    assert.equal(copied, "'=HYPERLINK(\"x\")\t-1.5\t'-x\ta b c\n'@a\t'+b\tc\t");
    await page.keyboard.press('t');
    await page.getByText('Copy as table').click();
    await page.getByText('10 rows copied').waitFor();
  });

  onPage(
    'dark and light',
    async (page) => {
      const corner = () =>
        page.evaluate(() => [
          ...document.querySelector('.map-canvas').getContext('2d').getImageData(4, 300, 1, 1).data.slice(0, 3),
        ]);
      const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
      assert.ok((await corner())[0] < 60);
      assert.equal(await ground(), 'rgb(26, 29, 33)');
      await page.keyboard.press('d');
      await atRest(page);
      assert.ok((await corner())[0] > 200);
      assert.equal(await ground(), 'rgb(255, 255, 255)');
    },
    { colorScheme: 'dark' },
  );

  onPage('printed: all findings as a table, the map as it is', async (page) => {
    await page.getByLabel('warnings').uncheck();
    await page.emulateMedia({ media: 'print' });
    await page.locator('.printed').waitFor();
    assert.equal(await page.locator('.printed tbody tr').count(), 6);
    assert.equal(await page.locator('.side').isVisible(), false);
    assert.equal(await page.locator('.map-canvas').isVisible(), true);
    await page.emulateMedia({ media: 'screen' });
    await page.locator('.printed').waitFor({ state: 'detached' });
    assert.equal(String((await page.pdf()).subarray(0, 5)), '%PDF-');
    assert.equal(await page.locator('.printed').count(), 0);
  });

  test('an address leads to a finding', async () => {
    const { page, troubles, context } = await open(browser, path, { hash: '#finding=5' });
    await atRest(page);
    assert.equal(await selected(page), '5');
    near((await view(page)).x, findings[4].places[0].at[0]);
    assert.deepEqual(troubles, []);
    await context.close();
  });
});
