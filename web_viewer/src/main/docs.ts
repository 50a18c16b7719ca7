// The page at `/docs`: /openapi.json for people. A reader of exactly what kilnd's document uses, not of all OpenAPI.

import { copyText, h, toast } from '../ui/dom';
import { pageHeader } from '../ui/header';
import { applyTheme } from '../ui/theme';

interface Schema {
  $ref?: string;
  type?: string | string[];
  format?: string;
  description?: string;
  enum?: unknown[];
  items?: Schema;
  properties?: Record<string, Schema>;
  required?: string[];
  oneOf?: Schema[];
  anyOf?: Schema[];
}

interface Parameter {
  $ref?: string;
  name: string;
  in: string;
  required?: boolean;
  description?: string;
  schema?: Schema;
}

type Content = Record<string, { schema?: Schema; example?: unknown }>;

interface Operation {
  summary?: string;
  description?: string;
  tags?: string[];
  parameters?: Parameter[];
  requestBody?: { $ref?: string; description?: string; content?: Content };
  responses?: Record<string, { $ref?: string; description?: string; content?: Content }>;
}

interface Document {
  info: { title: string; version: string; summary?: string; description?: string };
  paths: Record<string, Record<string, Operation> & { parameters?: Parameter[] }>;
  [key: string]: unknown;
}

const kMethods = ['get', 'post', 'put', 'patch', 'delete', 'head', 'options'];

let openapi: Document;

/// Follows a local reference (RFC 6901).
function resolve<T extends { $ref?: string }>(value: T): T {
  if (!value.$ref?.startsWith('#/')) return value;
  const keys = value.$ref
    .slice(2)
    .split('/')
    .map((key) => key.replaceAll('~1', '/').replaceAll('~0', '~'));
  let found: unknown = openapi;
  for (const key of keys) found = (found as Record<string, unknown> | undefined)?.[key];
  return (found as T | undefined) ?? value;
}

const refName = (schema: Schema): string => schema.$ref?.split('/').pop() ?? '';

function typeName(schema: Schema | undefined): string {
  if (!schema) return 'any';
  if (schema.$ref) return refName(schema);
  if (schema.enum) return schema.enum.map((one) => JSON.stringify(one)).join(' | ');
  if (schema.items) return `array of ${typeName(schema.items)}`;
  const several = schema.oneOf ?? schema.anyOf;
  if (several) return several.map(typeName).join(' | ');
  return [schema.type ?? 'any'].flat().join(' | ') + (schema.format ? ` (${schema.format})` : '');
}

function properties(schema: Schema | undefined): HTMLElement | null {
  const whole = schema && resolve(schema);
  if (!whole?.properties) return null;
  const rows = Object.entries(whole.properties).map(([name, one]) =>
    h(
      'tr',
      {},
      h('th', { scope: 'row' }, h('code', {}, name), whole.required?.includes(name) ? ' *' : ''),
      h('td', {}, typeName(one)),
      h('td', {}, resolve(one).description ?? ''),
    ),
  );
  return table(['Field', 'Type', 'Meaning'], rows);
}

/// The last column is left out where it says nothing.
function table(heads: string[], rows: HTMLElement[]): HTMLElement {
  if (rows.every((row) => row.lastElementChild?.textContent === '')) {
    for (const row of rows) row.lastElementChild?.remove();
    heads = heads.slice(0, -1);
  }

  return h(
    'div',
    { class: 'table-scroll', tabindex: 0, role: 'region', 'aria-label': heads.join(', ') },
    h(
      'table',
      {},
      h('thead', {}, h('tr', {}, ...heads.map((head) => h('th', { scope: 'col' }, head)))),
      h('tbody', {}, ...rows),
    ),
  );
}

function parameterTable(list: Parameter[]): HTMLElement | null {
  if (list.length === 0) return null;
  const rows = list
    .map(resolve)
    .map((p) =>
      h(
        'tr',
        {},
        h('th', { scope: 'row' }, h('code', {}, p.name), p.required ? ' *' : ''),
        h('td', {}, p.in),
        h('td', {}, typeName(p.schema)),
        h('td', {}, p.description ?? ''),
      ),
    );
  return table(['Parameter', 'In', 'Type', 'Meaning'], rows);
}

/// `detailed`: with the fields of each schema.
function bodies(content: Content | undefined, detailed: boolean): HTMLElement[] {
  return Object.entries(content ?? {}).map(([media, { schema, example }]) =>
    h(
      'div',
      { class: 'body' },
      h('code', {}, media),
      schema ? ` ${typeName(schema)}` : '',
      detailed ? properties(schema) : null,
      example === undefined ? null : h('pre', { tabindex: 0 }, JSON.stringify(example, null, 2)),
    ),
  );
}

function operation(path: string, method: string, op: Operation, shared: Parameter[]): HTMLElement {
  const request = op.requestBody && resolve(op.requestBody);
  const answers = Object.entries(op.responses ?? {}).map(([status, raw]) => {
    const answer = resolve(raw);
    return h(
      'li',
      {},
      h('strong', {}, status),
      ` ${answer.description ?? ''}`,
      ...bodies(answer.content, status.startsWith('2')),
    );
  });
  const curl = `curl${method === 'get' ? '' : ` -X ${method.toUpperCase()}`} '${location.origin}${path}'`;
  return h(
    'details',
    { class: 'operation', id: `${method}${path.replaceAll(/[^a-z0-9]+/gi, '-')}` },
    h(
      'summary',
      {},
      h('span', { class: `method method-${method}` }, method.toUpperCase()),
      h('code', {}, path),
      h('span', { class: 'hint' }, op.summary ?? ''),
    ),
    op.description ? h('p', {}, op.description) : null,
    parameterTable([...shared, ...(op.parameters ?? [])]),
    request ? h('h2', {}, 'Body') : null,
    request?.description ? h('p', {}, request.description) : null,
    ...bodies(request?.content, true),
    answers.length ? h('h2', {}, 'Answers') : null,
    h('ul', { class: 'answers' }, ...answers),
    h(
      'p',
      { class: 'curl' },
      h('code', {}, curl),
      ' ',
      h(
        'button',
        {
          type: 'button',
          'aria-label': `Copy the command for ${method} ${path}`,
          onclick: () => void copyText(curl, 'Command'),
        },
        'Copy',
      ),
    ),
  );
}

function show(main: HTMLElement): void {
  const { info, paths } = openapi;
  main.append(
    h(
      'p',
      { class: 'lead' },
      info.description ?? info.summary ?? '',
      ' ',
      h('a', { href: '/openapi.json' }, 'openapi.json'),
      `, version ${info.version}`,
    ),
  );
  for (const [path, item] of Object.entries(paths)) {
    for (const method of kMethods)
      if (item[method]) main.append(operation(path, method, item[method], item.parameters ?? []));
  }
}

async function start(): Promise<void> {
  const main = h('main', { class: 'docs' });
  const trade = h('a', { href: '/trade', class: 'text-link' }, 'Accuracy');
  document.body.append(pageHeader('HTTP interface', trade), main);
  try {
    const answer = await fetch('/openapi.json');
    if (!answer.ok) throw new Error(`the server answered ${answer.status} for /openapi.json`);
    openapi = (await answer.json()) as Document;
    show(main);
  } catch (error) {
    main.append(h('p', { class: 'problem' }, (error as Error).message));
    toast((error as Error).message, 'error');
  }
}

applyTheme();
void start();
