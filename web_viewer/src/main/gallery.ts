// The page at `/`: all jobs, alive.

import { cancelJob, deleteJob, finished, follow, kStatuses, listJobs, type Job } from '../asset/jobs';
import { announce, h, toast } from '../ui/dom';
import { pageHeader } from '../ui/header';
import { JobCard } from '../ui/job_card';
import { applyTheme } from '../ui/theme';
import { UploadPanel } from '../ui/upload_panel';

applyTheme();

const cards = new Map<string, JobCard>();
const grid = h('div', { class: 'grid' });
const empty = h('p', { class: 'empty' });
const more = h(
  'button',
  { type: 'button', class: 'more', hidden: true, onclick: () => void load(cursor) },
  'Show older jobs',
);
const connection = h('span', { class: 'connection' }, 'connecting');
const statusFilter = h(
  'select',
  { id: 'status' },
  h('option', { value: '' }, 'any status'),
  ...kStatuses.map((s) => h('option', { value: s }, s)),
);
const labelFilter = h('input', { id: 'label', type: 'search', placeholder: 'part of a label', autocomplete: 'off' });
let cursor = '';

const actions = {
  cancel: (job: Job) => attempt(cancelJob(job.id), `${job.label || job.id} is being canceled`),
  remove: (job: Job) =>
    attempt(
      deleteJob(job.id).then(() => drop(job.id)),
      `${job.label || job.id} was deleted`,
    ),
};

function attempt(work: Promise<unknown>, said: string): void {
  work.then(
    () => toast(said),
    (error: Error) => toast(error.message, 'error'),
  );
}

function drop(id: string): void {
  cards.get(id)?.element.remove();
  cards.delete(id);
  showEmpty();
}

function matches(job: Job): boolean {
  const label = labelFilter.value.trim().toLowerCase();
  return (
    (!statusFilter.value || job.status === statusFilter.value) &&
    (!label || (job.label || job.id).toLowerCase().includes(label))
  );
}

/// Newest first: ids sort by time of creation.
function show(job: Job): void {
  const card = cards.get(job.id);
  if (card) {
    if (card.job.status !== job.status) announce(`${job.label || job.id}: ${job.status}`);
    card.update(job);
    card.element.hidden = !matches(job);
  } else {
    const made = new JobCard(job, actions);
    cards.set(job.id, made);
    made.element.hidden = !matches(job);
    const after = [...cards.values()]
      .filter((c) => c.job.id < job.id)
      .sort((a, b) => (a.job.id < b.job.id ? 1 : -1))[0];
    grid.insertBefore(made.element, after?.element ?? null);
  }
  showEmpty();
}

/// When an event last told of a job, by performance.now().
const told = new Map<string, number>();

/// A list may arrive after an event that is newer than it.
function outdated(job: Job, asked: number): boolean {
  if (cards.has(job.id) && (told.get(job.id) ?? 0) > asked) return true;
  const known = cards.get(job.id)?.job;
  return known !== undefined && finished(known) && !finished(job) && known.attempt >= job.attempt;
}

function showEmpty(): void {
  const visible = [...cards.values()].some((card) => !card.element.hidden);
  empty.hidden = visible;
  empty.textContent =
    cards.size === 0
      ? 'No jobs yet. Drop a model on this page, or use the curl command.'
      : 'No job matches the filter.';
}

async function load(from: string): Promise<void> {
  try {
    const asked = performance.now();
    const page = await listJobs({ status: statusFilter.value, cursor: from });
    page.jobs.filter((job) => !outdated(job, asked)).forEach(show);
    cursor = page.next_cursor ?? '';
    more.hidden = cursor === '';
    showEmpty();
  } catch (error) {
    toast((error as Error).message, 'error');
  }
}

function filter(): void {
  for (const card of cards.values()) card.element.hidden = !matches(card.job);
  showEmpty();
}

function connected(yes: boolean): void {
  connection.dataset.live = String(yes);
  connection.textContent = yes ? 'live' : 'reconnecting';
  if (yes) void load(''); // whatever happened before the stream was open
}

function build(): void {
  statusFilter.addEventListener('change', () => {
    filter();
    void load('');
  });
  labelFilter.addEventListener('input', filter);
  const filters = h(
    'div',
    { class: 'filters', role: 'search' },
    h('label', { for: 'status' }, 'Status'),
    statusFilter,
    h('label', { for: 'label' }, 'Label'),
    labelFilter,
    connection,
  );
  const jobs = h(
    'section',
    { class: 'jobs', 'aria-labelledby': 'jobs-title' },
    h('div', { class: 'jobs-head' }, h('h2', { id: 'jobs-title' }, 'Jobs'), filters),
    grid,
    empty,
    more,
  );
  const docs = h('a', { href: '/docs', class: 'text-link' }, 'HTTP interface');
  const trade = h('a', { href: '/trade', class: 'text-link' }, 'Accuracy');
  document.body.append(pageHeader('Baked light', trade, docs), h('main', {}, new UploadPanel(show).element, jobs));
}

build();
void load('');
follow(undefined, {
  job: (job) => {
    told.set(job.id, performance.now());
    show(job);
  },
  progress: (id, progress) => {
    told.set(id, performance.now());
    cards.get(id)?.showProgress(progress);
  },
  connected,
});
