// The live page in a real browser, over a logger that records the virtual rig.
//
//   node browser_test.mjs PROGRAM FOLDER_OF_NODE_MODULES      exit code 77: there is no Chromium, so nothing
//   was tried SCREENSHOTS=FOLDER node browser_test.mjs …                also leaves pictures there
import assert from 'node:assert/strict';
import {execSync} from 'node:child_process';

import {makeCampaign, startLogger, startReader} from './rig.mjs';
import {account, chromium, inspect, open, patience_ms, picture, until} from './watched_page.mjs';

/** Where Debian's Chromium is; ends the test where it is not. */
function browserProgram() {
  try {
    return execSync('command -v chromium', {encoding: 'utf8'}).trim();
  } catch {
    console.log('chromium is not installed, so the live page was not opened: skipped');
    process.exit(77);
  }
}

const began = Date.now();
const steps = [];
const step = (name, act) => steps.push({name, act});

const text = (page, selector) => page.locator(selector).first().innerText();
const location = (page, label) => page.locator(`.location[data-label="${label}"]`);
const health = (page, label) => page.locator('dl.health div', {hasText: label}).locator('dd').innerText();

/**
 * Waits until a text holds what it should. Asked from here: the page's policy forbids the evaluation within
 * it.
 */
async function becomes(what, read, pattern) {
  const end = Date.now() + patience_ms;
  for (;;) {
    const now = await read();
    if (pattern.test(now)) return;
    assert.ok(Date.now() < end, `waited in vain for ${pattern} in ${what}, which reads: ${now}`);
    await new Promise((later) => setTimeout(later, 50));
  }
}
const reads = (page, selector, pattern) => becomes(selector, () => text(page, selector), pattern);
const stands = (page, label, pattern) =>
    becomes(label, () => location(page, label).getAttribute('aria-label'), pattern);

const set = {
  browser: null,
  logger: null,
  port: 0,
  opened: null
};
const page = () => set.opened.page;

step('a campaign without OT has no map, and the page says why', async () => {
  makeCampaign();
  set.logger = await startLogger(0);
  set.port = Number(new URL(set.logger.address).port);
  set.opened = await open(set.browser, set.logger.address);
  await until(page(), 'a connection, and the campaign', ({connected, runs}) => connected && runs === 15);
  await reads(page(), '#maps', /No maps yet: .*OT/);
  await reads(page(), '#run', /bring the rig to OT/);
  assert.match(await location(page(), 'OT').getAttribute('aria-label'), /next, 0 of 1 run/);
  assert.match(await text(page(), '#facts'), /simulated/);
});

step('conditions that are typed in are the last values of every page', async () => {
  const other = await open(set.browser, set.logger.address);
  const temperature = page().getByLabel('Air temperature');
  await temperature.fill('91');
  await page().getByRole('button', {name: 'Use from the next run on'}).click();
  assert.equal(await temperature.evaluate((input) => input.validity.rangeOverflow), true);
  await temperature.fill('21.5');
  await page().getByRole('button', {name: 'Use from the next run on'}).click();
  await reads(other.page, '#metadata', /last: 21.5/);
  await other.page.context().close();
});

step('Next records, and the traces move', async () => {
  await page().keyboard.press('n');
  await until(page(), 'a run', ({phase}) => phase === 'recording');
  const {events: first} = await until(page(), 'frames', ({events}) => events.frames > 5);
  const [from_ms, before] = [Date.now(), await picture(page(), '#traces canvas')];
  await page().waitForTimeout(1500);
  const {events: then, drawn} = await account(page());
  const rate = (then.frames - first.frames) / ((Date.now() - from_ms) / 1000);
  const after = await picture(page(), '#traces canvas');
  assert.notEqual(after.sum, before.sum, 'the trace of rotor 1 stands still');
  // How many a second is this computer's matter as much as the page's: `./rig bench live` measures it.
  console.log(`      ${rate.toFixed(1)} updates a second came`);
  assert.ok(then.frames > first.frames + 5, `${then.frames - first.frames} updates came`);
  assert.ok(drawn > 5, `${drawn} were drawn`);
});

step('means grow certain against the target; the spectrum names its lines', async () => {
  await reads(page(), '#means', /C\s*T\s+0\.1\d+ ± 0\.0/);
  for (const [target, verdict] of [
           ['0.1', /known well enough/], ['0.0000001', /not yet: .*times the target/]]) {
    await page().getByLabel(/Target .* of C/).fill(target);
    await page().getByRole('button', {name: 'Set', exact: true}).click();
    await reads(page(), '.verdict', verdict);
  }
  await reads(page(), '#spectrum', /shaft: \d+\.\d Hz/);
  await reads(page(), '#spectrum', /blade pass ×5: 8\d\d\.\d Hz, seen at \d+\.\d Hz \(alias, dashed\)/);
  await reads(page(), '#spectrum', /mains: 50.0 Hz/);
  assert.ok((await picture(page(), '#spectrum canvas.waterfall')).colours > 5, 'the waterfall is empty');
  assert.ok(Number((await health(page(), 'Frames stored')).replaceAll(',', '')) > 1000);
});

step('a note is kept with the run that is under way', async () => {
  await page().keyboard.press('m');
  await page().getByLabel('Note', {exact: true}).fill('the door was open');
  await page().keyboard.press('Enter');
  await reads(page(), '#runs', /“the door was open”/);
});

step('the run ends, its location is done, and the maps appear', async () => {
  await stands(page(), 'OT', /: done, 1 of 1 run/);
  await until(page(), 'two maps', ({maps}) => maps === 2);
  for (const map of await page().locator('canvas.field').all())
    assert.match(await map.getAttribute('aria-label'), /from .* to .* %/);
  assert.ok((await picture(page(), 'canvas.field')).colours > 50, 'the map has no colours');
  await location(page(), 'OT').click();
  await reads(page(), '#runs', /OT: 2 runs.*ΔC/s);
  await page().keyboard.press('ArrowRight');
  await reads(page(), '#runs', /^Runs\s+H\dV/);
  await page().getByRole('button', {name: 'Show all locations'}).click();
});

step('a run is excluded with a reason, stays, and is included again', async () => {
  await page().getByRole('button', {name: 'Exclude R0003'}).click();
  await page().getByLabel('Reason').fill('loose propeller');
  await page().keyboard.press('Enter');
  await reads(page(), '#runs', /excluded loose propeller/);
  assert.match(await location(page(), 'H4V0').getAttribute('aria-label'), /1 of 2 runs/);
  await page().getByRole('button', {name: 'Include R0003'}).click();
  await stands(page(), 'H4V0', /2 of 2 runs/);
});

step('a run is recorded anew, and the old one left out', async () => {
  await page().getByRole('button', {name: 'Redo R0002'}).click();
  await page().getByRole('button', {name: 'Record anew'}).click();
  await reads(page(), '#runs', /R0002[^]*excluded redone as R0017/);
  await stands(page(), 'H2V0', /done, 2 of 2 runs/);
});

step('a tare is asked for once more, recorded, and its age told', async () => {
  assert.match(await health(page(), 'Last tare'), /none|ago/);
  await until(page(), 'the end of the run', ({phase}) => phase === 'waiting');  // its location is done before
  await page().keyboard.press('t');
  await page().getByRole('button', {name: 'Record tare'}).click();
  await reads(page(), '#runs', /R0018\s+\S+\s+S1\s+tare/);
  await reads(page(), 'dl.health', /Last tare\s+\d\.\d s ago/);
});

step('the page looks right and axe-core finds nothing, in four views', () => inspect(page(), 'waiting'));

step('the server is killed in the middle of a run; the page says since when, and recovers', async () => {
  await page().keyboard.press('n');
  await until(page(), 'a run', ({phase, run}) => phase === 'recording' && run === 'R0019');
  await reads(page(), '#said', /R0019 is being recorded/);  // may come late, and would hide what follows
  await set.logger.kill('SIGKILL');
  await reads(page(), '#connection', /Disconnected since \d\d:\d\d:\d\d/);
  await page().keyboard.press('x');
  await reads(page(), '#said', /no connection/);
  await inspect(page(), 'disconnected', [{width: 1280, scheme: 'light'}]);
  set.logger = await startLogger(set.port, '--faults', 'drop=0.05');
  await until(page(), 'the connection', ({connected, phase}) => connected && phase === 'waiting');
  await reads(page(), '#runs', /R0019[^]*partial/);
});

step('after that the commands hold again, and losses are seen and heard', async () => {
  await page().keyboard.press('n');
  await until(page(), 'a run', ({phase, run}) => phase === 'recording' && run === 'R0020');
  await until(page(), 'an alarm, and a beep', ({alarms, beeps}) => alarms > 0 && beeps > 0);
  await reads(page(), '#alarms', /frames lost/);
  assert.match(await page().title(), /^⚠/);
  await page().getByRole('button', {name: 'Sound is on'}).click();
  await reads(page(), '#sound', /Sound is off/);
  await inspect(page(), 'recording', [{width: 1280, scheme: 'light'}, {width: 400, scheme: 'dark'}]);
  await page().getByRole('button', {name: /^Stop/}).click();
  await until(page(), 'the end', ({phase}) => phase !== 'recording');
  await reads(page(), '#runs', /⚠ loss/);
});

step('nothing was complained of and nothing asked of others', async () => {
  assert.deepEqual((await account(page())).errors, []);
  assert.deepEqual(set.opened.complaints, []);
  const origin = new URL(set.logger.address).origin;
  assert.deepEqual(
      set.opened.requests.filter((url) => !url.startsWith(origin) && !url.startsWith('data:')), []);
  await set.logger.kill('SIGINT');
});

step('the page over a file shows it and cannot change it', async () => {
  const reader = await startReader(0);
  const {page: read, complaints} = await open(set.browser, reader.address);
  await until(read, 'the campaign', ({runs, maps}) => runs === 20 && maps === 2);
  assert.match(await text(read, '#facts'), /read-only/);
  assert.equal(await read.locator('#buttons').isVisible(), false);
  assert.equal(await read.getByRole('button', {name: /Exclude/}).count(), 0);
  await reads(read, '#run', /last run was R0020: H4V-2/);
  await inspect(read, 'file', [{width: 1280, scheme: 'dark'}]);
  assert.deepEqual(complaints, []);
  const old =
      await open(set.browser, reader.address, (p) => p.addInitScript(() => delete window.EventSource));
  assert.match(await text(old.page, '#unsupported'), /server-sent events/);
  await reader.kill('SIGINT');
});

step('from elsewhere the address holds a token; a restart changes it, and the page says so', async () => {
  let reader = await startReader(0, '--listen', '0.0.0.0');
  const given = new URL(reader.address);
  given.hostname = '127.0.0.1';  // this computer's name may lead nowhere here
  const {page: far} = await open(set.browser, given.href);
  await until(far, 'the campaign', ({connected, runs}) => connected && runs === 20);
  assert.equal((await fetch(given.origin)).status, 403);
  await reader.kill('SIGKILL');
  reader = await startReader(Number(given.port), '--listen', '0.0.0.0');
  await reads(far, '#connection', /Refused: .*another token/);
  await reader.kill('SIGINT');
});

set.browser = await chromium.launch(
    {executablePath: browserProgram(), args: ['--no-sandbox', '--disable-gpu', '--disable-quic']});
let failed = false;
for (const {name, act} of steps) {
  try {
    await act();
    console.log(`${((Date.now() - began) / 1000).toFixed(1)} s  ${name}`);
  } catch (error) {
    failed = true;
    console.log(`FAILED  ${name}\n${error.stack}\nthe server said:\n${set.logger?.said()}`);
    if (process.env.SCREENSHOTS && set.opened)
      await page().screenshot({path: `${process.env.SCREENSHOTS}/live-failed.png`, fullPage: true});
    break;  // each goes on where the one before left off
  }
}
await set.browser.close();
process.exit(failed ? 1 : 0);
