// Wheel, mouse, finger and keys on charts of uPlot that show one span of time, the `view`:
// `span` [from, to]; `show(from, to)`; `all()`; optional: `isOpen()`, whether gestures count now.
'use strict';

function isOpen(view) { return !view.isOpen || view.isOpen(); }

// The view with its span made longer by a factor about a time.
function zoom(view, factor, t) {
  const [from, to] = view.span;
  view.show(t - (t - from) * factor, t + (to - t) * factor);
}

// Lets a chart's area move and zoom the view; `begun` is called when a drag begins on it.
function listenTo(plot, view, begun = () => {}) {
  let grip = null, marked = false;
  const share = event => {
    const box = plot.over.getBoundingClientRect();
    return Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
  };
  const timeAt = x => view.span[0] + x * (view.span[1] - view.span[0]);
  const mark = (from, to) => plot.setSelect({
    left: Math.min(from, to) * plot.over.clientWidth, top: 0,
    width: Math.abs(to - from) * plot.over.clientWidth, height: plot.over.clientHeight }, false);
  plot.over.addEventListener('wheel', event => {
    if (!isOpen(view)) return;
    event.preventDefault();
    zoom(view, Math.exp(0.0015 * event.deltaY), timeAt(share(event)));
  }, { passive: false });
  plot.over.addEventListener('pointerdown', event => {
    if (!isOpen(view)) return;
    plot.over.setPointerCapture(event.pointerId);
    [grip, marked] = [share(event), event.shiftKey];
    begun();
  });
  plot.over.addEventListener('pointermove', event => {
    if (grip === null) return;
    const x = share(event);
    if (marked) { mark(grip, x); return; }
    const moved = timeAt(grip) - timeAt(x);
    grip = x;
    if (moved) view.show(view.span[0] + moved, view.span[1] + moved);
  });
  plot.over.addEventListener('pointerup', event => {
    const ends = [grip, share(event)].map(timeAt).sort((a, b) => a - b);
    const wanted = marked && grip !== null && ends[1] > ends[0];
    release();
    if (wanted) view.show(...ends);
  });
  // a finger that scrolls the page lets go of the curve
  plot.over.addEventListener('pointercancel', release);
  function release() {
    [grip, marked] = [null, false];
    mark(0, 0);
  }
}

// What a key on the charts does to the view; whether it does something.
function keyOn(view, key) {
  const [from, to] = view.span, middle = (from + to) / 2, step = 0.2 * (to - from);
  const act = {
    '+': () => zoom(view, 0.5, middle), '-': () => zoom(view, 2, middle), 0: () => view.all(),
    ArrowLeft: () => view.show(from - step, to - step),
    ArrowRight: () => view.show(from + step, to + step),
  }[key];
  if (!act || !isOpen(view)) return false;
  act();
  return true;
}
