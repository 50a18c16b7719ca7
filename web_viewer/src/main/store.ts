// A value and who wants to know when it changes.

export type Listener<T> = (state: Readonly<T>, changed: ReadonlySet<keyof T>) => void;

export class Store<T extends object> {
  private readonly listeners = new Set<Listener<T>>();

  constructor(private state: T) {}

  get(): Readonly<T> {
    return this.state;
  }

  set(change: Partial<T>): void {
    const changed = new Set<keyof T>();
    for (const key of Object.keys(change) as (keyof T)[])
      if (!Object.is(change[key], this.state[key])) changed.add(key);
    if (changed.size === 0) return;
    this.state = { ...this.state, ...change };
    for (const listener of [...this.listeners]) listener(this.state, changed);
  }

  /// Returns what ends the subscription.
  subscribe(listener: Listener<T>): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}
