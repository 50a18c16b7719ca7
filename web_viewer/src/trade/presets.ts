// presets.json, as kiln-trade writes it: what the rule chooses beside what is in force.

import text from './presets.json?raw';

export interface Means {
  setting: string;
  cpu_seconds: number;
  artifact_bytes: number;
  error: number;
}

interface Document {
  rule: string;
  presets: Record<string, { reason: string; chosen: Means; in_force: Means }>;
}

const { rule, presets } = JSON.parse(text) as Document;

export const kRule = rule;
export const kChoices = Object.entries(presets).map(([preset, choice]) => ({ preset, ...choice }));
export const kPresets = kChoices.map(({ in_force }) => in_force.setting);
export const kChosen = kChoices.map(({ preset, chosen }) => ({ preset, chosen: chosen.setting }));
