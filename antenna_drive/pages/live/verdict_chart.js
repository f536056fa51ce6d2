// Probabilities over the seconds of testing, as a small drawing.
const SPACE = 'http://www.w3.org/2000/svg';
const WIDTH = 380, HEIGHT = 150, LEFT = 34, RIGHT = 8, TOP = 8, BOTTOM = 24;

function draw(name, parent, attributes, text = '') {
  const element = document.createElementNS(SPACE, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.textContent = text;
  parent.append(element);
  return element;
}

// times: of the looks [s]; curves: colour and a probability for each look
export function lines(times, curves) {
  const svg = document.createElementNS(SPACE, 'svg');
  svg.setAttribute('viewBox', `0 0 ${WIDTH} ${HEIGHT}`);
  svg.setAttribute('role', 'img');
  svg.setAttribute('aria-label', 'probabilities over the seconds of testing');
  const last = Math.max(1, ...times);
  const x = time => LEFT + (WIDTH - LEFT - RIGHT) * time / last;
  const y = p => TOP + (HEIGHT - TOP - BOTTOM) * (1 - p);
  for (const p of [0, 0.5, 1]) {
    draw('line', svg, {x1: LEFT, x2: WIDTH - RIGHT, y1: y(p), y2: y(p), class: 'grid'});
    draw('text', svg, {x: LEFT - 5, y: y(p) + 4, 'text-anchor': 'end'}, String(p));
  }
  draw('text', svg, {x: LEFT, y: HEIGHT - 6}, '0');
  draw('text', svg, {x: WIDTH - RIGHT, y: HEIGHT - 6, 'text-anchor': 'end'},
       `${Math.round(last)} s of testing`);
  for (const [stroke, values] of curves) {
    draw('polyline', svg, {stroke, points: values.map(
      (p, n) => `${x(times[n]).toFixed(1)},${y(p).toFixed(1)}`).join(' ')});
    values.forEach((p, n) => draw('circle', svg, {cx: x(times[n]), cy: y(p), r: 3, fill: stroke}));
  }
  return svg;
}
