// Speed of a big map. The figures are printed. Only a standstill fails.

import assert from 'node:assert/strict';
import { after, before, describe, test } from 'node:test';
import { atRest, findChromium, launch, open, store } from '../support/browser.mjs';
import { encodePlan } from '../support/encode-plan.mjs';
import { makePage } from '../support/page.mjs';
import { bigTown } from '../support/roads.mjs';
import { finding, place, resultOf } from '../support/samples.mjs';

const SIZES = process.env.QCBUS_BIG
  ? [
      [20000, 50],
      [95000, 19],
    ]
  : [[20000, 50]];

describe('a big map', { skip: findChromium() ? false : 'no Chromium' }, () => {
  let browser;
  before(async () => {
    browser = await launch();
  });
  after(() => browser?.close());

  /** Moves the map in every frame for a while and counts the frames. */
  const panned = (page, scale) =>
    page.evaluate(async (wanted) => {
      const canvas = document.querySelector('.map-canvas');
      const box = canvas.getBoundingClientRect();
      const fire = (type, x) =>
        canvas.dispatchEvent(
          new PointerEvent(type, {
            pointerId: 1,
            clientX: box.left + x,
            clientY: box.top + 300,
            bubbles: true,
          }),
        );
      canvas.setPointerCapture = () => {};
      if (wanted > 0)
        while (window.qcbus.view().scale < wanted)
          canvas.dispatchEvent(
            new WheelEvent('wheel', {
              deltaY: -300,
              clientX: box.left + 500,
              clientY: box.top + 400,
              cancelable: true,
            }),
          );
      await new Promise((resolve) => setTimeout(resolve, 400));
      fire('pointerdown', 300);
      const began = performance.now();
      const gaps = [];
      let last = began;
      for (let frame = 0; frame < 120 && performance.now() - began < 8000; frame++) {
        fire('pointermove', 300 + (frame < 60 ? frame : 120 - frame) * 12);
        await new Promise(requestAnimationFrame);
        gaps.push(performance.now() - last);
        last = performance.now();
      }
      fire('pointerup', 300);
      gaps.sort((a, b) => a - b);
      return {
        fps: (gaps.length * 1000) / (last - began),
        p95: gaps[Math.floor(gaps.length * 0.95)],
        longest: gaps[gaps.length - 1],
      };
    }, scale);

  for (const [lanes, points] of SIZES) {
    test(`${lanes} lanes`, { timeout: 300000 }, async () => {
      const findings = Array.from({ length: 10000 }, (_, i) =>
        finding(i, ['error', 'warning', 'information'][i % 3], i % 4, `finding ${i} of many`, [
          place({
            at: [(i % 100) * 60, Math.floor(i / 100) * 60],
            how: 'position',
            on: [{ road: i % 2000 }],
          }),
        ]),
      );
      const html = makePage('result', resultOf(findings), encodePlan(bigTown(lanes, points)));
      const { page, troubles, context } = await open(browser, store(`big-${lanes}.html`, html));
      await atRest(page);
      const stats = await page.evaluate(() => window.qcbus.stats());
      assert.ok(stats.lanes >= lanes);
      console.log(
        `    ${stats.lanes} lanes, ${stats.points} points, ${(html.length / 1e6).toFixed(1)} MB: decoded in ${stats.decodeMs.toFixed(0)} ms, on screen after ${stats.firstPaintMs.toFixed(0)} ms, whole map drawn in ${stats.tilePaintMs.toFixed(0)} ms`,
      );
      for (const scale of [0, 0.2, 0.8, 3, 15]) {
        const { fps, p95, longest } = await panned(page, scale);
        const paint = await page.evaluate(() => window.qcbus.stats().tilePaintMs);
        console.log(
          `    moved at ${scale === 0 ? 'the whole map' : `${scale} px/m`}: ${fps.toFixed(0)} frames/s, 95 % within ${p95.toFixed(0)} ms, longest ${longest.toFixed(0)} ms, a picture ${paint.toFixed(0)} ms`,
        );
        assert.ok(fps > 1, `${fps} frames per second`);
      }
      assert.deepEqual(troubles, []);
      await context.close();
    });
  }
});
