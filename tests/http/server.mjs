// A real kilnd on a free port with a data folder of its own.

import {spawn} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

/** `--data FOLDER` among the flags: a folder that an earlier server left. */
export async function startServer(...flags) {
  const given = flags.indexOf('--data');
  const data = given < 0 ? mkdtempSync(join(tmpdir(), 'kiln-http-test-')) : flags.splice(given, 2)[1];
  const child = spawn(process.env.KILND, ['--data', data, '--port', '0', '--quiet', ...flags], {stdio: ['ignore', 'ignore', 'pipe']});
  let log = '';
  const url = await new Promise((resolve, reject) => {
    child.stderr.on('data', (text) => {
      log += text;
      const found = log.match(/listening on (http:\S+)/);
      if (found) resolve(found[1]);
    });
    child.on('exit', (code) => reject(new Error(`kilnd ended with ${code}: ${log}`)));
  });
  const exited = new Promise((resolve) => child.on('exit', (code) => resolve(code)));
  return {
    url, data, child, exited, log: () => log,
    async stop({keep = false} = {}) {
      child.kill('SIGTERM');
      const code = await exited;
      if (!keep) rmSync(data, {recursive: true, force: true});
      return code;
    },
  };
}

/** Waits until the job is terminal. */
export async function finished(url, id, seconds = 120) {
  const end = Date.now() + seconds * 1000;
  while (true) {
    const job = await (await fetch(`${url}/v1/jobs/${id}?wait=10`)).json();
    if (['succeeded', 'failed', 'canceled'].includes(job.status)) return job;
    if (Date.now() > end) throw new Error(`job ${id} is still ${job.status}`);
  }
}
