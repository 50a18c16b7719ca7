// Start a job: choose or drop a model, pick a preset.

import { listPresets, submit, type Job, type Preset } from '../asset/jobs';
import { copyText, h, replaceChildren, toast } from './dom';

const kAccepted = ['.glb', '.gltf', '.ply'];

export class UploadPanel {
  readonly element: HTMLElement;
  private readonly presets = h('select', { id: 'preset', disabled: true });
  private readonly description = h('p', { class: 'hint', id: 'preset-description' });
  private readonly input = h('input', {
    type: 'file',
    id: 'model',
    accept: kAccepted.join(','),
    class: 'visually-hidden',
    multiple: true,
  });
  private readonly list = h('ul', { class: 'uploads', 'aria-label': 'Uploads' });
  private readonly command = h('code', {});
  private known: Preset[] = [];

  constructor(private readonly started: (job: Job) => void) {
    this.input.addEventListener('change', () => this.take([...(this.input.files ?? [])]));
    this.presets.addEventListener('change', () => this.describe());
    this.presets.setAttribute('aria-describedby', 'preset-description');
    this.element = h(
      'section',
      { class: 'upload', 'aria-labelledby': 'upload-title' },
      h('h2', { id: 'upload-title' }, 'Bake a model'),
      h(
        'label',
        { class: 'drop', for: 'model' },
        h('strong', {}, 'Choose a model'),
        ' or drop it anywhere on this page',
        h('span', { class: 'hint' }, 'GLB, self-contained glTF, or PLY'),
      ),
      this.input,
      h('div', { class: 'field' }, h('label', { for: 'preset' }, 'Preset'), this.presets, this.description),
      this.list,
      h(
        'div',
        { class: 'curl' },
        h('span', { class: 'hint' }, 'The same with curl'),
        this.command,
        h('button', { type: 'button', onclick: () => void copyText(this.curl(), 'Command') }, 'Copy'),
      ),
    );
    this.acceptDrops();
    void this.loadPresets();
  }

  private async loadPresets(): Promise<void> {
    try {
      this.known = await listPresets();
    } catch {
      this.known = [];
    }
    replaceChildren(this.presets, ...this.known.map((preset) => h('option', { value: preset.name }, preset.name)));
    this.presets.disabled = this.known.length === 0;
    this.describe();
  }

  private describe(): void {
    const chosen = this.known.find((preset) => preset.name === this.presets.value);
    this.description.textContent = chosen?.description ?? 'The presets could not be loaded.';
    this.command.textContent = this.curl();
  }

  private curl(): string {
    return `curl -T scene.glb '${location.origin}/v1/jobs?preset=${encodeURIComponent(this.presets.value || 'prt')}'`;
  }

  private acceptDrops(): void {
    let depth = 0; // enter and leave events of nested elements come in pairs
    const mark = (change: number) =>
      document.body.classList.toggle('dropping', (depth = Math.max(0, depth + change)) > 0);
    const files = (event: DragEvent) => event.dataTransfer?.types.includes('Files') ?? false;
    window.addEventListener('dragenter', (event) => files(event) && mark(1));
    window.addEventListener('dragleave', (event) => files(event) && mark(-1));
    window.addEventListener('dragover', (event) => files(event) && event.preventDefault());
    window.addEventListener('drop', (event) => {
      if (!files(event)) return;
      event.preventDefault();
      mark(-depth);
      this.take([...(event.dataTransfer?.files ?? [])]);
    });
  }

  private take(files: File[]): void {
    this.input.value = '';
    for (const file of files) {
      if (kAccepted.some((ending) => file.name.toLowerCase().endsWith(ending))) void this.upload(file);
      else toast(`${file.name} is not a model Kiln reads (${kAccepted.join(', ')})`, 'error');
    }
  }

  private async upload(file: File): Promise<void> {
    const bar = h('progress', { max: 1, value: 0, 'aria-label': `Upload of ${file.name}` });
    const row = h('li', {}, h('span', {}, file.name), bar);
    this.list.append(row);
    try {
      const job = await submit(file, this.presets.value, (fraction) => (bar.value = fraction));
      row.remove();
      toast(`${file.name} was accepted`);
      this.started(job);
    } catch (error) {
      bar.remove();
      row.className = 'refused';
      row.append(
        h('span', {}, (error as Error).message),
        h('button', { type: 'button', 'aria-label': `Dismiss ${file.name}`, onclick: () => row.remove() }, 'Dismiss'),
      );
      toast(`${file.name} was refused`, 'error');
    }
  }
}
