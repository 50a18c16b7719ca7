// One job in the gallery. The card is built once and updated in place, so that focus and open details survive.

import {
  artifact,
  artifactUrl,
  explain,
  finished,
  getReport,
  type Job,
  type Progress,
  type Report,
} from '../asset/jobs';
import { copyText, h, replaceChildren } from './dom';
import { ago, bytes, percent, plain, seconds } from './format';
import { History } from './history';

export interface CardActions {
  cancel(job: Job): void;
  remove(job: Job): void;
}

const kStatusText: Record<Job['status'], string> = {
  queued: 'Queued',
  running: 'Running',
  succeeded: 'Done',
  failed: 'Failed',
  canceled: 'Canceled',
};

export class JobCard {
  readonly element: HTMLElement;
  job: Job;
  private readonly picture = h('a', { class: 'thumb' });
  private readonly title = h('h3', { class: 'card-title' });
  private readonly status = h('span', { class: 'status' });
  private readonly facts = h('p', { class: 'facts' });
  private readonly progress = h('div', { class: 'card-progress' });
  private readonly bar = h('progress', { max: 1 });
  private readonly stage = h('span', {});
  private readonly problem = h('pre', { class: 'problem', tabindex: 0 });
  private readonly recipe = h('dl', { class: 'pairs' });
  private readonly files = h('ul', { class: 'files' });
  private readonly buttons = h('div', { class: 'card-buttons' });
  private readonly history: History;
  private shownThumb = '';
  private certified: string | null = null; // null: not asked for yet

  constructor(
    job: Job,
    private readonly actions: CardActions,
  ) {
    this.job = job;
    this.history = new History(job.id);
    this.progress.append(this.bar, this.stage);
    const details = h('details', {}, h('summary', {}, 'Parameters and files'), this.recipe, this.files);
    const body = h('div', { class: 'card-body' }, h('div', { class: 'card-head' }, this.title, this.status));
    body.append(this.facts, this.progress, this.problem, details, this.history.element, this.buttons);
    this.element = h('article', { class: 'card', 'data-job': job.id }, this.picture, body);
    this.update(job);
  }

  update(job: Job): void {
    if (job.status !== this.job.status || job.attempt !== this.job.attempt) this.history.refresh();
    this.job = job;
    const name = job.label || job.id;
    this.element.dataset.status = job.status;
    this.title.textContent = name;
    this.title.title = name;
    this.status.textContent = job.cached ? `${kStatusText[job.status]} (cached)` : kStatusText[job.status];
    this.status.className = `status status-${job.status}`;
    this.facts.textContent = this.factsText(job);
    void this.askForError(job);
    this.problem.hidden = job.error === null;
    this.problem.textContent = explain(job.error);
    this.showThumb(job, name);
    this.showProgress(job.progress);
    this.showDetails(job);
    this.showButtons(job, name);
  }

  showProgress(progress: Progress | null): void {
    const running = this.job.status === 'running';
    this.progress.hidden = !running;
    if (!running) return;
    const { stage, fraction, eta_s, error } = progress ?? { stage: 'starting', fraction: NaN, eta_s: null };
    this.bar.setAttribute('aria-label', `Progress of ${this.job.label || this.job.id}`);
    if (Number.isFinite(fraction)) this.bar.value = fraction;
    else this.bar.removeAttribute('value');
    const left = eta_s === null || eta_s === undefined ? '' : `, ${seconds(eta_s)} left`;
    const reached = error === undefined ? '' : `, error ${percent(error)} so far`;
    this.stage.textContent = Number.isFinite(fraction)
      ? `${stage} · ${Math.floor(100 * fraction)} %${left}${reached}`
      : stage;
  }

  /// The error stands in the report, which is asked for once, when there is one.
  private async askForError(job: Job): Promise<void> {
    if (this.certified !== null || job.status !== 'succeeded' || !artifact(job, 'report.json')) return;
    this.certified = '';
    const { certificate } = await getReport(job).catch((): Report => ({}));
    if (certificate?.relrmse !== undefined) this.certified = `error ${percent(certificate.relrmse)}`;
    this.facts.textContent = this.factsText(this.job);
  }

  private factsText(job: Job): string {
    const took =
      job.started_at && job.finished_at ? (Date.parse(job.finished_at) - Date.parse(job.started_at)) / 1000 : null;
    const result = artifact(job, 'scene.glb');
    return [
      ago(job.created_at),
      took === null ? '' : `took ${seconds(took)}`,
      result ? bytes(result.bytes) : '',
      this.certified ?? '',
      job.attempt > 1 ? `attempt ${job.attempt}` : '',
    ]
      .filter(Boolean)
      .join(' · ');
  }

  private showThumb(job: Job, name: string): void {
    const key = job.status + Boolean(artifact(job, 'preview.png'));
    if (key === this.shownThumb) return;
    this.shownThumb = key;
    const url = artifact(job, 'preview.png') ? artifactUrl(job, 'preview.png') : null;
    const image = url
      ? h('img', { src: url, alt: `Preview of ${name}`, loading: 'lazy', decoding: 'async' })
      : h(
          'span',
          { class: 'thumb-empty' },
          finished(job) ? 'No picture' : job.status === 'running' ? 'Baking' : 'Waiting',
        );
    replaceChildren(this.picture, image);
    const viewable = job.status === 'succeeded';
    if (viewable) this.picture.href = `/view/${encodeURIComponent(job.id)}`;
    else this.picture.removeAttribute('href');
  }

  private showDetails(job: Job): void {
    const rows: [string, unknown][] = [
      ['id', job.id],
      ...Object.entries(job.recipe ?? {}).filter(([key]) => key !== 'label'),
    ];
    replaceChildren(this.recipe, ...rows.flatMap(([key, value]) => [h('dt', {}, key), h('dd', {}, plain(value))]));
    const link = (name: string, size: number) =>
      h('a', { href: `${artifactUrl(job, name)}?download=1`, download: name }, `${name}, ${bytes(size)}`);
    replaceChildren(this.files, ...(job.artifacts ?? []).map((file) => h('li', {}, link(file.name, file.bytes))));
  }

  private showButtons(job: Job, name: string): void {
    const focused = this.buttons.contains(document.activeElement) ? document.activeElement?.textContent : null;
    const button = (text: string, action: () => void, kind = '') =>
      h('button', { type: 'button', class: kind, 'aria-label': `${text}: ${name}`, onclick: action }, text);
    replaceChildren(
      this.buttons,
      job.status === 'succeeded'
        ? h(
            'a',
            { class: 'button primary', href: `/view/${encodeURIComponent(job.id)}`, 'aria-label': `View: ${name}` },
            'View',
          )
        : null,
      job.status === 'succeeded' ? button('Copy curl', () => void copyText(this.curl(), 'Command')) : null,
      finished(job) ? null : button('Cancel', () => this.actions.cancel(this.job)),
      finished(job) ? button('Delete', () => this.actions.remove(this.job), 'quiet') : null,
    );
    for (const child of this.buttons.children)
      if (focused && child.textContent === focused) (child as HTMLElement).focus();
  }

  private curl(): string {
    return `curl -o scene.glb '${location.origin}${artifactUrl(this.job, 'scene.glb')}'`;
  }
}
