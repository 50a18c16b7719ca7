// What happened to a job, for whoever wonders why it ran twice. Asked for when it is opened.

import { getHistory, type JobEvent } from '../asset/jobs';
import { h, replaceChildren } from './dom';

const kText: Record<JobEvent['status'], string> = {
  queued: 'Back in the queue',
  running: 'Running',
  succeeded: 'Done',
  failed: 'Failed',
  canceled: 'Canceled',
};

/// Every change of state and every line said of it; its files stand elsewhere.
function line(event: JobEvent, first: boolean): HTMLElement | null {
  if (event.kind !== 'state' && event.kind !== 'log') return null;
  const what = event.kind === 'log' ? '' : first ? 'Queued' : kText[event.status];
  const said = event.message ? h('span', { class: 'hint' }, what ? `: ${event.message}` : event.message) : null;
  const time = h('time', { datetime: event.at, title: event.at }, new Date(event.at).toLocaleTimeString());
  return h('li', { 'data-status': event.status }, time, ` ${what}`, said);
}

async function fill(box: HTMLElement, id: string): Promise<void> {
  try {
    const events = await getHistory(id);
    replaceChildren(box, h('ol', { class: 'history' }, ...events.map((event, i) => line(event, i === 0))));
  } catch (error) {
    replaceChildren(box, h('p', { class: 'hint' }, (error as Error).message));
  }
}

export class History {
  private readonly box = h('div', {});
  readonly element = h('details', { class: 'history-details' }, h('summary', {}, 'History'), this.box);

  constructor(private readonly id: string) {
    this.element.addEventListener('toggle', () => this.refresh());
  }

  /// Something changed: what is open is asked for again.
  refresh(): void {
    if (this.element.open) void fill(this.box, this.id);
  }
}
