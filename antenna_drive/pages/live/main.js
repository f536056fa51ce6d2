// The page's beginning: opens the socket, hands what comes to the parts of the page.
import {Link} from './link.js';
import {Samples} from './samples.js';
import {Charts} from './charts.js';
import {Diagram} from './diagram.js';
import {About} from './about.js';
import {Freshness} from './freshness.js';
import {Run} from './run.js';
import {Tune} from './tune.js';
import {Signal} from './signal.js';
import {Article} from './article.js';
import {Tapes} from './tapes.js';
import {Nodes} from './nodes.js';
import {Twin} from './twin.js';
import {makeTabs} from './tabs.js';

const link = new Link();
const samples = new Samples();
const charts = new Charts(samples);
const freshness = new Freshness(samples);
const run = new Run(link, samples, freshness);
const parts = [freshness, run, new About(), charts, new Tune(link), new Signal(link),
               new Article(link, charts), new Tapes(link, charts, samples), new Nodes(freshness),
               new Twin(link)];
let diagram = null;

makeTabs(document.querySelector('.tabs'));
link.on('samples', buffer => samples.take(buffer));
link.on('hello', told => {
  samples.begin(told.signals);
  charts.begin(told.panels);
  diagram = new Diagram(samples, told.panels);
});
for (const part of parts)
  for (const [kind, take] of Object.entries(part.takes()))
    link.on(kind, take);

// Twenty pictures a second: what comes between two of them is drawn once.
const PERIOD_MS = 50;
let drawn = 0;
function draw(now) {
  requestAnimationFrame(draw);
  if (now - drawn < PERIOD_MS - 4 || !samples.fresh()) return;
  drawn = now;
  diagram?.draw();
  charts.draw();
}
requestAnimationFrame(draw);
link.open();

// for tests and for the curious
window.antennaDrive = {link, samples, charts, run, freshness};
