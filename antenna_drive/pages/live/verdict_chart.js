// Probabilities over the seconds of testing, as a small drawing.
import {draw} from './elements.js';

const WIDTH = 380, HEIGHT = 150, LEFT = 34, RIGHT = 8, TOP = 8, BOTTOM = 24;

// times: of the looks [s]; curves: colour and a probability for each look
export function lines(times, curves) {
  const svg = draw('svg', null, '', {viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: 'img',
    'aria-label': 'probabilities over the seconds of testing'});
  const last = Math.max(1, ...times);
  const x = time => LEFT + (WIDTH - LEFT - RIGHT) * time / last;
  const y = p => TOP + (HEIGHT - TOP - BOTTOM) * (1 - p);
  for (const p of [0, 0.5, 1]) {
    draw('line', svg, '', {x1: LEFT, x2: WIDTH - RIGHT, y1: y(p), y2: y(p), class: 'grid'});
    draw('text', svg, String(p), {x: LEFT - 5, y: y(p) + 4, 'text-anchor': 'end'});
  }
  draw('text', svg, '0', {x: LEFT, y: HEIGHT - 6});
  draw('text', svg, `${Math.round(last)} s of testing`,
       {x: WIDTH - RIGHT, y: HEIGHT - 6, 'text-anchor': 'end'});
  for (const [stroke, values] of curves) {
    draw('polyline', svg, '', {stroke, points: values.map(
      (p, n) => `${x(times[n]).toFixed(1)},${y(p).toFixed(1)}`).join(' ')});
    values.forEach((p, n) => draw(
      'circle', svg, '', {cx: x(times[n]), cy: y(p), r: 3, fill: stroke}));
  }
  return svg;
}
