// trade.csv, as kiln-trade (tests/bench/trade) writes it: a row a run.

export interface Estimate {
  value: number;
  low: number; // 95 % interval
  high: number;
}

export const kErrors = {
  seen: 'transport, where it can be seen',
  all: 'transport, hidden points too',
  jobLight: 'under the job’s own light in full detail',
  both: 'both judgements, as the presets’ rule has it',
};
export type ErrorKind = keyof typeof kErrors;

export const kTimes = { cpu: 'processor, all threads', wall: 'wall clock' };
export type TimeKind = keyof typeof kTimes;

export interface Run {
  scene: string;
  setting: string;
  order: number;
  seconds: Record<TimeKind, number>;
  bytes: number;
  errors: Record<ErrorKind, Estimate>;
  fields: Record<string, string>; // every column; empty for a mean
}

/// Smaller errors count as this, as in choose.h of kiln-trade: no interval of 8192 points reaches lower.
export const kSmallestError = 1e-3;

/// RFC 4180. A last line without its end was cut off.
export function parseCsv(text: string): string[][] {
  const lines: string[][] = [];
  let fields: string[] = [];
  let field = '';
  let quoted = false;
  for (let i = 0; i < text.length; ++i) {
    const c = text[i];
    if (quoted && c === '"' && text[i + 1] === '"') {
      field += '"';
      ++i;
    } else if (c === '"') quoted = !quoted;
    else if (!quoted && c === ',') {
      fields.push(field);
      field = '';
    } else if (!quoted && c === '\n') {
      lines.push([...fields, field.replace(/\r$/, '')]);
      fields = [];
      field = '';
    } else field += c;
  }
  return lines;
}

const geometricMean = (values: number[]): number =>
  Math.exp(values.reduce((sum, value) => sum + Math.log(value), 0) / values.length);

function meanEstimate(all: Estimate[]): Estimate {
  const of = (part: keyof Estimate) => geometricMean(all.map((e) => Math.max(e[part], kSmallestError)));
  return { value: of('value'), low: of('low'), high: of('high') };
}

function runOf(fields: Record<string, string>): Run {
  const number = (name: string) => Number(fields[name]);
  const estimate = (name: string): Estimate => ({
    value: number(name),
    low: number(`${name}_low`),
    high: number(`${name}_high`),
  });
  const seen = estimate('relrmse_seen');
  const jobLight = estimate('relrmse_job_light');
  return {
    scene: fields.scene,
    setting: fields.setting,
    order: Number((JSON.parse(fields.parameters) as { order?: number }).order ?? 0),
    seconds: { cpu: number('cpu_seconds'), wall: number('seconds') },
    bytes: number('artifact_bytes'),
    errors: { seen, all: estimate('relrmse'), jobLight, both: meanEstimate([seen, jobLight]) },
    fields,
  };
}

export function parseRuns(csv: string): Run[] {
  const [names = [], ...lines] = parseCsv(csv);
  return lines.map((line) => runOf(Object.fromEntries(names.map((name, i) => [name, line[i]]))));
}

export const kMean = 'mean of all scenes';

/// Geometric means of the settings that were run on all scenes, as runs of a scene called kMean.
export function meansOverScenes(runs: Run[]): Run[] {
  const scenes = new Set(runs.map((run) => run.scene)).size;
  const means = [...new Set(runs.map((run) => run.setting))].map((setting): Run | null => {
    const all = [...new Map(runs.filter((r) => r.setting === setting).map((r) => [r.scene, r])).values()];
    if (all.length !== scenes) return null;
    const mean = (of: (run: Run) => number) => geometricMean(all.map(of));
    const error = (kind: ErrorKind) => meanEstimate(all.map((run) => run.errors[kind]));
    return {
      scene: kMean,
      setting,
      order: Math.min(...all.map((run) => run.order)),
      seconds: { cpu: mean((r) => r.seconds.cpu), wall: mean((r) => r.seconds.wall) },
      bytes: mean((r) => r.bytes),
      errors: { seen: error('seen'), all: error('all'), jobLight: error('jobLight'), both: error('both') },
      fields: {},
    };
  });
  return means.filter((mean) => mean !== null);
}
