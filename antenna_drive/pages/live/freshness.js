// Whether what the page shows is of now. What is not looks stale: the charts, the numbers, the node.
const STEPS_MS = 3000;
export const REPORT_S = 3.5;   // a node reports once a second

// '8 s', '3 min'
export const ago = seconds => seconds < 120 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`;

export class Freshness {
  constructor(samples) {
    Object.assign(this, {samples, connected: false, opened: false, state: 'waiting', trouble: '',
                         reports: new Map(), arrived: 0, since: performance.now()});
    this.line = document.getElementById('trouble');
    setInterval(() => this.look(), 200);
  }

  takes() {
    return {
      open: is => {
        if (is !== this.connected) this.since = performance.now();
        this.connected = is;
        this.opened ||= is;
        this.look();
      },
      state: told => { this.state = told.state; },
      drive: told => { [this.trouble, this.ready] = [told.trouble, told.ready]; this.look(); },
      nodes: told => this.report(told.nodes),
    };
  }

  report(nodes) {
    const now = performance.now();
    this.reports = new Map(Object.entries(nodes).map(
      ([unit, {heard}]) => [unit, now - 1000 * heard]));
  }

  // Seconds since a node has reported, undefined if it never has.
  age(unit) {
    const at = this.reports.get(unit);
    return at === undefined ? undefined : (performance.now() - at) / 1000;
  }

  silent() {
    return [...this.reports.keys()].filter(unit => this.age(unit) > REPORT_S);
  }

  // What is missing: 'connection', 'process', 'start', 'node' or 'steps'; '' if all is of now.
  get missing() {
    if (!this.connected) return this.opened ? 'connection' : '';
    if (this.trouble) return 'process';
    if (!this.ready && !this.reports.size) return 'start';
    if (this.silent().length) return 'node';
    const waited = performance.now() - this.since;
    return this.samples.arrived && this.state === 'playing' && waited > STEPS_MS ? 'steps' : '';
  }

  look() {
    const now = performance.now(), {samples} = this;
    if (samples.arrived !== this.arrived) [this.arrived, this.since] = [samples.arrived, now];
    const {missing} = this;
    document.body.classList.toggle('stale', missing !== '');
    const text = this.sentence(missing);
    if (this.line.textContent !== text) this.line.textContent = text;
    this.line.hidden = !text;
  }

  sentence(missing) {
    if (!missing || missing === 'start') return '';
    const waited = ago((performance.now() - this.since) / 1000);
    const of = this.samples.arrived ? `; what is shown is of ${this.samples.time.toFixed(3)} s` : '';
    const silent = this.silent().map(unit => `${unit}: no report for ${ago(this.age(unit))}`).join(', ');
    return {connection: `no connection to the page’s server for ${waited}${of}`,
            process: `${this.trouble}${of}`,
            node: `${silent}${of}`,
            steps: `no steps come for ${waited}${of}`}[missing];
  }
}
