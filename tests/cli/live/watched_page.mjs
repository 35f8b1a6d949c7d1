// A page in Debian's Chromium, with what it complains of, what it asks for, and what axe-core finds in it.
import assert from 'node:assert/strict';
import {readFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {join} from 'node:path';

const packages = createRequire(join(process.argv[3], 'packages.js'));
export const {chromium} = packages('playwright-core');
const axe = readFileSync(packages.resolve('axe-core/axe.min.js'), 'utf8');

export const patience_ms = 60_000;  // other tests may have the processor

/** Opens an address: {page, complaints, requests}. */
export async function open(browser, address, prepare = async () => {}) {
  const context = await browser.newContext({viewport: {width: 1280, height: 900}, colorScheme: 'light'});
  const page = await context.newPage();
  page.setDefaultTimeout(patience_ms);
  const complaints = [], requests = [];
  page.on('pageerror', (error) => complaints.push(error.stack));
  page.on('console', (message) => {
    if (!['error', 'warning'].includes(message.type())) return;
    // the browser's own word on a server that is not there, and on pictures that this test reads
    if (!/net::ERR_|willReadFrequently/.test(message.text())) complaints.push(`console: ${message.text()}`);
  });
  page.on('request', (request) => requests.push(request.url()));
  await prepare(page);
  await page.goto(address);
  return {page, complaints, requests};
}

/** The page's account of itself. */
export const account = (page) =>
    page.evaluate(() => JSON.parse(document.documentElement.dataset.live ?? '{}'));

/** Waits until the account fulfils something; `what` tells a person. */
export async function until(page, what, fulfils) {
  const end = Date.now() + patience_ms;
  for (;;) {
    const now = await account(page);
    if (fulfils(now)) return now;
    assert.ok(Date.now() < end, `waited in vain: ${what}; the page's account: ${JSON.stringify(now)}`);
    await page.waitForTimeout(50);
  }
}

/** What a canvas shows, as its colours: how many there are, and a sum that changes with the picture. */
export const picture = (page, selector) => page.locator(selector).first().evaluate((canvas) => {
  const {data} = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
  const pixels = new Uint32Array(data.buffer);
  let sum = 0;
  for (const pixel of pixels) sum = (Math.imul(sum, 31) + pixel) | 0;
  return {sum, colours: new Set(pixels).size};
});

const everyView = [1280, 400].flatMap((width) => ['light', 'dark'].map((scheme) => ({width, scheme})));

/** One violation a line. */
async function violations(page) {
  await page.evaluate(axe);
  const {violations: found} =
      await page.evaluate(() => window.axe.run({resultTypes: ['violations'], preload: false}));
  return found.map(
      ({id, help, nodes}) => `${id}: ${help}: ${nodes.map((n) => n.html.slice(0, 120)).join(' | ')}`);
}

/**
 * Wide and narrow, light and dark: nothing sticks out, axe-core finds nothing; a picture of each where
 * SCREENSHOTS says so.
 */
export async function inspect(page, name, views = everyView) {
  for (const {width, scheme} of views) {
    await page.setViewportSize({width, height: 900});
    await page.emulateMedia({colorScheme: scheme});
    await page.waitForTimeout(300);  // the plots follow the width a moment later
    const view = `${name}, ${width} pixels, ${scheme}`;
    const [needed, given] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(needed <= given, `${view}: the page is ${needed} pixels wide`);
    assert.deepEqual(await violations(page), [], view);
    assert.doesNotMatch(await page.innerText('body'), /undefined|NaN|\[object|Infinity/, view);
    if (process.env.SCREENSHOTS)
      await page.screenshot(
          {path: join(process.env.SCREENSHOTS, `live-${name}-${width}-${scheme}.png`), fullPage: true});
  }
  await page.setViewportSize({width: 1280, height: 900});
  await page.emulateMedia({colorScheme: 'light'});
}
