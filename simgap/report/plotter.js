// Draws the panels of #data into #panels with uPlot. The panels of a group show one span of time,
// which wheel, mouse and keys zoom and move.
'use strict';
(() => {
  const LEFT = 64, RIGHT = 12, HEIGHT = 176;   // of a panel, margins and height [px]
  const FINEST = 1e-6;                         // shortest span of time shown [s]
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
    const element = make('section', holder);
    element.className = 'panel';
    const head = make('div', element);
    head.className = 'head';
    make('b', head, `${given.title} [${given.unit}]`);
    const curves = given.curves.map(makeCurve);
    const labels = curves.map((curve, number) => {
      const button = make('button', head);
      button.setAttribute('aria-pressed', 'true');
      make('i', button).style.background = curve.colour;
      button.addEventListener('click', () => {
        const shown = !plot.series[number + 1].show;
        button.setAttribute('aria-pressed', String(shown));
        plot.setSeries(number + 1, { show: shown });
      });
      return make('span', button, curve.name);
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
      series: [{}, ...curves.map(curve => ({ stroke: curve.colour, width: 1.4, spanGaps: true,
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
        const i = t === null ? -1 : closest(t, curve.times);
        labels[number].textContent = i < 0 ? curve.name
          : `${curve.name} ${curve.values[i].toPrecision(5)} at ${curve.times[i].toFixed(4)} s`;
      });
    }

    listenTo(plot, group, () => { active = group; });
    window.addEventListener('resize',
      () => plot.setSize({ width: element.clientWidth, height }));
    for (const medium of ['(prefers-color-scheme: dark)', 'print']) {
      matchMedia(medium).addEventListener('change', () => plot.redraw());
    }
    return { plot, curves };
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
    if (name) make('h3', holder, name);
    const group = { name: name || 'all', span: [0, 1] };
    const panels = given.map((panel, i) => makePanel(panel, group, i === given.length - 1));
    const times = panels.flatMap(panel => panel.curves).map(curve => curve.times);
    let first = Math.min(...times.map(t => t[0]));
    let last = Math.max(...times.map(t => t[t.length - 1]));
    if (!(last > first)) { first -= 0.5; last += 0.5; }
    group.all = () => group.show(first, last);
    group.show = (from, to) => {
      const span = Math.min(Math.max(to - from, FINEST), last - first);
      const start = Math.min(Math.max(from, first), last - span);
      group.span = [start, start + span];
      for (const { plot } of panels) plot.setScale('x', { min: start, max: start + span });
      [root.dataset.from, root.dataset.to] = group.span;
    };
    group.all();
    return group;
  }

  let active = null;   // the group that the keys act on
  const data = JSON.parse(document.getElementById('data').textContent).panels;
  const names = [...new Set(data.map(panel => panel.group))];
  const groups = names.map(name => makeGroup(name, data.filter(panel => panel.group === name)));
  active = groups[0];

  const thinned = Math.max(...data.flatMap(panel => panel.curves).map(curve => curve.thinned));
  if (thinned > 1) {
    document.getElementById('thinned').textContent =
      `Of every ${thinned} samples of the longest curves the lowest and the highest are shown.`;
  }

  holder.addEventListener('keydown', event => {
    if (keyOn(active, event.key)) event.preventDefault();
  });
  root.dataset.state = 'drawn';
})();
