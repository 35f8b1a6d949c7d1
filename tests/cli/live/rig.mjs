// The program, as a laboratory would start it: a campaign that lacks OT, and its logger with a live page.
import {execFileSync, spawn} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

const program = process.argv[2];
const folder = mkdtempSync(join(tmpdir(), 'tunnelrig-live-'));
const servers = new Set();

/** Nothing is left behind, however the test ends. */
process.on('exit', () => {
  for (const server of servers) server.kill('SIGKILL');
  rmSync(folder, {recursive: true, force: true});
});

const run = (...words) =>
    execFileSync(program, words, {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']}).toString();

const row = (kind, location, repeat, duration_s) => `S1,${kind},${location},${repeat},${duration_s}`;
const plan = (name, rows) =>
    writeFileSync(join(folder, name), ['session,kind,location,repeat,duration_s', ...rows, ''].join('\n'));

/**
 * Seven locations of two runs each, calibrated. There is no map, which is the change against OT: the plan's
 * next run is there.
 */
export function makeCampaign() {
  const around = ['H2V0', 'H4V0', 'H0V2', 'H0V-2', 'H2V2', 'H2V-2', 'H4V2'];
  const done = [
    row('tare', 'OT', 1, 1), ...[1, 2].flatMap((repeat) => around.map((l) => row('thrust', l, repeat, 1)))
  ];
  plan('done.csv', done);
  plan('plan.csv', [...done, row('thrust', 'OT', 1, 5), row('thrust', 'H4V-2', 1, 30)]);
  run('log', '--db', 'campaign.db', '--plan', 'done.csv', '--speed', 'max', '--yes');
  run('calibrate', '--db', 'campaign.db');
}

/** Starts a server and waits for its address: {address, kill(signal)}. */
function serve(...words) {
  const child = spawn(program, words, {cwd: folder, stdio: ['ignore', 'pipe', 'pipe']});
  servers.add(child);
  let said = '';
  const address = new Promise((found, failed) => {
    for (const stream of [child.stdout, child.stderr])
      stream.on('data', (text) => {
        said += text;
        const line = said.match(/live page: (\S+)/);
        if (line) found(line[1]);
      });
    child.on('exit', (code) => failed(new Error(`the server ended (${code}) and said:\n${said}`)));
  });
  const gone = new Promise((ended) => child.on('exit', ended));
  const kill = (signal) => {
    child.kill(signal);
    return gone;
  };
  return address.then((at) => ({address: at, kill, said: () => said}));
}

/** A logger at a port, 0 for one that is free, with what else its command line says. */
export const startLogger = (port, ...more) => serve(
    'log', '--db', 'campaign.db', '--plan', 'plan.csv', '--duration', '2', '--source', 'virtual', '--live',
    String(port), ...more);

export const startReader = (port, ...more) =>
    serve('serve', '--db', 'campaign.db', '--port', String(port), ...more);
