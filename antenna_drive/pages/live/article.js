// The article's experiments as buttons; what it has published is drawn into the charts.
import {make, say} from './elements.js';

export class Article {
  constructor(link, charts) {
    Object.assign(this, {link, charts, experiments: [], running: null});
    const holder = document.getElementById('article');
    make('p', holder, 'Each button sets the drive as in the article and begins a new run. Published '
      + 'levels are drawn into the charts.', {class: 'small'});
    this.cards = make('div', holder, '', {class: 'cards'});
    this.claims = make('div', holder);
  }

  takes() {
    return {
      hello: told => { this.experiments = told.experiments; this.build(); },
      experiment: told => this.show(told.name),
    };
  }

  build() {
    this.cards.replaceChildren();
    this.buttons = new Map(this.experiments.map(one => {
      const button = make('button', this.cards, '', {type: 'button', 'aria-pressed': 'false'});
      make('b', button, one.title);
      make('span', button, `${one.name}, ${one.figures}`, {class: 'small'});
      button.addEventListener('click', () => this.begin(one));
      return [one.name, button];
    }));
    this.show(this.running);
  }

  async begin(one) {
    say(`${one.title} …`);
    const told = await this.link.order({do: 'experiment', name: one.name});
    if (told.ok) say(`${one.title}: ${told.result}`);
  }

  show(name) {
    this.running = name;
    const one = this.experiments.find(each => each.name === name);
    for (const [key, button] of this.buttons || [])
      button.setAttribute('aria-pressed', String(key === name));
    this.charts.setLevels(one ? one.levels : []);
    this.claims.replaceChildren();
    if (!one) return;
    make('h2', this.claims, `What the article says of ${one.title.toLowerCase()}`);
    const table = make('table', this.claims);
    for (const claim of one.claims) {
      const row = make('tr', table);
      make('th', row, claim.what, {scope: 'row'});
      const cell = make('td', row, claim.says);
      make('div', cell, claim.note, {class: 'small'});
    }
  }
}
