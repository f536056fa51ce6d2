// Strip charts of the last seconds, one for each group of signals. They show one span of time: the
// latest, or, when the run stands still, any that was zoomed or dragged to (gestures.js).
/* global keyOn */
import {Chart} from './chart.js';
import {dark, make} from './elements.js';

const SHOWN = ['Axis rate', 'Motor current', 'Torque bias', 'Axis angle', 'Pointing error'];
const STORE = 'antenna_drive.charts';
const REAL = 'Motor current, real';
const RATIO = 'armature.physical_amperes_per_article_ampere';
const LEAST_S = 10;      // a window begins with this and grows, if it may be longer
const coarse = matchMedia('(pointer: coarse)');
const FINEST_S = 0.02;   // shortest span shown: two intervals

export class Charts {
  constructor(samples) {
    Object.assign(this, {samples, charts: [], changes: [], levels: [], tape: null, length: 60,
                         fixed: null, state: 'waiting'});
    this.holder = document.getElementById('charts');
    this.at = document.getElementById('at');
    this.follow = document.getElementById('follow');
    this.follow.addEventListener('click', () => this.all());
    const length = document.getElementById('span');
    length.addEventListener('change', () => {
      this.length = Number(length.value);
      this.all();
    });
    this.holder.addEventListener('keydown', event => {
      if (keyOn(this, event.key)) event.preventDefault();
    });
    addEventListener('resize', () => this.resize());
    dark.addEventListener('change', () => this.rebuild());
  }

  takes() {
    return {
      changes: told => { this.changes = told.changes; },
      parameters: told => this.offerRealAmperes(told),
      state: told => {
        this.state = told.state;
        if (!this.isOpen()) this.all();
        this.holder.classList.toggle('open', this.isOpen());
      },
    };
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

  // Article amperes are no real ones: the drive tells how many of these each is.
  offerRealAmperes({unit, entries}) {
    const ratio = entries.find(entry => entry.name === RATIO)?.value;
    if (unit !== 'motor_1' || !ratio || !this.panels) return;
    const panels = this.panels.filter(panel => panel.title !== REAL);
    const place = panels.findIndex(panel => panel.names[0] === 'motor_1/current');
    panels.splice(place + 1, 0, {...panels[place], title: REAL, unit: 'real A', factor: ratio});
    this.begin(panels);
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

  setLevels(levels) {
    this.levels = levels;
    this.rebuild();
  }

  // A recording to be drawn beside the live curves; `start` is its beginning in the run's time [s].
  setTape(tape) {
    this.tape = tape;
    this.rebuild();
  }

  // Whether gestures count: not while curves run away under the mouse.
  isOpen() { return this.state === 'paused' || this.state === 'stopped'; }

  // The span of time that is shown [s].
  get span() {
    if (this.fixed) return this.fixed;
    const {samples, length} = this, least = Math.min(LEAST_S, length);
    const begun = samples.count ? samples.begun() : 0;
    const end = Math.max(samples.time || 0, begun + least);
    return [Math.max(end - length, begun), end];
  }

  show(from, to) {
    const {samples} = this, begun = samples.begun();
    const end = Math.max(samples.time, begun + LEAST_S);
    const span = Math.min(Math.max(to - from, FINEST_S), end - begun);
    const start = Math.min(Math.max(from, begun), end - span);
    this.look([start, start + span]);
  }

  all() { this.look(null); }

  look(fixed) {
    this.fixed = fixed;
    this.follow.hidden = !fixed;
    this.draw();
  }

  draw() {
    for (const chart of this.charts) chart.draw();
    this.tell();
  }

  // The time at the cursor, and what the mouse can do.
  tell() {
    const [plot] = this.charts.map(chart => chart.plot);
    const text = plot && plot.cursor.left >= 0
      ? `values at ${plot.posToVal(plot.cursor.left, 'x').toFixed(3)} s`
      : !this.isOpen() ? 'pause to zoom and move'
        : coarse.matches ? 'drag: move, tap: values'
          : 'wheel: zoom, drag: move, shift and drag: zoom into a span';
    if (this.at.textContent !== text) this.at.textContent = text;
  }
}
