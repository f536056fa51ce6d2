// The article's experiments as buttons; what it has published is drawn into the charts.
import {digits, make, say} from './elements.js';

export class Article {
  constructor(link, charts) {
    Object.assign(this, {link, charts, experiments: [], running: null, obtained: null, changes: []});
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
      obtained: told => { this.obtained = told; this.fill(); },
      changes: told => { this.changes = told.changes; this.fill(); },
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
    this.fill();
  }

  // What is published beside what the run on this page has given.
  fill() {
    const one = this.experiments.find(each => each.name === this.running);
    this.claims.replaceChildren();
    if (!one) return;
    const {run, figures} = this.obtained?.name === one.name ? this.obtained : {run: 0, figures: {}};
    make('h2', this.claims, `${one.title}: what the article says, and this run`);
    const table = make('table', this.claims, '', {class: 'claims'});
    const head = make('tr', table);
    for (const name of ['', 'published', 'obtained']) make('th', head, name, {scope: 'col'});
    for (const claim of one.claims) {
      const row = make('tr', table, '', {title: claim.note, 'data-measure': claim.measure});
      make('th', row, claim.what, {scope: 'row'});
      make('td', row, claim.says.replaceAll(' percent', ' %'));
      const value = figures[claim.measure], unit = claim.unit === 'percent' ? '%' : claim.unit;
      make('td', row, typeof value === 'number' ? `${digits(value, 3)} ${unit}`
        : run ? 'not known' : '…');
    }
    const changed = this.changes.filter(change => change.run === run).length;
    make('p', this.claims, !run ? `Obtained after ${one.duration.toFixed(0)} s of the run.`
      : `Obtained from the first ${one.duration.toFixed(0)} s of this run`
        + (changed ? `, in which parameters were changed ${changed} times.` : '.')
        + (Object.values(figures).includes(null) ? ' Not known: steps were missed, or the run of '
          + 'the other experiment was not seen.' : ''), {class: 'small'});
    const notes = make('details', this.claims);
    make('summary', notes, 'where it is in the article, and how it is read');
    for (const claim of one.claims) make('p', notes, `${claim.what}: ${claim.note}`, {class: 'small'});
  }
}
