// One strip chart: a group of signals that share an axis.
/* global listenTo, uPlot */
import {colour, css, digits, make} from './elements.js';

const HEIGHT = 112;
const SHRINK = 0.04;     // of the way to a narrower range, per picture

export class Chart {
  constructor(charts, panel, isLast) {
    Object.assign(this, {charts, panel, range: null, columns: 0});
    this.element = make('div', charts.holder, '', {class: 'chart', 'data-title': panel.title});
    const head = make('div', this.element, '', {class: 'head'});
    make('b', head, `${panel.title} [${panel.unit}]`);
    this.values = panel.names.map((name, n) => {
      const label = make('span', head);
      make('i', label).style.background = colour(n);
      label.append(short(name, panel), ' ');
      return make('b', label, '–');
    });
    this.levels = charts.levels.filter(level => panel.names.includes(level.signal));
    for (const kind of ['analysis', 'field']) this.nameLevels(head, kind);
    this.tapes = panel.names.filter(name => charts.tape?.curves[name]);
    this.taped = this.tapes.map((name, n) => {
      const label = make('span', head, n ? '' : `${charts.tape.name} `);
      make('i', label, '', {class: 'dotted'}).style.borderColor = colour(panel.names.indexOf(name));
      return make('b', label, '–');
    });
    this.plot = new uPlot(this.options(isLast), [[0, 1], ...this.series().map(() => [null, null])],
                          this.element);
    listenTo(this.plot, charts);
  }

  // Published levels are named above the chart, where their names hide no curve.
  nameLevels(head, kind) {
    const levels = this.levelsOf(kind);
    if (!levels.length) return;
    const label = make('span', head, '', {class: 'level'});
    make('i', label, '', {class: kind});
    label.append(`published, ${kind} ${levels.map(level => digits(level, 3)).join(', ')}`);
  }

  // From the highest, in the unit shown.
  levelsOf(kind) {
    return this.levels.filter(level => level[kind] !== null).map(
      level => level[kind] * this.panel.factor).sort((a, b) => b - a);
  }

  series() {
    const {names} = this.panel;
    return [...names.map((name, n) => ({stroke: colour(n), width: 1.4})),
            ...this.tapes.map(name => ({stroke: colour(names.indexOf(name)), width: 1.2,
                                        dash: [2, 3], alpha: 0.9}))];
  }

  options(isLast) {
    const axis = {stroke: css('--faint'), grid: {stroke: css('--grid'), width: 1},
                  ticks: {show: false}, font: '11px system-ui, sans-serif'};
    return {
      width: this.width(), height: this.height(isLast), legend: {show: false},
      padding: [6, 20, isLast ? 0 : 4, 0],
      cursor: {drag: {x: false, y: false, setScale: false}, points: {size: 5}, y: false,
               sync: {key: 'live', setSeries: false},
               bind: {dblclick: () => () => this.charts.all()}},
      scales: {x: {time: false, range: () => this.charts.span},
               y: {range: (plot, low, high) => this.roomy(low, high)}},
      axes: [{...axis, show: isLast, size: 24, values: (plot, at) => at.map(t => `${+t.toFixed(3)} s`)},
             {...axis, size: 54, space: 26, values: (plot, at) => at.map(v => digits(v, 3))}],
      series: [{}, ...this.series().map(one => ({...one, points: {show: false}}))],
      hooks: {drawAxes: [plot => this.drawLevels(plot)], draw: [plot => this.drawChanges(plot)],
              setCursor: [() => { this.tell(); this.charts.tell(); }]},
    };
  }

  width() { return Math.max(200, this.charts.holder.clientWidth); }

  height(isLast) {
    return HEIGHT + (isLast ? 24 : 0);
  }

  // A range with some room that grows at once and shrinks slowly: a curve that runs does not jump.
  roomy(low, high) {
    for (const kind of ['analysis', 'field'])
      for (const value of this.levelsOf(kind))
        [low, high] = [Math.min(low ?? value, value), Math.max(high ?? value, value)];
    if (low === null || !(high >= low)) return this.range || [-1, 1];
    const room = high > low ? 0.08 * (high - low) : Math.abs(high) * 0.1 || 1;
    const wanted = [low - room, high + room];
    if (!this.range || this.charts.fixed) this.range = wanted;
    const [least, most] = this.range;
    this.range = [wanted[0] < least ? wanted[0] : least + SHRINK * (wanted[0] - least),
                  wanted[1] > most ? wanted[1] : most + SHRINK * (wanted[1] - most)];
    return this.range;
  }

  draw() {
    const {samples, tape, span: [from, to]} = this.charts;
    if (!samples.count) return;
    const columns = Math.max(100, Math.floor(this.plot.bbox.width / devicePixelRatio));
    if (columns !== this.columns) {
      this.columns = columns;
      this.data = Array.from({length: 1 + this.panel.names.length + this.tapes.length},
                             () => new Array(2 * columns).fill(null));
    }
    const width = (to - from) / columns;
    const times = this.data[0];
    for (let n = 0; n < columns; n++) {
      times[2 * n] = from + (n + 0.25) * width;
      times[2 * n + 1] = from + (n + 0.75) * width;
    }
    this.panel.names.forEach((name, n) => samples.gather(
      name, from, to, columns, this.panel.factor, this.data[1 + n]));
    this.tapes.forEach((name, n) => gatherTape(
      tape.curves[name], from - tape.start, to - tape.start, columns, this.panel.factor,
      this.data[1 + this.panel.names.length + n]));
    this.plot.setData(this.data);
    this.tell();
  }

  // Beside each name its value: at the cursor, which is that of all charts, or the latest.
  tell() {
    const {idx, left} = this.plot.cursor, at = left >= 0 && idx !== null ? 2 * (idx >> 1) : null;
    const {samples} = this.charts, {factor, names} = this.panel;
    names.forEach((name, n) => {
      this.values[n].textContent = at === null ? digits(samples.last(name) * factor)
        : range(this.data?.[1 + n][at], this.data?.[1 + n][at + 1]);
    });
    this.taped.forEach((value, n) => {
      const curve = this.data?.[1 + names.length + n];
      value.textContent = at === null ? '' : range(curve?.[at], curve?.[at + 1]);
    });
  }

  // A line where a parameter changed.
  drawChanges(plot) {
    const {bbox} = plot, {samples} = this.charts;
    const steps = this.charts.changes.filter(change => change.run === samples.run);
    this.beside(plot, css('--warn'), [2, 3], steps.map(change => change.step * samples.step).map(
      time => plot.valToPos(time, 'x', true)).filter(x => x >= bbox.left).map(
      x => [x, bbox.top, x, bbox.top + bbox.height]));
  }

  // Published levels, below the curves.
  drawLevels(plot) {
    const {bbox} = plot;
    for (const [kind, ink, dash] of [['analysis', '--ink', [6, 4]], ['field', '--faint', [2, 2]]])
      this.beside(plot, css(ink), dash, this.levelsOf(kind).map(
        level => plot.valToPos(level, 'y', true)).map(
        y => [bbox.left, y, bbox.left + bbox.width, y]));
  }

  beside({ctx, bbox}, ink, dash, lines) {
    const scale = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = scale;
    ctx.strokeStyle = ink;
    ctx.setLineDash(dash.map(length => length * scale));
    ctx.beginPath();
    for (const [x, y, toX, toY] of lines) {
      ctx.moveTo(x, y);
      ctx.lineTo(toX, toY);
    }
    ctx.stroke();
    ctx.restore();
  }

  resize() {
    this.plot.setSize({width: this.width(), height: this.plot.height});
  }

  destroy() {
    this.plot.destroy();
    this.element.remove();
  }
}

// The values of a pixel: one number, or from the least to the greatest.
function range(one, other) {
  if (one === null || one === undefined) return '–';
  const [low, high] = [Math.min(one, other), Math.max(one, other)].map(value => digits(value));
  return low === high ? low : `${low} to ${high}`;
}

// A signal's name without what the panel's title says already.
function short(name, panel) {
  const [unit, signal] = name.split('/');
  const units = new Set(panel.names.map(one => one.split('/')[0]));
  if (units.size === panel.names.length && unit.startsWith('motor')) return unit.replace('_', ' ');
  return signal.replaceAll('_', ' ').replace('pointing error ', '');
}

function gatherTape({t, y}, from, to, columns, factor, into) {
  const width = (to - from) / columns;
  let at = firstFrom(t, from);
  for (let n = 0; n < columns; n++) {
    const end = from + (n + 1) * width;
    let low = Infinity, high = -Infinity;
    for (; at < t.length && t[at] < end; at++) {
      if (y[at] < low) low = y[at];
      if (y[at] > high) high = y[at];
    }
    if (low <= high) {
      into[2 * n] = factor * low;
      into[2 * n + 1] = factor * high;
    } else if (at > 0 && at < t.length && end > 0) {
      into[2 * n] = into[2 * n + 1] = factor * y[at - 1];
    } else {
      into[2 * n] = into[2 * n + 1] = null;
    }
  }
}

function firstFrom(t, time) {
  let low = 0, high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < time) low = middle + 1;
    else high = middle;
  }
  return low;
}
