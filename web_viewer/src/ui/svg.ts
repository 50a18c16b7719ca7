// SVG elements from code, as dom.ts makes HTML. Looks come from classes: style attributes are forbidden by our policy.

const kNamespace = 'http://www.w3.org/2000/svg';

export function svg(
  tag: string,
  attributes: Record<string, string | number | undefined> = {},
  ...children: (Node | string)[]
): SVGElement {
  const element = document.createElementNS(kNamespace, tag);
  for (const [name, value] of Object.entries(attributes))
    if (value !== undefined) element.setAttribute(name, String(value));
  element.append(...children);
  return element;
}
