// Opens report pages in headless Chromium, uses their controls, and says what is wrong. The first page is
// opened wide and light, narrow and dark, and where two plots just stand side by side; those behind it, which differ in their data, in turns.
//
//   node open_pages.mjs CHROMIUM PROFILE_FOLDER PAGE.html…
//
// A line for each thing that is wrong; exit code 1 if anything is. SCREENSHOTS=FOLDER leaves a picture of each
// view there.
//
// Speaks the DevTools protocol over a pipe: no port, no packages.
import {spawn} from 'node:child_process';
import {writeFileSync} from 'node:fs';
import {basename, join, resolve} from 'node:path';
import {pathToFileURL} from 'node:url';

const [chromium, profile, ...pages] = process.argv.slice(2);
const views = [{width: 1280, scheme: 'light'}, {width: 400, scheme: 'dark'}, {width: 1200, scheme: 'light'}];
const patience_ms = 60_000;

/** Chromium, and a way to call it: call(method, parameters, session) and listeners of events. */
function start() {
  const browser = spawn(
      chromium,
      [
        '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run',
        '--disable-background-networking', '--disable-component-update', '--disable-sync',
        `--user-data-dir=${profile}`, '--remote-debugging-pipe'
      ],
      {stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe']});
  const [, , , to, from] = browser.stdio;
  const waiting = new Map(), listeners = new Set();
  let number = 0, text = '';
  from.setEncoding('utf8');
  from.on('data', (piece) => {
    const messages = (text + piece).split('\0');
    text = messages.pop();
    for (const message of messages.map((m) => JSON.parse(m))) {
      if (message.id === undefined)
        for (const listen of listeners) listen(message);
      else
        waiting.get(message.id)(message);
    }
  });
  const call = (method, params = {}, sessionId = undefined) => new Promise((done, failed) => {
    waiting.set(
        ++number,
        (answer) =>
            (answer.error ? failed(new Error(`${method}: ${answer.error.message}`)) : done(answer.result)));
    to.write(`${JSON.stringify({id: number, method, params, sessionId})}\0`);
  });
  browser.on('error', (error) => {
    throw error;
  });
  return {call, listeners, close: () => call('Browser.close').catch(() => browser.kill())};
}

/** What the page said and asked for: complaints of the console, and every address. */
function record(complaints, requests) {
  return ({method, params}) => {
    if (method === 'Runtime.exceptionThrown')
      complaints.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Runtime.consoleAPICalled' && ['error', 'warning', 'assert', 'trace'].includes(params.type))
      complaints.push(`console: ${params.args.map((a) => a.value ?? a.description).join(' ')}`);
    if (method === 'Log.entryAdded' && params.entry.level === 'error')
      complaints.push(`log: ${params.entry.text}`);
    if (method === 'Network.requestWillBeSent') requests.push(params.request.url);
  };
}

/** The page's own account of itself, once all its plots are drawn; the last one where that takes too long. */
async function whenDrawn(evaluate) {
  const until = Date.now() + patience_ms;
  for (;;) {
    const status =
        JSON.parse((await evaluate('document.documentElement.dataset.report ?? \'null\'')) ?? 'null');
    if ((status && (status.drawn === status.plots || status.errors.length > 0)) || Date.now() > until)
      return status;
    await new Promise((later) => setTimeout(later, 50));
  }
}

async function look(browser, page, {width, scheme}) {
  const {targetId} = await browser.call('Target.createTarget', {url: 'about:blank'});
  const {sessionId} = await browser.call('Target.attachToTarget', {targetId, flatten: true});
  const call = (method, params) => browser.call(method, params, sessionId);
  const complaints = [], requests = [];
  const listen = record(complaints, requests);
  browser.listeners.add(listen);
  for (const domain of ['Page', 'Runtime', 'Network', 'Log']) await call(`${domain}.enable`);
  await call(
      'Emulation.setDeviceMetricsOverride', {width, height: 900, deviceScaleFactor: 1, mobile: width < 600});
  await call('Emulation.setEmulatedMedia', {features: [{name: 'prefers-color-scheme', value: scheme}]});
  const address = pathToFileURL(resolve(page)).href;
  await call('Page.navigate', {url: address});
  const evaluate = async (expression) =>
      (await call('Runtime.evaluate', {expression, returnByValue: true, awaitPromise: true})).result.value;
  const status = await whenDrawn(evaluate);
  if (!status)
    complaints.push('the page\'s scripts did not run');
  else if (status.errors.length > 0)
    complaints.push(...status.errors);
  else if (status.drawn !== status.plots)
    complaints.push(`${status.drawn} of ${status.plots} plots were drawn`);
  complaints.push(...JSON.parse(await evaluate(findings)));
  if (process.env.SCREENSHOTS) {
    const height = await evaluate('document.documentElement.scrollHeight');
    const {data} = await call(
        'Page.captureScreenshot', {captureBeyondViewport: true, clip: {x: 0, y: 0, width, height, scale: 1}});
    writeFileSync(
        join(process.env.SCREENSHOTS, `${basename(page, '.html')}-${width}-${scheme}.png`),
        Buffer.from(data, 'base64'));
  }
  await evaluate(exercise);
  complaints.push(
      ...((await whenDrawn(evaluate))?.errors ?? []).filter((error) => !complaints.includes(error)));
  complaints.push(...requests.filter((url) => url !== address && !/^(data|blob):/.test(url))
                      .map((url) => `asked for ${url}`));
  browser.listeners.delete(listen);
  await browser.call('Target.closeTarget', {targetId});
  return {plots: status?.plots ?? 0, complaints};
}

/** Run in the page: what is too wide, what is empty, and plots without a drawing. */
const findings = `{
const flights = JSON.parse(document.getElementById("data").textContent).sections?.flights?.flights ?? [];
JSON.stringify([
  ...(document.documentElement.scrollWidth > innerWidth ? ["wider than the window: " + document.documentElement.scrollWidth + " pixels"] : []),
  ...[...document.querySelectorAll("section")].filter((s) => s.children.length < 2).map((s) => "section " + s.id + " is empty"),
  ...[...document.querySelectorAll(".plot")].filter((p) => !p.querySelector(".main-svg .trace, .main-svg .hm, .main-svg .points path"))
    .map((p) => "nothing is drawn in: " + p.getAttribute("aria-label")),
  ...flights.filter((f) => f.position !== "given" && !document.body.innerText.includes("position: from LIDAR scans"))
    .map((f) => "the page does not say that the position of " + f.scenario + " is by " + f.position),
  ...flights.filter((f) => f.extrapolated && !document.body.innerText.includes("Extrapolated, in normalised coordinates: " + f.extrapolated))
    .map((f) => "the page does not say that " + f.scenario + " is extrapolated"),
  ...flights.filter((f) => f.best && f.controllers.length > 1 && !document.body.innerText.includes("more than " + f.best + ", 95 %"))
    .map((f) => "the page does not compare the controllers of " + f.scenario + " run by run"),
  ...[...document.querySelectorAll(".plot .yaxislayer-above, .plot .xaxislayer-above")].flatMap((axis) => {
    const numbers = [...axis.querySelectorAll(".ytick text, .xtick text")].map((t) => t.textContent).filter((t) => /^[−+]?[0-9.]+$/.test(t));
    return new Set(numbers).size < numbers.length ? ["an axis has the same number twice: " + numbers.join(" ")] : [];
  }),
  ...[...document.querySelectorAll(".plot")].filter((p) => {
    const room = p.getBoundingClientRect();
    return [...p.querySelectorAll(".infolayer .colorbar text")].map((t) => t.getBoundingClientRect())
      .some((t) => t.left < room.left - 1 || t.right > room.right + 1 || t.top < room.top - 1 || t.bottom > room.bottom + 1);
  }).map((p) => "the colour bar is cut off in: " + p.getAttribute("aria-label")),
  ...(/undefined|NaN|\\[object/.test(document.body.innerText) ? ["a value that is none stands in the text"] : []),
])}`;

/** Run in the page: every control once, and a print. */
const exercise = `
  document.querySelectorAll("input[type=radio], input[type=checkbox]").forEach((input) => input.click());
  document.querySelectorAll("details").forEach((details) => { details.open = true; });
  for (const type of ["beforeprint", "afterprint"]) dispatchEvent(new Event(type));
  new Promise((later) => setTimeout(later, 200))`;

const browser = start();
let wrong = 0;
for (const [k, page] of pages.entries()) {
  for (const view of k === 0 ? views : [views[k % views.length]]) {
    const {plots, complaints} = await look(browser, page, view);
    console.log(`${basename(page)} at ${view.width} pixels, ${view.scheme}: ${plots} plots, ${
        complaints.length === 0 ? 'well' : 'not well'}`);
    for (const complaint of complaints) console.log(`  ${complaint}`);
    wrong += complaints.length;
  }
}
await browser.close();
process.exit(wrong > 0 ? 1 : 0);
