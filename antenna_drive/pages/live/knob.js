// One parameter: a slider and a field, a switch, a choice or a list. A change is sent at once; while
// one is on its way only the newest value waits. What is refused returns to the value in force.
import {make, plain} from './elements.js';
import {readNumber, readNumbers} from './typed.js';

let count = 0;

export class Knob {
  // `send` takes SI values by name and returns a promise of {ok, reason}.
  constructor(parent, entry, send, label = '') {
    Object.assign(this, {entry, send, busy: false, waiting: null, value: entry.value, typing: false});
    const id = `knob-${++count}`;
    this.element = make('div', parent, '', {class: 'knob', 'data-name': entry.name});
    const name = make('div', this.element, '', {class: 'name'});
    make('label', name, label || entry.name, {for: id, title: entry.text});
    this.entryElement = make('span', name, '', {class: 'entry'});
    const makers = {number: () => this.makeNumber(id), choice: () => this.makeChoice(id),
                    flag: () => this.makeChoice(id), list: () => this.makeText(id),
                    text: () => this.makeText(id)};
    makers[entry.kind]();
    make('div', this.element, entry.text, {class: 'small'});
    this.refused = make('div', this.element, '', {class: 'refused', role: 'alert'});
    this.show(entry.value);
  }

  makeNumber(id) {
    const {entry} = this;
    this.field = this.makeField({id, class: 'number', inputmode: 'decimal'}, text => {
      const {value, reason} = readNumber(text, entry.whole);
      return {value: value / entry.factor, reason};
    });
    make('span', this.entryElement, entry.unit === '1' ? '' : entry.unit, {class: 'unit'});
    this.slider = make('input', this.element, '', {
      type: 'range', 'aria-label': `${entry.name} slider`});
    const ends = make('div', this.element, '', {class: 'ends'});
    this.ends = [make('span', ends), make('span', ends)];
    this.reach(entry.from, entry.to);
    this.slider.addEventListener('input', () => this.ask(Number(this.slider.value) / entry.factor, true));
  }

  reach(from, to) {
    const {factor, whole} = this.entry;
    [this.from, this.to] = [from * factor, to * factor];
    const {slider} = this;
    slider.min = this.from;
    slider.max = this.to;
    slider.step = whole ? 1 : (this.to - this.from) / 1000;
    this.ends[0].textContent = plain(this.from);
    this.ends[1].textContent = plain(this.to);
  }

  makeChoice(id) {
    const {entry} = this, choices = entry.kind === 'flag' ? [false, true] : entry.choices;
    if (choices.length === 2) {
      const group = make('span', this.entryElement, '', {class: 'switch', role: 'group', id});
      this.buttons = choices.map(choice => {
        const button = make('button', group, String(choice), {type: 'button'});
        button.addEventListener('click', () => this.ask(choice));
        return [choice, button];
      });
      return;
    }
    this.select = make('select', this.entryElement, '', {id});
    for (const choice of choices) this.select.add(new Option(choice.replaceAll('_', ' '), choice));
    this.select.addEventListener('change', () => this.ask(this.select.value));
  }

  makeText(id) {
    const {entry} = this;
    this.text = this.makeField({id}, text => {
      if (entry.kind === 'text') return {value: text};
      const {values, reason} = readNumbers(text);
      return {value: values?.map(one => one / entry.factor), reason};
    });
    if (entry.unit && entry.unit !== '1') make('span', this.entryElement, entry.unit, {class: 'unit'});
  }

  // A field to type into; `read` returns {value} or {reason} for a text.
  makeField(attributes, read) {
    const field = make('input', this.entryElement, '', {
      ...attributes, type: 'text', autocomplete: 'off', spellcheck: 'false',
      title: `allowed is ${this.entry.allowed}`});
    const ended = () => { this.typing = false; };
    field.addEventListener('input', () => { this.typing = true; });
    field.addEventListener('change', () => {
      ended();
      const {value, reason} = read(field.value);
      if (reason) this.refuse(reason);
      else this.ask(value);
    });
    field.addEventListener('blur', ended);
    return field;
  }

  refuse(reason) {
    this.refused.textContent = reason;
    this.show(this.entry.value);
  }

  // Sends a value, or keeps it until the one before is answered.
  async ask(value, dragging = false) {
    this.value = value;
    if (!dragging || this.field) this.show(value);
    if (this.busy) {
      this.waiting = {value};
      return;
    }
    this.busy = true;
    const told = await this.send({[this.entry.name]: value});
    this.busy = false;
    if (told.ok) {
      this.refused.textContent = '';
      this.entry.value = value;
    } else this.refuse(told.reason);
    if (this.waiting) {
      const {value: next} = this.waiting;
      this.waiting = null;
      this.ask(next, dragging);
    }
  }

  // What the node says is in force.
  told(value) {
    this.entry.value = value;
    if (!this.busy && !this.waiting) this.show(value);
  }

  show(value) {
    const {entry, field, slider} = this;
    this.value = value;
    this.element.classList.toggle('draft', 'inForce' in entry
      && JSON.stringify(value) !== JSON.stringify(entry.inForce));
    if (field) {
      const shown = value * entry.factor;
      if (!this.typing) field.value = plain(shown);
      if (shown < this.from || shown > this.to)
        this.reach(Math.min(this.from, shown) / entry.factor, Math.max(this.to, shown) / entry.factor);
      if (slider.value !== String(shown)) slider.value = shown;
      slider.setAttribute('aria-valuetext', `${plain(shown)} ${entry.unit}`);
    } else if (this.buttons) {
      for (const [choice, button] of this.buttons)
        button.setAttribute('aria-pressed', String(choice === value));
    } else if (this.select) this.select.value = value;
    else if (!this.typing)
      this.text.value = Array.isArray(value) ? value.map(one => plain(one * entry.factor)).join(', ')
        : String(value);
  }
}
