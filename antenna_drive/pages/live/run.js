// Run control and recording: the buttons at the top, and their keys.
import {say} from './elements.js';
import {readNumber} from './typed.js';

export class Run {
  constructor(link, samples, freshness) {
    Object.assign(this, {link, samples, freshness, state: 'waiting', at: 0, connected: false});
    const get = id => document.getElementById(id);
    this.pill = get('state');
    this.clock = get('clock');
    this.pauseButton = get('pause');
    this.stepButton = get('step');
    this.steps = get('steps');
    this.pace = get('pace');
    this.record = get('record');
    this.pauseButton.addEventListener('click', () => this.pause());
    this.stepButton.addEventListener('click', () => this.step());
    get('reset').addEventListener('click', () => this.reset());
    this.record.addEventListener('click', () => this.toggleRecord());
    this.pace.addEventListener('change', () => this.askPace(Number(this.pace.value)));
    addEventListener('keydown', event => this.key(event));
    setInterval(() => this.show(), 100);
  }

  takes() {
    return {
      state: told => { [this.state, this.at] = [told.state, told.step]; this.show(); },
      open: is => { this.connected = is; this.show(); },
      drive: told => { this.ready = told.ready; },
      own: told => { if (told.unit === 'test_signal') this.setPace(told.values['run.pace']); },
      parameters: told => {
        const pace = told.entries.find(entry => entry.name === 'run.pace');
        if (pace && told.unit === 'test_signal') this.setPace(pace.value);
      },
      recorder: told => this.setRecorder(told),
    };
  }

  async askPace(pace) {
    const told = await this.link.order({do: 'set', unit: 'test_signal', values: {'run.pace': pace}});
    this.setPace(told.ok ? pace : this.inForce);
  }

  setPace(pace) {
    if (pace === undefined) return;
    this.inForce = pace;
    const text = String(pace);
    if (![...this.pace.options].some(option => option.value === text))
      this.pace.add(new Option(text, text));
    this.pace.value = text;
  }

  // State for people, and the colour that it has.
  said() {
    const {samples, freshness: {missing}} = this;
    if (!this.connected) return ['lost', missing ? 'no connection' : 'connecting'];
    if (missing === 'start' || (!this.ready && !samples.arrived)) return ['waiting', 'starting'];
    if (missing) return ['lost', missing === 'steps' ? 'no steps come' : 'stale'];
    return [this.state, this.state];
  }

  show() {
    const {samples} = this, [state, text] = this.said();
    if (this.pill.textContent !== text) this.pill.textContent = text;
    this.pill.dataset.state = state;
    const clock = `${(samples.time || 0).toFixed(samples.time >= 1000 ? 1 : 3)} s`;
    if (this.clock.textContent !== clock) this.clock.textContent = clock;
    const paused = this.state === 'paused';
    this.pauseButton.textContent = paused ? 'Go on' : 'Pause';
    this.stepButton.disabled = this.steps.disabled = !paused;
  }

  pause() {
    this.link.order({do: 'run', service: this.state === 'paused' ? 'resume' : 'pause'});
  }

  step() {
    if (this.state !== 'paused') return;
    const {value, reason} = readNumber(this.steps.value, true);
    if (reason) say(`Step: ${reason}`);
    else this.link.order({do: 'run', service: 'step', steps: value});
  }

  reset() { this.link.order({do: 'run', service: 'reset'}); }

  async toggleRecord() {
    const on = this.record.getAttribute('aria-pressed') !== 'true';
    const name = document.getElementById('record-name')?.value || '';
    const told = await this.link.order({do: 'record', on, name: on ? name : ''});
    if (told.ok) say(on ? `recording to ${told.result}` : told.result);
  }

  setRecorder(told) {
    this.record.setAttribute('aria-pressed', String(told.running));
    this.record.lastChild.textContent = told.running
      ? `Stop, ${(told.bytes / 1e6).toFixed(1)} MB` : 'Record';
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest('input, select, textarea, summary')) return;
    const act = {' ': () => this.pause(), '.': () => this.step(), r: () => this.reset(),
                 b: () => this.toggleRecord()}[event.key.toLowerCase()];
    if (!act || (event.key === ' ' && event.target.closest('button'))) return;
    event.preventDefault();
    act();
  }
}
