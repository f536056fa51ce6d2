// What each node says of itself in /diagnostics, and the last changes of parameters.
import {levelClass, make, plain} from './elements.js';

const MOST = 12;

export class Nodes {
  constructor() {
    this.units = [];
    const holder = document.getElementById('nodes');
    make('h2', holder, 'What the nodes report');
    this.reports = make('table', holder);
    this.lost = make('p', holder, '', {class: 'small'});
    make('h2', holder, 'Last changes');
    this.changes = make('table', holder);
    make('h2', holder, 'Keys');
    const keys = make('table', holder);
    for (const [key, what] of [['space', 'pause, go on'], ['.', 'step'], ['R', 'a new run'],
                               ['B', 'record, stop'], ['arrows', 'move a slider']]) {
      const row = make('tr', keys);
      make('th', row, key, {scope: 'row'});
      make('td', row, what);
    }
  }

  takes() {
    return {
      hello: told => { this.units = told.units; },
      nodes: told => this.report(told.nodes),
      drive: told => {
        this.lost.textContent = `steps that this page’s reader has missed: ${told.lost ?? 0}`;
      },
      changes: told => this.change(told.changes),
    };
  }

  report(nodes) {
    this.reports.replaceChildren();
    for (const unit of [...new Set([...this.units, ...Object.keys(nodes)])]) {
      const said = nodes[unit];
      if (!said) continue;
      const row = make('tr', this.reports);
      make('th', row, unit, {scope: 'row'});
      const cell = make('td', row);
      make('span', cell, said.message, {class: levelClass(said.level)});
      const more = ['late steps', 'exchange', 'refused frames'].filter(key => key in said.values)
        .map(key => `${key}: ${said.values[key]}`).join(', ');
      make('div', cell, `step ${said.values.step}, ${more}`, {class: 'small'});
    }
  }

  change(changes) {
    this.changes.replaceChildren();
    for (const one of changes.slice(-MOST).reverse()) {
      const row = make('tr', this.changes);
      make('th', row, `step ${one.step}`, {scope: 'row'});
      make('td', row, Object.entries(one.changes).map(([name, value]) =>
        `${one.unit}.${name} = ${typeof value === 'number' ? plain(value) : value}`).join(', '));
    }
  }
}
