// What each node says of itself in /diagnostics, and the last changes of parameters.
import {levelClass, make, plain} from './elements.js';
import {ago, REPORT_S} from './freshness.js';

const MOST = 12;

export class Nodes {
  constructor(freshness) {
    Object.assign(this, {freshness, units: [], nodes: {}});
    const holder = document.getElementById('nodes');
    make('h2', holder, 'What the nodes report');
    this.reports = make('table', holder);
    this.lost = make('p', holder, '', {class: 'small'});
    make('h2', holder, 'Last changes');
    this.unchanged = make('p', holder, 'none since the page began to look', {class: 'small'});
    this.changes = make('table', holder);
    make('h2', holder, 'Keys');
    setInterval(() => this.report(), 1000);
    const keys = make('table', holder);
    for (const [key, what] of [['space', 'pause, go on'], ['.', 'step'], ['R', 'a new run'],
                               ['B', 'record, stop'], ['arrows', 'move a slider'],
                               ['wheel, drag', 'zoom and move the charts of a paused run'],
                               ['shift and drag', 'zoom into a span of them'],
                               ['+ − arrows', 'zoom and move them'],
                               ['0, double click', 'show the latest again']]) {
      const row = make('tr', keys);
      make('th', row, key, {scope: 'row'});
      make('td', row, what);
    }
  }

  takes() {
    return {
      hello: told => { this.units = told.units; },
      nodes: told => { this.nodes = told.nodes; this.report(); },
      drive: told => {
        this.lost.textContent = `steps that this page’s reader has missed: ${told.lost ?? 0}`;
      },
      changes: told => this.change(told.changes),
    };
  }

  report() {
    this.reports.replaceChildren();
    for (const unit of [...new Set([...this.units, ...Object.keys(this.nodes)])]) {
      const said = this.nodes[unit], age = this.freshness.age(unit), late = age > REPORT_S;
      const row = make('tr', this.reports, '', {class: late ? 'stale' : ''});
      make('th', row, unit, {scope: 'row'});
      const cell = make('td', row);
      if (late) make('div', cell, `no report for ${ago(age)}; the last was:`, {class: 'level-ERROR'});
      make('span', cell, said?.message ?? 'no report yet', {class: said ? levelClass(said.level) : 'small'});
      if (!said) continue;
      const more = ['late steps', 'exchange', 'refused frames'].filter(key => key in said.values)
        .map(key => `${key}: ${said.values[key]}`).join(', ');
      make('div', cell, `step ${said.values.step}, ${more}`, {class: 'small'});
    }
  }

  change(changes) {
    this.unchanged.hidden = changes.length > 0;
    this.changes.replaceChildren();
    for (const one of changes.slice(-MOST).reverse()) {
      const row = make('tr', this.changes);
      make('th', row, `step ${one.step}`, {scope: 'row'});
      make('td', row, Object.entries(one.changes).map(([name, value]) =>
        `${one.unit}.${name} = ${typeof value === 'number' ? plain(value) : value}`).join(', '));
    }
  }
}
