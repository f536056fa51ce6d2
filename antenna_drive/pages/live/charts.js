// Strip charts of the last seconds, one for each group of signals.
import {colour, css, dark, digits, make} from './elements.js';

const HEIGHT = 112;
const SHOWN = ['Axis rate', 'Motor current', 'Torque bias', 'Axis angle', 'Pointing error'];
const SHRINK = 0.04;     // of the way to a narrower range, per picture
const STORE = 'antenna_drive.charts';

export class Charts {
  constructor(samples) {
    this.samples = samples;
    this.charts = [];
    this.changes = [];
    this.levels = [];
    this.tape = null;
    this.span = 60;
    this.holder = document.getElementById('charts');
    const span = document.getElementById('span');
    span.addEventListener('change', () => { this.span = Number(span.value); this.draw(); });
    addEventListener('resize', () => this.resize());
    dark.addEventListener('change', () => this.rebuild());
  }

  begin(panels) {
    this.panels = panels;
    let shown = SHOWN;
    try { shown = JSON.parse(localStorage.getItem(STORE)) || SHOWN; } catch { /* as usual */ }
    const chips = document.getElementById('chips');
    chips.replaceChildren();
    for (const panel of panels) {
      panel.shown = shown.includes(panel.title);
      const chip = make('button', chips, panel.title, {
        type: 'button', 'aria-pressed': String(panel.shown)});
      chip.addEventListener('click', () => {
        panel.shown = !panel.shown;
        chip.setAttribute('aria-pressed', String(panel.shown));
        localStorage.setItem(STORE, JSON.stringify(
          panels.filter(one => one.shown).map(one => one.title)));
        this.rebuild();
      });
    }
    this.rebuild();
  }

  rebuild() {
    for (const chart of this.charts) chart.destroy();
    this.holder.replaceChildren();
    this.charts = (this.panels || []).filter(panel => panel.shown).map(
      (panel, place, all) => new Chart(this, panel, place === all.length - 1));
    this.draw();
  }

  resize() {
    for (const chart of this.charts) chart.resize();
    this.draw();
  }

  mark(changes) {
    this.changes = changes;
  }

  setLevels(levels) {
    this.levels = levels;
    this.rebuild();
  }

  // A recording to be drawn beside the live curves; `start` is its beginning in the run's time [s].
  setTape(tape) {
    this.tape = tape;
    this.rebuild();
  }

  draw() {
    for (const chart of this.charts) chart.draw();
  }
}

class Chart {
  constructor(charts, panel, isLast) {
    this.charts = charts;
    this.panel = panel;
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
    if (this.levels.length) make('span', head, '– – published');
    this.tapes = panel.names.filter(name => charts.tape?.curves[name]);
    if (this.tapes.length) make('span', head, `· · ${charts.tape.name}`);
    this.range = null;
    this.columns = 0;
    this.plot = new uPlot(this.options(isLast), [[0, 1], ...this.series().map(() => [null, null])],
                          this.element);
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
      padding: [6, 8, isLast ? 0 : 4, 0],
      cursor: {drag: {x: false, y: false}, points: {size: 5},
               sync: {key: 'live', setSeries: false}},
      scales: {x: {time: false, range: () => this.window()},
               y: {range: (plot, low, high) => this.roomy(low, high)}},
      axes: [{...axis, show: isLast, size: 24, values: (plot, at) => at.map(t => `${+t.toFixed(3)} s`)},
             {...axis, size: 54, space: 26, values: (plot, at) => at.map(v => digits(v, 3))}],
      series: [{}, ...this.series().map(one => ({...one, points: {show: false}}))],
      hooks: {draw: [plot => this.drawBeside(plot)]},
    };
  }

  width() { return Math.max(200, this.charts.holder.clientWidth); }

  height(isLast) {
    return HEIGHT + (isLast ? 24 : 0);
  }

  window() {
    const end = Math.max(this.charts.span, this.charts.samples.time || 0);
    return [end - this.charts.span, end];
  }

  // A range with some room that grows at once and shrinks slowly: the curve does not jump.
  roomy(low, high) {
    for (const level of this.levels)
      for (const value of [level.analysis, level.field])
        if (value !== null) {
          low = Math.min(low ?? value * this.panel.factor, value * this.panel.factor);
          high = Math.max(high ?? value * this.panel.factor, value * this.panel.factor);
        }
    if (low === null || !(high >= low)) return this.range || [-1, 1];
    const room = high > low ? 0.08 * (high - low) : Math.abs(high) * 0.1 || 1;
    const wanted = [low - room, high + room];
    if (!this.range) this.range = wanted;
    const [least, most] = this.range;
    this.range = [wanted[0] < least ? wanted[0] : least + SHRINK * (wanted[0] - least),
                  wanted[1] > most ? wanted[1] : most + SHRINK * (wanted[1] - most)];
    return this.range;
  }

  draw() {
    const {samples, tape} = this.charts;
    if (!samples.count) return;
    const columns = Math.max(100, Math.floor(this.plot.bbox.width / devicePixelRatio));
    if (columns !== this.columns) {
      this.columns = columns;
      this.data = Array.from({length: 1 + this.panel.names.length + this.tapes.length},
                             () => new Array(2 * columns).fill(null));
    }
    const [from, to] = this.window(), width = (to - from) / columns;
    const times = this.data[0];
    for (let n = 0; n < columns; n++) {
      times[2 * n] = from + (n + 0.25) * width;
      times[2 * n + 1] = from + (n + 0.75) * width;
    }
    this.panel.names.forEach((name, n) => {
      samples.gather(name, from, to, columns, this.panel.factor, this.data[1 + n]);
      this.values[n].textContent = digits(samples.last(name) * this.panel.factor);
    });
    this.tapes.forEach((name, n) => gatherTape(
      tape.curves[name], from - tape.start, to - tape.start, columns, this.panel.factor,
      this.data[1 + this.panel.names.length + n]));
    this.plot.setData(this.data);
  }

  // Published levels across the chart, and a line where a parameter changed.
  drawBeside(plot) {
    const {ctx, bbox} = plot, scale = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = scale;
    ctx.font = `${10 * scale}px system-ui, sans-serif`;
    this.drawLevels(plot, 'analysis', css('--ink'), 'left');
    this.drawLevels(plot, 'field', css('--faint'), 'right');
    ctx.setLineDash([2 * scale, 3 * scale]);
    ctx.strokeStyle = css('--warn');
    const {samples} = this.charts;
    for (const change of this.charts.changes) {
      if (change.run !== samples.run) continue;
      const x = plot.valToPos(change.step * samples.step, 'x', true);
      if (x < bbox.left) continue;
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  // The levels of one kind; labels of levels that lie close together stand one below the other.
  drawLevels({ctx, bbox, valToPos}, what, ink, side) {
    const scale = devicePixelRatio, line = 12 * scale, left = side === 'left';
    const levels = this.levels.filter(level => level[what] !== null).map(
      level => level[what] * this.panel.factor).sort((a, b) => b - a);
    ctx.strokeStyle = ink;
    ctx.setLineDash([6 * scale, 4 * scale]);
    for (const level of levels) {
      const y = valToPos(level, 'y', true);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
    }
    ctx.textAlign = side;
    const x = left ? bbox.left + 4 * scale : bbox.left + bbox.width - 4 * scale;
    let above = bbox.top - line / 2;
    for (const level of levels) {
      const y = above = Math.max(valToPos(level, 'y', true), above + line);
      const text = `${what} ${digits(level, 3)}`, width = ctx.measureText(text).width;
      ctx.fillStyle = css('--paper');
      ctx.fillRect(left ? x - 2 * scale : x - width - 2 * scale, y - line / 2,
                   width + 4 * scale, line);
      ctx.fillStyle = ink;
      ctx.fillText(text, x, y + 3.5 * scale);
    }
  }

  resize() {
    this.plot.setSize({width: this.width(), height: this.plot.height});
  }

  destroy() {
    this.plot.destroy();
    this.element.remove();
  }
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
