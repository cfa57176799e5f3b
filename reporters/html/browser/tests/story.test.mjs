// The timeline of a scenario and its entities on the map.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { atRest, findChromium, launch, open, store } from '../support/browser.mjs';
import { encodePlan } from '../support/encode-plan.mjs';
import { makePage } from '../support/page.mjs';
import { smallTown } from '../support/roads.mjs';
import { finding, place, resultOf } from '../support/samples.mjs';
import { element, hugeStory, townStory } from '../support/story.mjs';

const NASTY = '</script><script>alert(1)</script><img src=x onerror=alert(2)>\u202Eevil\u0000\uD800';

describe('the timeline of a scenario', { skip: findChromium() ? false : 'no Chromium' }, () => {
  const town = smallTown();
  const plan = encodePlan(town);
  const map = { path: 'maps/town.xodr', own: false, cuts: [] };
  const findings = [
    finding(1, 'error', 0, 'The event brakes too late.', [place({ row: 105, column: 3 })]),
    finding(2, 'warning', 1, 'The storyboard is long.', [place({ row: 99, column: 3 })]),
  ];
  const scenario = (story = townStory(town.origin), more = {}) => resultOf(findings, { map, story, ...more });
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  /** Runs a test on a fresh page, which must have no error and no request. */
  const onPage = (name, html, run, options) =>
    test(name, async () => {
      const path = store(`story-${name.replace(/\W+/g, '-')}.html`, html());
      const { page, troubles, context } = await open(browser, path, options);
      await atRest(page);
      await run(page);
      assert.deepEqual(troubles, []);
      await context.close();
    });
  const whole = () => makePage('result', scenario(), plan);
  const row = (page, name) => page.locator('.tl-row').filter({ has: page.getByText(name, { exact: true }) });
  const state = (page) => page.evaluate(() => window.qcbus.story());
  /** Left and right end of a bar in seconds. */
  const seconds = async (page, bar) => {
    const [from, to] = (await state(page)).range;
    const track = await page.locator('.tl-track').first().boundingBox();
    const box = await bar.boundingBox();
    const at = (px) => from + ((px - track.x) / track.width) * (to - from);
    return [at(box.x), at(box.x + box.width)];
  };
  const near = (actual, expected, tolerance) =>
    assert.ok(Math.abs(actual - expected) <= tolerance, `${actual} is not ${expected}`);

  onPage('rows have the bars of their times', whole, async (page) => {
    assert.equal(await page.locator('.tl-row').count(), 15);
    const [from, to] = await seconds(page, row(page, 'brake').locator('.tl-bar.solid'));
    near(from, 3, 0.2);
    near(to, 7, 0.2);
    const later = row(page, 'later');
    assert.equal(await later.locator('.tl-bar.maybe').count(), 2);
    near((await seconds(page, later.locator('.tl-bar.maybe').last()))[1], 20, 0.3);
    near((await seconds(page, row(page, 'perhaps').locator('.tl-bar.maybe')))[0], 4, 0.2);
    assert.equal(await row(page, 'unknown').locator('.tl-bar.unknown').count(), 1);
    near((await seconds(page, row(page, 'endless').locator('.tl-bar.solid')))[1], 30, 0.3);
    near((await seconds(page, page.locator('.tl-grid .tl-end')))[0], 30, 0.3);
    const ticks = await page.locator('.tl-tick:not(.end)').allTextContents();
    assert.deepEqual(ticks.slice(0, 4), ['0', '5', '10', '15']);
  });

  onPage('an element that never starts is struck out with its reason', whole, async (page) => {
    const blocked = row(page, 'blocked');
    assert.match(await blocked.getAttribute('class'), /never/);
    assert.equal(await blocked.locator('.tl-bar').count(), 0);
    assert.equal(await blocked.locator('.tl-why').textContent(), 'never starts: the rising edge is over');
    const line = await blocked.locator('.tl-name').evaluate((name) => getComputedStyle(name).textDecorationLine);
    assert.equal(line, 'line-through');
    assert.equal(await page.locator('.tl-alarm').textContent(), '1 element never starts');
  });

  /** Returns the colour of the canvas at a point of the map in metres. */
  const colorAt = (page, x, y) =>
    page.evaluate(
      ([mx, my]) => {
        const canvas = document.querySelector('.map-canvas');
        const { left, top } = canvas.getBoundingClientRect();
        const point = window.qcbus.screen(mx, my);
        const ratio = canvas.width / canvas.clientWidth;
        const { data } = canvas.getContext('2d').getImageData((point.x - left) * ratio, (point.y - top) * ratio, 1, 1);
        return [...data.slice(0, 3)];
      },
      [x, y],
    );

  onPage('entities are drawn at their places, in their direction', whole, async (page) => {
    const [x, y] = town.origin;
    assert.deepEqual(await colorAt(page, x + 19, y - 1.75), [0x00, 0x85, 0x7c]);
    // The lorry faces north, so its box is 12 m long in this direction.
    assert.deepEqual(await colorAt(page, x + 60, y - 1.75 - 4), [0x7b, 0x4f, 0xc9]);
    assert.notDeepEqual(await colorAt(page, x + 60 - 4, y - 1.75), [0x7b, 0x4f, 0xc9]);
    assert.deepEqual((await state(page)).labels.sort(), [0, 1]);
    assert.match(await page.locator('.scene-legend').textContent(), /place unknown: 1 entity/);
    const view = await page.evaluate(() => window.qcbus.view());
    assert.ok(view.scale > 2, `the first view shows the scenario, not the whole town: ${view.scale}`);
  });

  onPage('a chosen entity is emphasized in both views', whole, async (page) => {
    const [x, y] = town.origin;
    const point = await page.evaluate((at) => window.qcbus.screen(...at), [x + 60, y - 1.75]);
    await page.mouse.click(point.x, point.y);
    let now = await state(page);
    assert.deepEqual(now.selected, { kind: 'entity', index: 1 });
    assert.deepEqual([now.emphasized, now.courses], [[1], [1]]);
    assert.match(await row(page, 'lorry').getAttribute('class'), /chosen/);
    assert.match(await row(page, 'of ego').getAttribute('class'), /dim/);
    assert.doesNotMatch(await row(page, 'of lorry').getAttribute('class'), /dim/);
    await row(page, 'ego').click();
    now = await state(page);
    assert.deepEqual([now.selected, now.emphasized, now.courses], [{ kind: 'entity', index: 0 }, [0], [0]]);
    await page.keyboard.press('Escape');
    assert.equal((await state(page)).selected, null);
  });

  onPage('a chosen element shows its line, its text and its findings', whole, async (page) => {
    await row(page, 'slow').click();
    const now = await state(page);
    assert.deepEqual([now.emphasized, now.courses], [[0], [0]]);
    const facts = page.locator('.tl-facts');
    assert.match(await facts.textContent(), /action slow starts at 3 s.*town\.xodr:104:5.*brakes too late/s);
    await facts.locator('.tl-finding').click();
    assert.equal(await page.locator('.finding-row[aria-expanded="true"]').getAttribute('data-finding'), '1');
  });

  onPage('a chosen finding shows its element', whole, async (page) => {
    await page.locator('.finding-row[data-finding="1"]').click();
    assert.deepEqual((await state(page)).selected, { kind: 'element', index: 4 });
    assert.equal(await row(page, 'slow').locator('.tl-badge.error').count(), 1);
    assert.equal(await page.locator('.tl-badge').count(), 1);
  });

  onPage('the tree works by keyboard and tells its structure', whole, async (page) => {
    const tree = page.getByRole('tree');
    await tree.focus();
    const active = async () => {
      const id = await tree.getAttribute('aria-activedescendant');
      return page.locator(`#${id}`);
    };
    await page.keyboard.press('End');
    assert.match(await (await active()).getAttribute('aria-label'), /endless/);
    await page.keyboard.press('Home');
    await page.keyboard.press('ArrowLeft');
    assert.equal((await state(page)).rows, 12);
    assert.equal(await (await active()).getAttribute('aria-expanded'), 'false');
    await page.keyboard.press('ArrowDown');
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('Enter');
    assert.deepEqual((await state(page)).selected, { kind: 'element', index: 1 });
    assert.equal(await (await active()).getAttribute('aria-level'), '2');
    assert.equal(await (await active()).getAttribute('aria-selected'), 'true');
    // The keys of the tree do not move the list of findings.
    assert.equal(await page.locator('.finding-row[aria-expanded="true"]').count(), 0);
    await page.getByRole('button', { name: 'Collapse' }).click();
    assert.equal(await row(page, 'brake').count(), 0);
    await page.getByRole('button', { name: 'Expand' }).click();
    assert.equal((await state(page)).rows, 15);
  });

  onPage('the time axis is zoomed and shown whole again', whole, async (page) => {
    await page.getByRole('button', { name: 'Shorter time' }).click();
    const [, shorter] = (await state(page)).range;
    near(shorter, 31.9 / 1.5, 0.2);
    await page.getByRole('button', { name: 'Whole run' }).click();
    near((await state(page)).range[1], 31.9, 0.1);
  });

  onPage(
    'a scenario without a map has places in the world',
    () => makePage('result', scenario(undefined, { map: null })),
    async (page) => {
      const [x, y] = town.origin;
      assert.match(await page.locator('.no-map').textContent(), /no readable map/);
      assert.deepEqual(await colorAt(page, x + 19, y - 1.75), [0x00, 0x85, 0x7c]);
      assert.equal(await page.locator('.tl-row').count(), 15);
    },
  );

  onPage(
    'unknown times are said',
    () => {
      const story = townStory(town.origin);
      Object.assign(story, { timed: false, gaps: [{ text: 'the maneuver `x` is not found', file: null, row: 7 }] });
      return makePage('result', scenario(story), plan);
    },
    async (page) => {
      assert.equal(await page.locator('.tl-track .tl-bar').count(), 0);
      await page.locator('.tl-notes summary', { hasText: 'Times unknown' }).click();
      assert.match(await page.locator('.tl-notes').textContent(), /maneuver x is not found.*:7/s);
    },
  );

  onPage(
    'a map has no timeline',
    () => makePage('result', resultOf(findings), plan),
    async (page) => {
      assert.equal(await page.locator('.timeline, .splitter').count(), 0);
    },
  );

  onPage(
    'hostile values do no harm',
    () => {
      const story = townStory(town.origin);
      story.entities[0] = { name: NASTY, kind: NASTY, category: NASTY, size: [1e308, -1], center: 'x', at: [1e308, -1e308, null], text: NASTY };
      story.entities.push(null, 7, { at: [null, 1, 2] });
      story.elements[3] = element(NASTY, NASTY, 99, [1e308, null], ['x', {}], { actors: [-1, 1e9, 'a'], head: NASTY, text: NASTY });
      story.elements[4].parent = 4;
      story.elements[5].parent = 3;
      story.elements.push(null, 'x', {});
      story.courses.push({ kind: NASTY, points: [1e308, 2, 'x'], stops: null, element: -4, entities: [0, 99] }, null);
      story.run = { end: [-1e308, 1e308], text: NASTY };
      story.globals = [NASTY, null];
      story.cuts = [NASTY];
      return makePage('result', scenario(story), plan);
    },
    async (page) => {
      assert.equal(await page.locator('[role=alert]').count(), 0);
      assert.equal(await page.locator('img').count(), 0);
      assert.ok((await page.locator('.tl-row').count()) > 10);
      await page.locator('.tl-row').nth(1).click();
      await page.locator('.tl-row').nth(9).click();
      const view = await page.evaluate(() => window.qcbus.view());
      assert.ok(Object.values(view).every(Number.isFinite), JSON.stringify(view));
      assert.match(await page.locator('.timeline').textContent(), /<script>alert\(1\)<\/script>.*‹U\+202E›/s);
    },
  );

  for (const story of [7, 'x', [], {}]) {
    onPage(
      `a story that is ${JSON.stringify(story)}`,
      () => makePage('result', scenario(story), plan),
      async (page) => {
        assert.equal(await page.locator('[role=alert]').count(), 0);
      },
    );
  }

  onPage(
    '10,000 events are shown with few elements',
    () => makePage('result', scenario(hugeStory(town.origin, 10000)), plan),
    async (page) => {
      assert.ok((await page.locator('.tl-row').count()) < 80);
      await page.getByRole('button', { name: 'Expand' }).click();
      assert.equal((await state(page)).rows, 10000 + 200 + 2 + 4);
      await page.getByRole('tree').focus();
      await page.keyboard.press('End');
      assert.ok((await page.locator('.tl-row').count()) < 80);
      assert.equal(await row(page, 'event 9999').count(), 1);
    },
  );

  onPage(
    'a narrow page has the timeline below the map',
    whole,
    async (page) => {
      const [stage, timeline] = await Promise.all([
        page.locator('.stage').boundingBox(),
        page.locator('.timeline').boundingBox(),
      ]);
      assert.ok(timeline.y >= stage.y + stage.height - 1, 'below');
      assert.ok(timeline.height > 200 && stage.height > 200);
    },
    { viewport: { width: 420, height: 900 } },
  );

  onPage(
    'a wide page has the timeline beside the map',
    whole,
    async (page) => {
      const [stage, timeline] = await Promise.all([
        page.locator('.stage').boundingBox(),
        page.locator('.timeline').boundingBox(),
      ]);
      assert.ok(timeline.x >= stage.x + stage.width - 1, 'beside');
      const splitter = page.getByRole('separator');
      await splitter.focus();
      await page.keyboard.press('ArrowLeft');
      const wider = await page.locator('.timeline').boundingBox();
      assert.ok(wider.width > timeline.width + 20, `${wider.width} after ${timeline.width}`);
    },
    { viewport: { width: 1920, height: 1000 } },
  );
});
