// The test signals: a draft with a preview, and Apply, which puts all of it in force at one step.
import {colour, css, dark, digits, make, plain} from './elements.js';
import {Knob} from './knob.js';
import {isWave} from './tune.js';

// Which parameters a waveform uses.
const PERIODIC = ['amplitude', 'offset', 'period', 'phase', 'start_after'];
const USES = {
  zero: ['offset'], square: PERIODIC, saw_tooth: PERIODIC, saw_tooth_jump: PERIODIC, sine: PERIODIC,
  step: ['amplitude', 'offset', 'start_after'],
  chirp: ['amplitude', 'offset', 'start_after', 'sweep_from', 'sweep_to', 'sweep_time'],
  multisine: ['amplitude', 'offset', 'start_after', 'frequencies', 'weights', 'phases'],
  prbs: ['amplitude', 'offset', 'start_after', 'bit_time'], external: ['offset'],
  knots: ['amplitude', 'offset', 'start_after', 'knot_times', 'knot_values'],
};

export class Signal {
  constructor(link) {
    this.link = link;
    this.holder = document.getElementById('signal');
    this.forms = [new Form(link, '', 'Rate command', this.holder),
                  new Form(link, 'torque.', 'Torque on the axis', this.holder)];
    const draw = () => this.forms.forEach(form => form.draw());
    addEventListener('resize', draw);
    dark.addEventListener('change', draw);
  }

  takes() {
    return {
      parameters: told => {
        if (told.unit === 'test_signal') this.forms.forEach(form => form.fill(told.entries));
      },
      values: told => {
        if (told.unit === 'test_signal') this.forms.forEach(form => form.told(told.values));
      },
    };
  }
}

class Form {
  constructor(link, prefix, title, holder) {
    Object.assign(this, {link, prefix, knobs: new Map(), draft: {}, shown: null});
    this.section = make('section', holder, '', {'data-signal': prefix || 'rate'});
    make('h2', this.section, title);
    this.body = make('div', this.section);
    this.canvas = make('canvas', this.section, '', {class: 'preview', role: 'img'});
    this.note = make('p', this.section, '', {class: 'small'});
    this.refused = make('p', this.section, '', {class: 'refused', role: 'alert'});
    const row = make('div', this.section, '', {class: 'fields'});
    this.apply = make('button', row, 'Apply', {type: 'button', class: 'main', disabled: ''});
    this.revert = make('button', row, 'Revert', {type: 'button', disabled: ''});
    this.apply.addEventListener('click', () => this.send());
    this.revert.addEventListener('click', () => { this.draft = {}; this.reset(); });
  }

  fill(entries) {
    this.body.replaceChildren();
    this.knobs.clear();
    this.draft = {};
    for (const entry of entries) {
      if (!isWave('test_signal', entry.name)) continue;
      if (entry.name.startsWith('torque.') !== (this.prefix !== '')) continue;
      const key = entry.name.slice(this.prefix.length);
      if (key === 'external') continue;
      const keep = async values => {
        Object.assign(this.draft, values);
        this.changed();
        return {ok: true};
      };
      this.knobs.set(key, new Knob(this.body, {...entry, inForce: entry.value}, keep,
                                   key.replaceAll('_', ' ')));
    }
    const first = this.knobs.get('waveform');
    if (first) this.body.prepend(first.element);
    this.changed();
  }

  told(values) {
    for (const [key, knob] of this.knobs) {
      const value = values[this.prefix + key];
      if (value === undefined) continue;
      knob.entry.inForce = value;
      if (!(this.prefix + key in this.draft)) knob.told(value);
    }
    this.changed();
  }

  reset() {
    for (const knob of this.knobs.values()) knob.told(knob.entry.inForce);
    this.changed();
  }

  changed() {
    if (!this.knobs.has('waveform')) return;
    const waveform = this.knobs.get('waveform').value, uses = USES[waveform];
    for (const [key, knob] of this.knobs)
      knob.element.hidden = key !== 'waveform' && uses !== undefined && !uses.includes(key);
    const differs = [...this.knobs.values()].some(
      knob => JSON.stringify(knob.value) !== JSON.stringify(knob.entry.inForce));
    this.apply.disabled = this.revert.disabled = !differs;
    this.preview(waveform);
  }

  async preview(waveform) {
    const values = {};
    for (const [key, knob] of this.knobs) values[key] = knob.value;
    const span = waveform === 'chirp' ? Math.min(600, values.start_after + 1.1 * values.sweep_time)
      : waveform === 'multisine' ? 10 : waveform === 'prbs' ? Math.min(600, 60 * values.bit_time)
        : Math.min(600, (values.start_after || 0) + 2.5 * (values.period || 4));
    const asked = JSON.stringify({values, span});
    if (asked === this.asked) return;
    this.asked = asked;
    const told = await this.link.ask({do: 'preview', values, span});
    if (asked !== this.asked) return;
    this.refused.textContent = told.ok ? '' : told.reason.replace(/^rate\./, '');
    this.shown = told.ok ? told.result : null;
    this.draw();
  }

  draw() {
    const {canvas, shown} = this, scale = devicePixelRatio;
    const width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    [canvas.width, canvas.height] = [width * scale, height * scale];
    const ctx = canvas.getContext('2d');
    ctx.scale(scale, scale);
    this.note.textContent = '';
    if (!shown) return;
    const {unit, factor} = this.knobs.get('amplitude').entry;
    const low = Math.min(0, ...shown.low), high = Math.max(0, ...shown.high);
    const room = (high - low) * 0.08 || 1, span = high - low + 2 * room;
    const y = value => height * (high + room - value) / span;
    ctx.strokeStyle = css('--line');
    ctx.beginPath();
    ctx.moveTo(0, y(0));
    ctx.lineTo(width, y(0));
    ctx.stroke();
    ctx.strokeStyle = colour(this.prefix ? 1 : 0);
    ctx.lineWidth = 1.5;
    ctx.beginPath();
    shown.low.forEach((value, n) => {
      const x = width * (n + 0.5) / shown.low.length;
      ctx.lineTo(x, y(value));
      ctx.lineTo(x, y(shown.high[n]));
    });
    ctx.stroke();
    this.note.textContent = `preview of ${plain(shown.span)} s, from ${digits(low * factor, 3)} to `
      + `${digits(high * factor, 3)} ${unit}`;
  }

  async send() {
    const values = {};
    for (const [key, knob] of this.knobs)
      if (JSON.stringify(knob.value) !== JSON.stringify(knob.entry.inForce))
        values[this.prefix + key] = knob.value;
    const told = await this.link.ask({do: 'set', unit: 'test_signal', values});
    this.refused.textContent = told.ok ? '' : told.reason;
    if (told.ok) this.draft = {};
  }
}
