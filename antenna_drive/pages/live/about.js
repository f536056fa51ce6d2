// Whose drive this is: its namespace, its configuration and the experiment, under the title.
export class About {
  constructor() {
    this.line = document.getElementById('about');
    Object.assign(this, {namespace: null, configurations: new Map(), experiments: [], experiment: null});
  }

  takes() {
    return {
      hello: told => {
        [this.namespace, this.experiments, this.own] = [told.namespace, told.experiments, told.own];
        this.show();
      },
      experiment: told => { this.experiment = told.name; this.show(); },
      parameters: told => {
        const config = told.entries.find(entry => entry.name === 'config');
        if (config) this.configurations.set(told.unit, [].concat(config.value).join(' + '));
        this.show();
      },
    };
  }

  // Nodes that were started by hand may have read different files.
  configuration() {
    const by = new Map();
    for (const [unit, files] of this.configurations) by.set(files, [...by.get(files) || [], unit]);
    if (!by.size) return '…';
    return by.size === 1 ? [...by.keys()][0]
      : [...by].map(([files, units]) => `${files} (${units.join(', ')})`).join('; ');
  }

  show() {
    if (this.namespace === null) return;
    const one = this.experiments.find(each => each.name === this.experiment);
    const experiment = one ? `${one.name}, ${one.title.toLowerCase()}` : 'none of the article’s';
    this.line.replaceChildren();
    for (const [name, value] of [['namespace', this.namespace],
                                 ['configuration', this.configuration()],
                                 ['experiment', experiment]]) {
      const part = this.line.appendChild(document.createElement('span'));
      part.append(`${name} `);
      part.appendChild(document.createElement('b')).textContent = value;
    }
    document.title = `${this.namespace === '/' ? '' : `${this.namespace} `}antenna_drive live`;
  }
}
