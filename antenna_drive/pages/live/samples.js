// The last minute of every signal: least and greatest value of each interval, in a ring.
const KEPT = 6000;            // as many as the server keeps
const HEADER_BYTES = 56;

export class Samples {
  constructor() {
    this.names = new Map();
    this.count = 0;
    this.run = 0;
    this.news = false;
    this.arrived = 0;
  }

  begin(signals) {
    this.signals = signals;
    this.names = new Map(signals.map((signal, column) => [signal.name, column]));
    this.count = signals.length;
    this.lows = new Float32Array(KEPT * this.count).fill(NaN);
    this.highs = new Float32Array(KEPT * this.count).fill(NaN);
    this.now = new Float32Array(this.count).fill(NaN);
    this.clear(0);
  }

  clear(run) {
    this.run = run;
    this.newest = -1;
    this.oldest = 0;
    this.first = null;      // interval with the first value that came
    this.interval = 0.01;
    this.time = 0;
    this.step = 1e-3;
    this.lows.fill(NaN);
    this.highs.fill(NaN);
  }

  take(buffer) {
    const [, intervals, signals] = new Uint32Array(buffer, 0, 4);
    if (signals !== this.count) return;
    const [run, first, interval, time, step] = new Float64Array(buffer, 16, 5);
    if (run !== this.run) this.clear(run);
    const numbers = new Float32Array(buffer, HEADER_BYTES);
    const size = intervals * signals;
    if (first > this.newest + 1) {        // some were dropped: this page was too slow
      this.lows.fill(NaN);
      this.highs.fill(NaN);
      this.oldest = first;
    }
    for (let n = 0; n < intervals; n++) {
      const place = (first + n) % KEPT * signals;
      this.lows.set(numbers.subarray(n * signals, (n + 1) * signals), place);
      this.highs.set(numbers.subarray(size + n * signals, size + (n + 1) * signals), place);
      if (this.first === null && !Number.isNaN(this.lows[place])) this.first = first + n;
    }
    this.now.set(numbers.subarray(2 * size));
    this.newest = Math.max(this.newest, first + intervals - 1);
    this.oldest = Math.max(this.oldest, this.newest - KEPT + 1);
    this.interval = interval;
    this.time = time;
    this.step = step;
    this.news = true;
    this.arrived += 1;
  }

  // Whether something came since this was asked last.
  fresh() {
    const news = this.news;
    this.news = false;
    return news;
  }

  // Time of the first value that is still known [s].
  begun() {
    return Math.max(this.first ?? 0, this.oldest) * this.interval;
  }

  last(name) {
    return this.now[this.names.get(name)];
  }

  // Writes least and greatest value of a signal in each of `columns` equal parts of a span [s],
  // in the order in which a line goes through them; null where there is nothing.
  gather(name, from, to, columns, factor, into) {
    const column = this.names.get(name), width = (to - from) / columns;
    let before = 0;
    for (let n = 0; n < columns; n++) {
      const begin = Math.max(this.oldest, Math.floor((from + n * width) / this.interval + 1e-6));
      const end = Math.max(begin + 1, Math.floor((from + (n + 1) * width) / this.interval + 1e-6));
      let low = Infinity, high = -Infinity;
      for (let i = begin; i < end && i <= this.newest; i++) {
        const place = i % KEPT * this.count + column;
        if (this.lows[place] < low) low = this.lows[place];
        if (this.highs[place] > high) high = this.highs[place];
      }
      if (low > high) {
        into[2 * n] = into[2 * n + 1] = null;
        continue;
      }
      const rising = low + high >= before;
      before = low + high;
      into[2 * n] = factor * (rising ? low : high);
      into[2 * n + 1] = factor * (rising ? high : low);
    }
  }
}
