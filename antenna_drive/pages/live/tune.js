// Every tuning parameter that is not part of a test signal, and the constants of each node to read.
import {make, plain} from './elements.js';
import {Knob} from './knob.js';

const TITLES = {torque_share: 'Torque share and Filter 1', test_signal: 'Test signal',
                motor_1: 'Motor 1', motor_2: 'Motor 2', plant: 'Plant'};
const ORDER = ['torque_share', 'motor_1', 'motor_2', 'plant', 'test_signal'];
// at the top of the page or on a tab of their own
const ELSEWHERE = /^(run\.|publish_rate$)/;
const WAVE = /^(torque\.)?(waveform|amplitude|offset|period|phase|start_after|sweep_\w+|frequencies|weights|phases|bit_time|external|knot_\w+)$/;

export const isWave = (unit, name) => unit === 'test_signal' && WAVE.test(name);

export class Tune {
  constructor(link) {
    this.link = link;
    this.holder = document.getElementById('tune');
    this.sections = new Map();
    this.knobs = new Map();
  }

  takes() {
    return {
      hello: () => { if (!this.sections.size) this.build(); },
      parameters: told => this.fill(told.unit, told.entries),
      values: told => this.update(told.unit, told.values),
      own: told => this.update(told.unit, told.values),
    };
  }

  build() {
    this.holder.replaceChildren();
    for (const unit of ORDER) this.sections.set(unit, make('section', this.holder));
    make('p', this.sections.get('torque_share'), 'waiting for the drive’s parameters …',
         {class: 'small'});
  }

  fill(unit, entries) {
    const section = this.sections.get(unit);
    section.replaceChildren();
    make('h2', section, TITLES[unit]);
    const send = values => this.link.ask({do: 'set', unit, values});
    const live = entries.filter(entry => entry.live && !isWave(unit, entry.name));
    for (const entry of live.filter(one => !ELSEWHERE.test(one.name))) this.add(unit, section, entry, send);
    const more = make('details', section);
    make('summary', more, 'node and constants');
    for (const entry of live.filter(one => ELSEWHERE.test(one.name))) this.add(unit, more, entry, send);
    const table = make('table', make('div', more));
    for (const entry of entries.filter(one => !one.live)) {
      const row = make('tr', table, '', {title: `${entry.text}; allowed is ${entry.allowed}`});
      make('th', row, entry.name, {scope: 'row'});
      const value = typeof entry.value === 'number' ? plain(entry.value * entry.factor)
        : [].concat(entry.value).map(one => typeof one === 'number' ? plain(one * entry.factor) : one).join(', ');
      make('td', row, `${value} ${entry.unit === '1' ? '' : entry.unit || ''}`, {class: 'n'});
    }
  }

  add(unit, parent, entry, send) {
    this.knobs.set(`${unit}/${entry.name}`, new Knob(parent, entry, send));
  }

  update(unit, values) {
    for (const [name, value] of Object.entries(values))
      this.knobs.get(`${unit}/${name}`)?.told(value);
  }
}
