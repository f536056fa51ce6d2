// Recordings: make one, load one beside the live curves, play a test sheet.
import {make, say} from './elements.js';

export class Tapes {
  constructor(link, charts, samples) {
    Object.assign(this, {link, charts, samples, tape: null});
    const holder = document.getElementById('tapes');
    make('h2', holder, 'Record');
    const row = make('div', holder, '', {class: 'fields'});
    this.name = make('input', row, '', {id: 'record-name', type: 'text',
      placeholder: 'name, or date and time', 'aria-label': 'name of the recording'});
    const record = make('button', row, 'Record or stop', {type: 'button'});
    record.addEventListener('click', () => document.getElementById('record').click());
    this.recorded = make('p', holder, '', {class: 'small'});
    make('h2', holder, 'Beside the live curves');
    const load = make('div', holder, '', {class: 'fields'});
    this.path = make('input', load, '', {type: 'text', list: 'recordings',
      placeholder: 'bag, .mcap or .csv on this machine', 'aria-label': 'recording to load'});
    this.list = make('datalist', load, '', {id: 'recordings'});
    const loading = make('button', load, 'Load', {type: 'button'});
    loading.addEventListener('click', () => this.load());
    this.path.addEventListener('focus', () => this.fill());
    this.path.addEventListener('keydown', event => { if (event.key === 'Enter') this.load(); });
    const place = make('div', holder, '', {class: 'fields'});
    this.buttons = [['At the run’s start', () => 0], ['From now on', () => this.samples.time]].map(
      ([text, start]) => {
        const button = make('button', place, text, {type: 'button', disabled: ''});
        button.addEventListener('click', () => this.put(start()));
        return button;
      });
    this.off = make('button', place, 'Remove', {type: 'button', disabled: ''});
    this.off.addEventListener('click', () => { this.tape = null; this.put(0); });
    this.loaded = make('p', holder, '', {class: 'small'});
    make('h2', holder, 'Play a test sheet');
    const sheet = make('div', holder, '', {class: 'fields'});
    this.sheet = make('input', sheet, '', {type: 'text', placeholder: 'sheet.yaml on this machine',
      'aria-label': 'test sheet to play'});
    make('button', sheet, 'Play', {type: 'button'}).addEventListener('click', () => this.play());
    make('p', holder, 'Its waveform begins with a new run. Circuit and bias of the sheet are for you '
      + 'to set.', {class: 'small'});
  }

  takes() {
    return {
      recorder: told => {
        this.recorded.textContent = told.running ? `recording to ${told.path}`
          : told.said || `recordings go to ${told.folder}`;
      },
    };
  }

  async fill() {
    const told = await this.link.ask({do: 'recordings'});
    if (told.ok) this.list.replaceChildren(...told.result.map(path => new Option(path, path)));
  }

  async load() {
    if (!this.path.value) return;
    const told = await this.link.order({do: 'load', path: this.path.value});
    if (!told.ok) return;
    this.tape = told.result;
    this.put(0);
  }

  put(start) {
    const {tape} = this;
    this.charts.setTape(tape && {...tape, start});
    for (const button of [...this.buttons, this.off]) button.disabled = !tape;
    this.loaded.textContent = tape ? `${tape.name}: ${tape.duration.toFixed(2)} s, `
      + `${Object.keys(tape.curves).length} signals, drawn dotted from ${start.toFixed(2)} s on` : '';
  }

  async play() {
    if (!this.sheet.value) return;
    const told = await this.link.order({do: 'play', path: this.sheet.value});
    if (told.ok) say('the sheet is played in a new run');
  }
}
