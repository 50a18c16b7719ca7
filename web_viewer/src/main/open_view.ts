// The entry of `/view/{id}`, kept small so that it runs early: asks for the job, fetches its scene.glb, sets the light worker to
// decode it, and makes the WebGL context. three.js and all that uses it (view.ts) arrive meanwhile.

import { artifact, artifactUrl, explain, finished, follow, getJob, getReport, type Job } from '../asset/jobs';
import { download } from '../asset/download';
import { carriesTransfer, readPacked } from '../asset/unpack';
import { Relighter } from '../light/relighter';
import { announce } from '../ui/dom';
import { bytes } from '../ui/format';
import { History } from '../ui/history';
import { applyTheme } from '../ui/theme';
import { Page } from './page';
import { createContext } from './webgl';

const kNewsEvery = 100; // ms between two pieces of news of the download: each is a repaint

applyTheme();

/// Resolves with the finished job; shows its progress until then.
function whenFinished(job: Job, page: Page): Promise<Job> {
  const { id, overlay } = page;
  if (finished(job)) return Promise.resolve(job);
  overlay.show(`The job is ${job.status}`, null);
  return new Promise((resolve) => {
    const stop = follow(id, {
      job: (news) => {
        announce(`The job is ${news.status}`);
        if (!finished(news)) return overlay.show(`The job is ${news.status}`, null);
        stop();
        resolve(news);
      },
      progress: (_id, { stage, fraction }) =>
        overlay.show(`Baking: ${stage}, ${Math.floor(100 * fraction)} %`, fraction),
    });
    page.onDispose(stop);
  });
}

function checkShowable(job: Job): void {
  if (job.status !== 'succeeded' || !artifact(job, 'scene.glb'))
    throw new Error(job.error ? explain(job.error) : `The job is ${job.status}; there is nothing to show.`);
}

function fetchScene(url: string, { overlay }: Page): Promise<ArrayBuffer> {
  let next = 0;
  return download(url, (loaded, total) => {
    if (performance.now() < next) return;
    next = performance.now() + kNewsEvery;
    const [text, fraction] = total ? [`${bytes(loaded)} of ${bytes(total)}`, loaded / total] : [bytes(loaded), null];
    overlay.show(`Loading ${text}`, fraction);
  });
}

async function open(page: Page): Promise<void> {
  const relighter = new Relighter();
  page.onDispose(() => relighter.dispose());
  const viewer = import('./view');
  viewer.catch(() => undefined); // is awaited below
  const asked = await getJob(page.id);
  page.title.textContent = asked.label || page.id;
  document.title = `${asked.label || page.id} – Kiln`;
  const job = await whenFinished(asked, page);
  checkShowable(job);
  const asBaked = location.hash.length < 2; // else another view was asked for
  if (asBaked && artifact(job, 'preview.png')) page.showPreview(artifactUrl(job, 'preview.png'));
  const file = await fetchScene(artifactUrl(job, 'scene.glb'), page);
  performance.mark('kiln:fetched');
  const size = file.byteLength;
  if (!carriesTransfer(file)) return openPlain(page, job, file, relighter);
  const { extension } = readPacked(file);
  const opened = relighter.open(file);
  await relighter.begun; // it cannot start while the next line blocks this thread
  const context = createContext(page.canvas);
  performance.mark('kiln:context');
  const { show } = await viewer;
  await show(page, job, { context, relighter, extension, opened, size });
}

/// What the step `reduce` made is shown as it is; another glTF without transfer vectors is none of ours.
async function openPlain(page: Page, job: Job, file: ArrayBuffer, relighter: Relighter): Promise<void> {
  const report = artifact(job, 'report.json') ? await getReport(job).catch(() => null) : null;
  if (!report?.reduce) return void readPacked(file); // throws, and says why
  const { showPlain } = await import('./plain_view');
  await showPlain(page, job, { context: createContext(page.canvas), relighter, file, report });
}

async function start(): Promise<void> {
  performance.mark('kiln:script');
  const page = new Page(decodeURIComponent(/\/view\/([^/]+)/.exec(location.pathname)?.[1] ?? ''));
  page.overlay.show('Asking for the job', null);
  try {
    await open(page);
    document.querySelector('.panel')?.append(new History(page.id).element);
  } catch (error) {
    page.fail((error as Error).message);
    page.overlay.element.append(new History(page.id).element);
    page.dispose();
  }
}

void start();
