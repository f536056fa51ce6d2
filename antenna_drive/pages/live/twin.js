// The twins: whether drive and twin agree, the verdict as it grows, and the next test.
import {colour, dark, levelClass, make, say} from './elements.js';
import {ago, REPORT_S} from './freshness.js';
import {lines} from './verdict_chart.js';

const SHOWN = 6;

export class Twin {
  constructor(link) {
    Object.assign(this, {link, cards: new Map()});
    this.holder = document.getElementById('twin');
    this.none = make('p', this.holder, 'No twin reports. Start one beside the drive: ros2 run '
      + 'antenna_drive twin --ros-args -p real:=/elevation -p verdict:=true', {class: 'small'});
    setInterval(() => this.age(), 1000);
    dark.addEventListener('change', () => {
      for (const card of this.cards.values()) card.paint();
    });
  }

  takes() {
    return {twin: told => this.report(told)};
  }

  report(told) {
    this.none.hidden = true;
    if (!this.cards.has(told.name))
      this.cards.set(told.name, new Card(this.holder, told.name, this.link));
    this.cards.get(told.name).show(told);
  }

  age() {
    for (const card of this.cards.values()) card.age();
  }
}

// One twin.
class Card {
  constructor(holder, name, link) {
    Object.assign(this, {name, link, verdict: null, heard: 0, reports: 0});
    const card = this.card = make('section', holder, '', {class: 'twin', 'aria-label': `twin ${name}`});
    make('h2', card, name);
    this.silent = make('p', card, '', {class: 'silent level-ERROR'});
    this.state = make('p', card, '', {role: 'status'});
    this.gaps = make('table', card);
    this.about = make('p', card, '', {class: 'small'});
    make('h2', card, 'Verdict');
    this.said = make('p', card, 'none yet; verdict:=true asks for one', {class: 'said'});
    this.chart = make('div', card, '', {class: 'growing'});
    this.answers = make('table', card, '', {class: 'answers'});
    const row = make('div', card, '', {class: 'fields'});
    this.button(row, 'Another test begins', {do: 'twin', name, act: 'begin_test'},
                'the drive has to stand still now');
    this.button(row, 'Design the next test', {do: 'twin', name, act: 'propose'},
                'some minutes of a core');
    this.next = make('div', card, '', {hidden: ''});
    make('h2', this.next, 'Next test');
    this.lines = make('p', this.next, '', {class: 'lines'});
    this.sheet = make('pre', this.next);
    this.play = this.button(make('div', this.next, '', {class: 'fields'}),
                            'Play it on the drive of this page', {do: 'play', twin: name},
                            'with a new run; circuit and bias are for you to set');
  }

  button(row, text, request, title) {
    const found = make('button', row, text, {type: 'button', title});
    found.addEventListener('click', async () => {
      const told = await this.link.order(request);
      if (told.ok) say(told.result);
    });
    return found;
  }

  show(told) {
    if (told.reports !== this.reports) this.heard = performance.now();
    this.reports = told.reports;
    this.state.textContent = told.message;
    this.state.className = levelClass(told.level);
    this.gaps.replaceChildren();
    for (const [key, value] of Object.entries(told.values).filter(([k]) => k.startsWith('gap '))) {
      const row = make('tr', this.gaps);
      make('th', row, key.slice(4), {scope: 'row'});
      make('td', row, value.replace(/^[^:]*: /, '').replace(/, since stamp.*$/, ''));
    }
    const {values} = told;
    this.about.textContent = `watched: ${values.watched}; tuning: ${values.tuning}; judged: `
      + `${values['blocks judged']} s; false alarms a day: ${values['false alarms per day']}`;
    this.showNext(told.next_test);
    if (JSON.stringify(told.verdict) === JSON.stringify(this.verdict)) return;
    this.verdict = told.verdict;
    this.paint();
  }

  age() {
    const seconds = (performance.now() - this.heard) / 1000, late = seconds > REPORT_S;
    this.silent.textContent = late ? `no report for ${ago(seconds)}; what follows is the last` : '';
    this.card.classList.toggle('stale', late);
  }

  paint() {
    const {verdict} = this;
    if (!verdict) return;
    this.said.textContent = verdict.fault || verdict.say;
    this.said.classList.toggle('level-OK', verdict.decided && !verdict.fault);
    const last = verdict.looks.at(-1)?.probabilities ?? {};
    const most = name => Math.max(...verdict.looks.map(look => look.probabilities[name] ?? 0));
    const names = [...new Set(verdict.looks.flatMap(look => Object.keys(look.probabilities)))]
      .sort((a, b) => (last[b] ?? 0) - (last[a] ?? 0) || most(b) - most(a)).slice(0, SHOWN);
    this.chart.replaceChildren(lines(
      verdict.looks.map(look => look.seconds),
      names.map((name, n) => [colour(n), verdict.looks.map(look => look.probabilities[name] ?? 0)])));
    this.answers.replaceChildren();
    names.forEach((name, n) => {
      const row = make('tr', this.answers);
      const cell = make('th', row, '', {scope: 'row'});
      make('i', cell, '', {style: `background: ${colour(n)}`});
      cell.append(name === 'none' ? 'no gap' : name);
      make('td', row, `${(100 * (last[name] ?? 0)).toFixed(1)} %`, {class: 'n'});
    });
  }

  showNext(next) {
    this.next.hidden = !next;
    if (!next) return;
    this.lines.textContent = next.under_way ? 'is being designed …'
      : next.fault || next.say.join('\n');
    this.sheet.textContent = next.sheet;
    this.sheet.hidden = !next.sheet;
    this.play.hidden = !next.test;
  }
}
