// Reading, typing and printing on pages: names, focus, invisible items, large amounts of data.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { atRest, findChromium, launch, open, store } from '../support/browser.mjs';
import { encodePlan } from '../support/encode-plan.mjs';
import { makePage } from '../support/page.mjs';
import { smallTown } from '../support/roads.mjs';
import { finding, place, resultOf, runOf, townFindings } from '../support/samples.mjs';

describe('reading a page', { skip: findChromium() ? false : 'no Chromium' }, () => {
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  const onPage = (name, html, run, options) =>
    test(name, async () => {
      const path = store(`reading-${name.replace(/\W+/g, '-')}.html`, html());
      const { page, troubles, context } = await open(browser, path, options);
      await run(page);
      assert.deepEqual(troubles, []);
      await context.close();
    });
  const town = smallTown();
  const townPage = (findings = townFindings(town.origin), plan = town, more = {}) =>
    makePage('result', resultOf(findings, more), encodePlan(plan));
  const focused = (page) => page.evaluate(() => document.activeElement?.getAttribute('data-finding') ?? null);

  onPage(
    'Escape clears the search',
    () => townPage(),
    async (page) => {
      await page.keyboard.press('/');
      await page.keyboard.type('junction');
      assert.equal(await page.locator('.finding-row').count(), 1);
      await page.keyboard.press('Escape');
      assert.equal(await page.getByLabel('Search in findings').inputValue(), '');
      assert.equal(await page.locator('.finding-row').count(), 10);
    },
  );

  onPage(
    'Escape clears both searches of a run',
    () => makePage('run', runOf(40, 6)),
    async (page) => {
      const all = await page.evaluate(() => window.qcbus.shown());
      for (const label of ['Search in findings', 'Search files']) {
        await page.getByLabel(label).fill('network-4');
        assert.notDeepEqual(await page.evaluate(() => window.qcbus.shown()), all);
        await page.getByLabel(label).press('Escape');
        assert.equal(await page.getByLabel(label).inputValue(), '');
        assert.deepEqual(await page.evaluate(() => window.qcbus.shown()), all);
      }
    },
  );

  const strayTown = () => {
    const plan = smallTown();
    plan.signals.push({ ...plan.signals[0], id: 'stray', x: 60000, y: -40000 });
    return plan;
  };
  onPage(
    'the view shows the roads and names items far outside',
    () =>
      townPage(
        [
          finding(1, 'error', 0, 'far', [
            place({ at: [town.origin[0] + 60000, town.origin[1] - 40000], how: 'position', on: [] }),
          ]),
        ],
        strayTown(),
      ),
    async (page) => {
      await atRest(page);
      const view = () => page.evaluate(() => window.qcbus.view());
      const first = await view();
      assert.ok(first.scale > 0.5, `${first.scale} pixels per metre`);
      assert.match(await page.locator('.map-notes .far').textContent(), /^1 signal lies far outside the view/);
      const [scale, note] = [
        await page.locator('.scale-bar').boundingBox(),
        await page.locator('.map-notes').boundingBox(),
      ];
      assert.ok(note.y >= scale.y + scale.height, 'the sentence is below the scale');
      await page.locator('.finding-row').click();
      await atRest(page);
      assert.ok(Math.abs((await view()).x - town.origin[0] - 60000) < 0.05);
      await page.getByText('Show everything').click();
      await atRest(page);
      assert.ok((await view()).scale < 0.05);
      await page.getByText('Fit', { exact: true }).click();
      await atRest(page);
      assert.deepEqual(await view(), first);
    },
  );

  onPage(
    'items near the roads are not reported as far',
    () => townPage(),
    async (page) => {
      assert.equal(await page.locator('.map-notes').isVisible(), false);
    },
  );

  const deep = `${'a-long-directory/'.repeat(20)}catalog-of-vehicles.xosc`;
  onPage(
    'places in the checked file have no path, and long paths lose their beginning',
    () =>
      townPage([
        finding(1, 'error', 0, 'here', [place({ row: 12, column: 3 })]),
        finding(2, 'error', 0, 'there', [place({ file: deep, row: 7, column: 9 })]),
        finding(3, 'error', 0, 'whole', [place({ row: null, column: null })]),
        finding(4, 'error', 0, 'nowhere', []),
      ]),
    async (page) => {
      const shown = await page.locator('.finding-row .where').allTextContents();
      assert.deepEqual(shown, [':12:3', `${deep}:7:9`, 'this file', 'no place']);
      const other = page.locator('.finding-row .where').nth(1);
      const inside = await other.evaluate((element) => {
        const box = element.getBoundingClientRect();
        const [directory, name] = [...element.querySelectorAll('bdi')].map((part) => part.getBoundingClientRect());
        return { left: box.left, right: box.right, directory: directory.left, nameLeft: name.left, name: name.right };
      });
      assert.ok(inside.directory < inside.left, 'the beginning is cut');
      assert.ok(inside.nameLeft >= inside.left && inside.name <= inside.right + 1, 'name and row are visible');
      await page.locator('.finding-row').first().click();
      assert.equal(await page.locator('.place-head .where').getAttribute('title'), 'maps/town.xodr:12:3');
    },
  );

  for (const key of ['Enter', 'Space']) {
    onPage(
      `the focus stays on the row after ${key}`,
      () => townPage(),
      async (page) => {
        const row = page.locator('.finding-row').nth(2);
        const id = await row.getAttribute('data-finding');
        await row.focus();
        await page.keyboard.press(key);
        assert.equal(await row.getAttribute('aria-expanded'), 'true');
        assert.equal(await focused(page), id);
        await page.keyboard.press('Escape');
        assert.equal(await row.getAttribute('aria-expanded'), 'false');
        assert.equal(await focused(page), id);
      },
    );
  }

  onPage(
    'the focus stays on the row of a run and after filters are cleared',
    () => makePage('run', runOf(12, 6)),
    async (page) => {
      await page.getByLabel('warnings', { exact: true }).uncheck();
      const row = page.locator('.finding-row').nth(1);
      const id = await row.getAttribute('data-finding');
      await row.focus();
      for (const expanded of ['true', 'false']) {
        await page.keyboard.press('Space');
        assert.equal(await row.getAttribute('aria-expanded'), expanded);
        assert.equal(await focused(page), id);
      }
      await page.keyboard.press('Escape');
      assert.equal(await focused(page), id);
    },
  );

  onPage(
    'data that were left out are named once',
    () => {
      const plan = smallTown();
      plan.cuts = ['a signal has no place', 'road 5 has no line'];
      const cuts = ['a signal has no place', 'a signal has no place', 'road 5 has no line'];
      return townPage([], plan, { map: { path: 'maps/town.xodr', own: true, cuts } });
    },
    async (page) => {
      assert.equal(await page.locator('.cuts summary').textContent(), 'Left out of the map (2)');
      assert.deepEqual(await page.locator('.cuts li').allTextContents(), [
        'a signal has no place (2 times)',
        'road 5 has no line',
      ]);
    },
  );

  const brokenTown = () => {
    const plan = smallTown();
    Object.assign(plan.roads[2], { flags: 2, line: [], stations: [], elevation: [], sections: [] });
    return plan;
  };
  onPage(
    'a place on a road that cannot be drawn has a note',
    () =>
      townPage(
        [
          finding(1, 'error', 0, 'broken', [
            place({ at: [town.origin[0] - 300, town.origin[1]], how: 'element', on: [{ road: 2 }] }),
          ]),
          finding(2, 'error', 0, 'whole', [place({ at: town.origin, how: 'element', on: [{ road: 0 }] })]),
          finding(3, 'error', 0, 'by its id', [place({ road: ['3', 5, 0] })]),
        ],
        brokenTown(),
      ),
    async (page) => {
      const expected = [1, 0, 1];
      for (const [index, count] of expected.entries()) {
        await page.evaluate((id) => window.qcbus.select(id), index + 1);
        assert.equal(await page.locator('.place .undrawable').count(), count);
        assert.equal(await page.locator('.map-said').textContent(), count ? 'this road cannot be drawn' : '');
      }
      await page.keyboard.press('Escape');
      assert.equal(await page.locator('.map-notes').isVisible(), false);
    },
  );

  onPage(
    'names are broken at dots and underscores only',
    () => {
      const facts = [
        ['qcbus.rule', 'asam.net:xodr:1.4.0:road.lane.width.defined_for_full_length '.repeat(2)],
        ['a_very.long_name.of_a_fact.that_needs.two_lines', 'x'],
        ['x'.repeat(200), 'y'.repeat(300)],
      ];
      const checkers = ['completed', 'skipped'].map((status, index) => ({
        id: `check_asam_xodr_road_lane_${index}_${'level_true_one_side_'.repeat(3)}`,
        status,
        summary: 'It has checked each of the lanes of all of the roads in this file. '.repeat(4),
        findings: 12345,
      }));
      return townPage([finding(1, 'error', 0, 'facts', [place({})], facts)], town, { checkers });
    },
    async (page) => {
      await page.locator('.finding-row').click();
      await page.locator('.checkers summary').click();
      /** Returns the lines of text of each element that matches. */
      const linesOf = (selector) =>
        page.locator(selector).evaluateAll((elements) =>
          elements.map((element) => {
            const lines = [];
            let last = null;
            const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
            for (let node = walker.nextNode(); node; node = walker.nextNode())
              for (let i = 0; i < node.length; i++) {
                const range = document.createRange();
                range.setStart(node, i);
                range.setEnd(node, i + 1);
                const { top } = range.getBoundingClientRect();
                if (last === null || Math.abs(top - last) > 4) lines.push('');
                last = top;
                lines[lines.length - 1] += node.data[i];
              }
            return lines;
          }),
        );
      const [short, long, huge] = await linesOf('.facts dt');
      assert.deepEqual(short, ['qcbus.rule']);
      for (const line of long.slice(0, -1)) assert.match(line, /[._]$/);
      assert.ok(huge.length > 1 && huge.length < 12, `${huge.length} lines`);
      for (const lines of await linesOf('.checkers td.status')) assert.equal(lines.length, 1);
      for (const lines of await linesOf('.checkers td.name'))
        for (const line of lines.slice(0, -1)) assert.match(line, /[._]$/);
      const [facts, detail, text] = await Promise.all(
        ['.facts', '.detail', '.facts dd >> nth=0'].map((selector) => page.locator(selector).boundingBox()),
      );
      assert.ok(facts.x + facts.width <= detail.x + detail.width, 'it fits');
      assert.ok(text.width > facts.width * 0.3, `${text.width} of ${facts.width} are left for the text`);
    },
  );

  onPage(
    'print has at most 2,000 findings and counts the others',
    () => townPage(Array.from({ length: 15000 }, (_, i) => finding(i, 'error', 0, `finding ${i}`, [place({})]))),
    async (page) => {
      await page.emulateMedia({ media: 'print' });
      await page.locator('.printed').waitFor();
      assert.equal(await page.locator('.printed tbody tr').count(), 2000);
      assert.equal(await page.locator('.printed h2').textContent(), '2,000 of 15,000 findings');
      assert.match(await page.locator('.printed .left-out').textContent(), /^13,000 findings are not printed/);
    },
  );

  const texts = [
    'road `5` and lane `-1`.',
    'road `a`b` and lane `-1`',
    'roads `a`b`, `c`d` and lane `-1`',
    "road ` and lane `-1`, don't",
    '`5`s lanes and `6`',
    'no end `of code',
  ];
  const codes = [['5', '-1'], ['a`b', '-1'], ['a`b', 'c`d', '-1'], ['-1'], ['6'], []];
  onPage(
    'backticks are code everywhere, and backticks in ids do not swap code and text',
    () => townPage(texts.map((text, index) => finding(index, 'error', 0, text, [place({ text })]))),
    async (page) => {
      const codesIn = (selector) =>
        page
          .locator(selector)
          .evaluateAll((all) => all.map((one) => [...one.querySelectorAll('code')].map((code) => code.textContent)));
      assert.deepEqual(await codesIn('.row-text'), codes);
      await page.locator('.finding-row').nth(2).click();
      assert.deepEqual(await codesIn('.place-text'), [codes[2]]);
      await page.keyboard.press('t');
      assert.deepEqual(await codesIn('.table-pane tbody td:nth-child(2)'), codes);
      await page.emulateMedia({ media: 'print' });
      await page.locator('.printed').waitFor();
      assert.deepEqual(await codesIn('.printed tbody td:nth-child(2)'), codes);
      const row = await page.locator('.printed tbody td:nth-child(2)').nth(5).textContent();
      assert.equal(row, 'no end `of code');
      // Text of opening backticks only must not block the page.
      // eslint-disable-next-line no-undef
      const took = await page.evaluate(() => {
        const began = performance.now();
        for (const text of [' `a'.repeat(6000), 'a`'.repeat(9000), ' `'.repeat(9000)]) withCode(text);
        return performance.now() - began;
      });
      assert.ok(took < 2000, `${took} ms`);
    },
  );
});
