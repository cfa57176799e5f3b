// Pages with hostile, damaged or incomplete data.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { atRest, findChromium, launch, open, store } from '../support/browser.mjs';
import { encodePlan } from '../support/encode-plan.mjs';
import { makePage } from '../support/page.mjs';
import { smallTown, stacked } from '../support/roads.mjs';
import { finding, place, resultOf, runOf, townFindings } from '../support/samples.mjs';

const NASTY = '</script><script>alert(1)</script><img src=x onerror=alert(2)>"\'`\u202Eevil\u2066\u0000\uD800${1}';

describe('hostile pages', { skip: findChromium() ? false : 'no Chromium' }, () => {
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  const onPage = (name, html, run) =>
    test(name, async () => {
      const { page, troubles, context } = await open(
        browser,
        store(`hostile-${name.replace(/\W+/g, '-')}.html`, html()),
      );
      await run(page);
      assert.deepEqual(troubles, []);
      await context.close();
    });

  const nastyTown = () => {
    const town = smallTown();
    for (const road of town.roads) Object.assign(road, { id: NASTY + road.id, name: NASTY });
    town.junctions[0].id = NASTY;
    town.cuts = [NASTY];
    return town;
  };
  const nastyResult = () =>
    resultOf(
      [
        finding(
          1,
          'error',
          0,
          NASTY,
          [
            place({
              file: NASTY,
              xpath: NASTY,
              text: NASTY,
              at: [690050, 5330000],
              how: 'position',
              on: [{ road: 0 }],
              line: { text: NASTY, skipped: 3, more: true, mark: [2, 9999] },
            }),
          ],
          [[NASTY, NASTY]],
        ),
        finding(2, 'error', 1, NASTY, []),
      ],
      {
        file: { path: NASTY, verdict: NASTY },
        cuts: [NASTY],
        rules: [
          {
            uid: NASTY,
            about: NASTY,
            page: `# ${NASTY}\n\n[a](javascript:alert(3))\n\n- ${NASTY}\n\n\`\`\`\n${NASTY}`,
            link: 'javascript:alert(4)',
          },
          { uid: NASTY },
        ],
      },
    );

  onPage(
    'names',
    () => makePage('result', nastyResult(), encodePlan(nastyTown())),
    async (page) => {
      await page.locator('.finding-row').first().click();
      await atRest(page);
      await page.locator('.why summary').click();
      assert.equal(await page.locator('img').count(), 0);
      assert.equal(await page.locator('a').count(), 0);
      const text = await page.locator('.row-text').first().textContent();
      assert.ok(
        text.includes('<script>alert(1)</script>') && text.includes('‹U+202E›') && text.includes('‹U+0000›'),
        text,
      );
      await page.keyboard.press('t');
      await page.keyboard.press('t');
      await page.locator('.detail .spot .link, .detail .place .link').last().click();
      assert.equal(await page.locator('.road-panel').isVisible(), true);
    },
  );

  onPage(
    'numbers',
    () =>
      makePage(
        'result',
        resultOf([
          finding(1, 'error', 0, 'far', [
            place({ at: [1e300, -1e300], how: 'position', on: [{ road: 1e9, section: -4, lane: 0.5 }] }),
          ]),
          finding(2, 'error', 0, 'nulls', [
            place({
              at: [null, null],
              row: null,
              column: null,
              road: [null, null, null],
              line: { text: null, mark: [null, -1] },
              on: [null, 7, {}],
            }),
          ]),
          finding(3, 'nonsense', 99, null, null),
          finding(4, 'warning', 0, 'indices', [
            place({
              at: null,
              on: [{ road: 0, section: 0, lane: 77 }, { signal: 99 }, { object: -1 }, { junction: 1.5 }],
            }),
          ]),
          null,
        ]),
        encodePlan(smallTown()),
      ),
    async (page) => {
      for (const id of [1, 2, 3, 4]) {
        await page.evaluate((wanted) => window.qcbus.select(wanted), id);
        const view = await page.evaluate(() => window.qcbus.view());
        assert.ok(Object.values(view).every(Number.isFinite), JSON.stringify(view));
      }
      assert.equal(await page.locator('.finding-row').count(), 5);
      assert.equal(await page.getByText('not on map').count(), 4);
    },
  );

  onPage(
    '10,000 lanes and findings at one place',
    () =>
      makePage(
        'result',
        resultOf(
          Array.from({ length: 10000 }, (_, i) =>
            finding(i, i % 50 ? 'warning' : 'error', i % 4, `finding ${i}`, [
              place({ at: [10, 3], how: 'position', on: [{ road: i % 5000 }] }),
            ]),
          ),
        ),
        encodePlan(stacked(10000)),
      ),
    async (page) => {
      await atRest(page);
      const point = await page.evaluate(() => window.qcbus.screen(10, 3));
      await page.mouse.click(point.x, point.y);
      assert.match(await page.locator('.chooser').textContent(), /10,000 findings here/);
      await page.locator('.chooser-item').first().click();
      await atRest(page);
      assert.ok((await page.locator('.finding-row').count()) < 80);
      await page.keyboard.press('/');
      await page.keyboard.type('finding 9999');
      assert.equal(await page.locator('.finding-row').count(), 1);
    },
  );

  const damaged = [
    ['data that are not gzip', (html) => html.replace(/(id="data">)[^<]{40}/, '$1AAAA')],
    ['data that are not base64', (html) => html.replace(/(id="data">)/, '$1§§')],
    ['no data', (html) => html.replace('id="data"', 'id="other"')],
  ];
  for (const [name, damage] of damaged) {
    onPage(
      name,
      () => makePage('result', resultOf([]), undefined, damage),
      async (page) => {
        assert.match(await page.locator('[role=alert]').textContent(), /cannot be shown.*“data”/s);
      },
    );
  }
  onPage(
    'another schema',
    () => makePage('run', { schema: 2 }),
    async (page) => {
      assert.match(await page.locator('[role=alert]').textContent(), /unknown format/);
    },
  );

  const town = smallTown();
  const whole = encodePlan(town);
  const plans = [
    ['no plan', undefined, /no road network|missing/],
    ['half a plan', whole.subarray(0, whole.length / 2), /damaged/],
    ['not a plan', new Uint8Array(100), /damaged/],
  ];
  for (const [name, plan, sentence] of plans) {
    onPage(
      name,
      () => makePage('result', resultOf(townFindings(town.origin), plan ? {} : { map: null }), plan),
      async (page) => {
        assert.match(await page.locator('.no-map').textContent(), sentence);
        assert.equal(await page.locator('.finding-row').count(), 10);
        assert.equal(await page.locator('.findings-table tbody tr').count(), 10);
        await page.keyboard.press('j');
        assert.equal(await page.locator('.detail').count(), 1);
      },
    );
  }

  onPage(
    'damage to any byte of a plan',
    () => makePage('result', resultOf([]), whole),
    async (page) => {
      // The decoder is a plain function of the page's script. Any bytes give a plan or a BlockError.
      const other = await page.evaluate(
        (bytes) => {
          const problems = [];
          for (let round = 0; round < 400; round++) {
            const copy = Uint8Array.from(bytes);
            copy[(round * 7919) % copy.length] = (round * 31) % 256;
            const cut = copy.subarray(0, round % 3 === 0 ? (round * 97) % copy.length : copy.length);
            try {
              // eslint-disable-next-line no-undef
              indexPlan(decodePlan(cut));
            } catch (error) {
              if (!(error instanceof BlockError)) problems.push(String(error));
            }
          }
          return problems;
        },
        [...whole],
      );
      assert.deepEqual(other, []);
    },
  );

  onPage(
    'a run',
    () => {
      const run = runOf(6, 3);
      run.title = NASTY;
      run.files[0] = {
        path: NASTY,
        verdict: NASTY,
        page: 'javascript:alert(5)',
        error: 1e300,
        warning: null,
        information: -1,
        why: NASTY,
      };
      run.findings[0] = { file: 99, level: 7, rule: -3, text: NASTY, row: null, column: null, id: null };
      return makePage('run', run);
    },
    async (page) => {
      const links = await page.locator('a').evaluateAll((all) => all.map((link) => link.href));
      assert.ok(
        links.every((link) => link.startsWith('file:')),
        links.join(' '),
      );
      assert.equal(await page.locator('img').count(), 0);
    },
  );
});
