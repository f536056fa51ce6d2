// Draws the panels of #data into #panels with uPlot: of each group, which shows one span of time,
// those of a signal. Wheel, mouse, finger, keys and buttons zoom and move; what is at the cursor
// stands beside the names. Where there are signals or several groups to choose from, #choice asks.
'use strict';
(() => {
  const LEFT = 64, RIGHT = 12, HEIGHT = 176;   // of a panel, margins and height [px]
  const FINEST = 1e-6;                         // shortest span of time shown [s]
  const BUTTONS = [   // sign, name and key
    ['←', 'earlier', 'ArrowLeft'], ['−', 'zoom out', '-'], ['+', 'zoom in', '+'],
    ['→', 'later', 'ArrowRight'], ['all', 'everything', '0'],
  ];
  const root = document.documentElement;
  const holder = document.getElementById('panels');
  const colour = name => () => getComputedStyle(root).getPropertyValue(name);

  function make(name, parent, text = '') {
    const element = document.createElement(name);
    element.textContent = text;
    parent.append(element);
    return element;
  }

  function decode(text, Kind) {
    return new Kind(Uint8Array.from(atob(text), letter => letter.charCodeAt(0)).buffer);
  }

  function makeCurve(given) {
    const shares = decode(given.values, Float32Array);
    const times = given.times === null ? null : decode(given.times, Float64Array);
    const since = i => times ? times[i] : i * (given.step || 0);
    const of = value => Float64Array.from(shares, (share, i) => value(i, share));
    return { ...given, times: of(i => given.start + since(i)),
             values: of((i, share) => given.base + given.scale * share) };
  }

  // numbers along an axis: as many digits as the step between them needs, which are many for the
  // time of a clock
  function numbers(plot, values, axis, space, step) {
    let digits = 0;
    while (digits < 9 && Math.abs(step * 10 ** digits % 1 - 0.5) < 0.499999) digits++;
    const short = value => Math.abs(value) < 300 * step && value !== 0;
    return values.map(value => short(value) && (Math.abs(value) >= 1e6 || step < 1e-5)
      ? value.toExponential(2) : value.toFixed(digits));
  }

  function roomy(plot, low, high) {
    if (low === null || !(high >= low)) return [-1, 1];
    const room = high > low ? 0.06 * (high - low) : Math.abs(high) * 0.1 || 1;
    return [low - room, high + room];
  }

  function makePanel(given, group, isLast) {
    const element = make('section', group.element);
    element.className = 'panel';
    const head = make('div', element);
    head.className = 'head';
    make('b', head, given.unit === '1' ? given.title : `${given.title} [${given.unit}]`);
    const curves = given.curves.map(makeCurve);
    const values = curves.map((curve, number) => {
      const button = make('button', head);
      button.type = 'button';
      button.setAttribute('aria-pressed', 'true');
      make('i', button).style.background = curve.colour;
      button.addEventListener('click', () => {
        const shown = !plot.series[number + 1].show;
        button.setAttribute('aria-pressed', String(shown));
        plot.setSeries(number + 1, { show: shown });
      });
      make('span', button, curve.name);
      return make('samp', button);
    });
    const axis = { stroke: colour('--faint'), font: '11px system-ui, sans-serif', values: numbers,
                   labelFont: '11px system-ui, sans-serif', ticks: { show: false },
                   grid: { stroke: colour('--line'), width: 1 } };
    const spread = (plot, axis, low, high) => 45 + 7 * Math.max(0, Math.log10(Math.abs(high)));
    const height = HEIGHT + (isLast ? 18 : 0);
    const plot = new uPlot({
      width: element.clientWidth, height, padding: [8, RIGHT, 0, 0], legend: { show: false },
      scales: { x: { time: false }, y: { range: roomy } },
      axes: [{ ...axis, size: 22, gap: 4, space: spread,
               ...(isLast && { label: 'time [s]', labelSize: 18 }) },
             { ...axis, size: LEFT, gap: 6, space: 26 }],
      series: [{}, ...curves.map(curve => ({ stroke: curve.colour, width: curve.width, spanGaps: true,
                                             points: { size: 4, fill: curve.colour } }))],
      cursor: { y: false, points: { show: false }, sync: { key: group.name },
                drag: { x: false, y: false, setScale: false },
                bind: { dblclick: () => () => group.all() } },
      hooks: { setCursor: [tell] },
    }, uPlot.join(curves.map(curve => [curve.times, curve.values])), element);
    plot.ctx.canvas.setAttribute('role', 'img');
    plot.ctx.canvas.setAttribute('aria-label',
      `${given.title}: ${curves.map(curve => curve.name).join(', ')}`);

    // beside each name its sample nearest to the cursor
    function tell(plot) {
      const left = plot.cursor.left, t = left < 0 ? null : plot.posToVal(left, 'x');
      curves.forEach((curve, number) => {
        values[number].textContent =
          t === null ? '' : curve.values[closest(t, curve.times)].toPrecision(5);
      });
      group.at.textContent = t === null ? '' : `values at ${t.toFixed(digitsOf(group.span))} s`;
    }

    listenTo(plot, group, () => { active = group; });
    return { plot, curves, resize: () => plot.setSize({ width: element.clientWidth, height }) };
  }

  // decimals that tell a thousandth of a span apart
  function digitsOf([from, to]) {
    return Math.min(Math.max(3 - Math.floor(Math.log10(to - from)), 0), 9);
  }

  function closest(t, times) {
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (times[middle] < t) low = middle + 1; else high = middle;
    }
    return low > 0 && t - times[low - 1] < times[low] - t ? low - 1 : low;
  }

  function makeGroup(name, given) {
    const element = make('section', holder);
    const group = { name: name || 'all', element, span: [0, 1] };
    element.className = 'group';
    element.setAttribute('aria-label', name || 'curves');
    if (names.length > 1) element.tabIndex = 0;
    element.addEventListener('focusin', () => { active = group; });
    if (name) make('h3', element, name);
    const tools = make('div', element);
    tools.className = 'tools';
    for (const [sign, title, key] of BUTTONS) {
      const button = make('button', tools, sign);
      Object.assign(button, { type: 'button', title });
      button.setAttribute('aria-label', title);
      button.addEventListener('click', () => keyOn(group, key));
    }
    group.at = make('output', tools);
    group.panels = given.map((panel, i) => makePanel(panel, group, i === given.length - 1));
    const times = group.panels.flatMap(panel => panel.curves).map(curve => curve.times);
    let first = Math.min(...times.map(t => t[0]));
    let last = Math.max(...times.map(t => t[t.length - 1]));
    if (!(last > first)) { first -= 0.5; last += 0.5; }
    group.all = () => group.show(first, last);
    group.show = (from, to) => {
      const span = Math.min(Math.max(to - from, FINEST), last - first);
      const start = Math.min(Math.max(from, first), last - span);
      group.span = [start, start + span];
      spans.set(name, group.span);
      for (const { plot } of group.panels) plot.setScale('x', { min: start, max: start + span });
      [root.dataset.from, root.dataset.to] = group.span;
    };
    // moves the cursor by a share of the width, from the middle if it is nowhere
    group.point = share => {
      const { plot } = group.panels[0], width = plot.over.clientWidth;
      const left = plot.cursor.left < 0 ? width / 2 : plot.cursor.left + share * width;
      const at = Math.min(Math.max(left, 0), width - 1);
      for (const panel of group.panels) panel.plot.setCursor({ left: at, top: 1 });
    };
    group.show(...spans.get(name) || [first, last]);
    return group;
  }

  const data = JSON.parse(document.getElementById('data').textContent).panels;
  const names = [...new Set(data.map(panel => panel.group))];
  const signals = [...new Set(data.map(panel => panel.signal))];
  const spans = new Map();   // of the groups by name, which outlive a choice
  let active = null;         // the group that the keys act on
  let groups = [];

  // A list to choose from: what stands for several, and each name.
  function choice(title, several, found) {
    const label = make('label', document.getElementById('choice'), `${title} `);
    const select = make('select', label);
    for (const text of [...several, ...found]) make('option', select, text);
    select.addEventListener('change', draw);
    label.hidden = found.length < 2;
    return { several: () => several[select.selectedIndex],
             one: () => found[select.selectedIndex - several.length] };
  }

  const recording = choice('Recording', ['all'], names);
  const signal = choice('Signal', ['the one that tells most', 'all'], signals);

  // Draws what is chosen.
  function draw() {
    for (const { panels } of groups) panels.forEach(({ plot }) => plot.destroy());
    holder.replaceChildren();
    groups = names.filter(name => recording.several() || name === recording.one()).map(name => {
      const own = data.filter(panel => panel.group === name);
      const wanted = signal.several() ? own[0].signal : signal.one();
      const shown = own.filter(panel => signal.several() === 'all' || panel.signal === wanted);
      return shown.length && makeGroup(name, shown);
    }).filter(group => group);
    active = groups[0];
    if (!active) make('p', holder, 'There is no sample of this signal here.');
    const thinned = Math.max(1, ...groups.flatMap(group => group.panels)
      .flatMap(panel => panel.curves).map(curve => curve.thinned));
    document.getElementById('thinned').textContent = thinned === 1 ? '' :
      `Of every ${thinned} samples of the longest curves the lowest and the highest are shown.`;
  }
  draw();

  addEventListener('resize', () => {
    for (const { panels } of groups) panels.forEach(panel => panel.resize());
  });
  for (const medium of ['(prefers-color-scheme: dark)', 'print']) {
    matchMedia(medium).addEventListener('change', () => {
      for (const { panels } of groups) for (const { plot } of panels) plot.redraw();
    });
  }
  holder.addEventListener('keydown', event => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const step = { ArrowLeft: -0.01, ArrowRight: 0.01 }[event.key];
    if (event.shiftKey && step) active?.point(step);
    else if (!active || !keyOn(active, event.key)) return;
    event.preventDefault();
  });
  root.dataset.state = 'drawn';
})();
