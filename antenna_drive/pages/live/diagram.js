// The block diagram of the article's Figs. 4 to 6 with live numbers. Two layouts: wide, and tall for
// a phone.
import {digits, draw} from './elements.js';

const HEIGHT = 52;
// Block: label, and the signals that it shows with a short name, if it shows several.
const BLOCKS = {
  signal: ['test signal', ['test_signal/rate_command', '']],
  amplifier_1: ['amplifiers 1', ['motor_1/current', '']],
  amplifier_2: ['amplifiers 2', ['motor_2/current', '']],
  motor_1: ['motor 1, tachometer', ['motor_1/tach_rate', '']],
  motor_2: ['motor 2, tachometer', ['motor_2/tach_rate', '']],
  gear_1: ['gearbox 1', ['motor_1/gear_torque', '']],
  gear_2: ['gearbox 2', ['motor_2/gear_torque', '']],
  share: ['torque share, bias', ['torque_share/bias_voltage', '']],
  filter: ['Filter 1', ['torque_share/counter_torque', '']],
  axis: ['axis and dish', ['plant/axis_rate', '']],
  encoder: ['encoder', ['plant/encoder', '']],
  pointing: ['pointing error, EL', ['plant/pointing_error_elevation', '']],
};
// Upper left corners and widths.
const WIDE = {
  box: [0, 0, 960, 296], places: {
    signal: [6, 122, 150], amplifier_1: [216, 14, 160], amplifier_2: [216, 230, 160],
    share: [216, 122, 160], filter: [416, 122, 150], motor_1: [416, 14, 150],
    motor_2: [416, 230, 150], gear_1: [606, 14, 140], gear_2: [606, 230, 140],
    axis: [796, 122, 158], encoder: [796, 230, 158], pointing: [796, 14, 158]},
  flows: [
    ['test_signal/rate_command', 'M156 140 H186 V40 H216'],
    ['test_signal/rate_command', 'M156 156 H186 V256 H216'],
    ['motor_1/current', 'M376 40 H416'], ['motor_2/current', 'M376 256 H416'],
    ['motor_1/current', 'M270 66 V122'], ['motor_2/current', 'M270 230 V174'],
    ['torque_share/bias_voltage', 'M376 148 H416'],
    ['torque_share/counter_torque', 'M491 122 V94 H340 V66'],
    ['torque_share/counter_torque', 'M491 174 V202 H340 V230'],
    ['motor_1/gear_torque', 'M566 40 H606'], ['motor_2/gear_torque', 'M566 256 H606'],
    ['motor_1/gear_torque', 'M746 40 H771 V138 H796'],
    ['motor_2/gear_torque', 'M746 256 H771 V158 H796'],
    ['plant/axis_rate', 'M875 174 V230'],
    ['plant/pointing_error_elevation', 'M875 122 V66']]};
const TALL = {
  box: [0, 0, 372, 548], places: {
    signal: [96, 6, 180], amplifier_1: [6, 92, 170], amplifier_2: [196, 92, 170],
    share: [6, 178, 170], filter: [196, 178, 170], motor_1: [6, 264, 170],
    motor_2: [196, 264, 170], gear_1: [6, 350, 170], gear_2: [196, 350, 170],
    axis: [96, 426, 180], encoder: [6, 494, 170], pointing: [196, 494, 170]},
  flows: [
    ['test_signal/rate_command', 'M150 58 V92'], ['test_signal/rate_command', 'M222 58 V92'],
    ['motor_1/current', 'M60 144 V178'], ['motor_2/current', 'M222 144 V161 H120 V178'],
    ['torque_share/bias_voltage', 'M176 204 H196'],
    ['torque_share/counter_torque', 'M281 178 V144'],
    ['motor_1/current', 'M150 144 V264'], ['motor_2/current', 'M340 144 V264'],
    ['motor_1/gear_torque', 'M91 316 V350'], ['motor_2/gear_torque', 'M281 316 V350'],
    ['motor_1/gear_torque', 'M120 402 V426'], ['motor_2/gear_torque', 'M252 402 V426'],
    ['plant/axis_rate', 'M130 478 V494'], ['plant/pointing_error_elevation', 'M242 478 V494']]};
// An arrow is as wide as its signal is, against the greatest of late.
const FORGET = 0.999;

export class Diagram {
  constructor(samples, panels) {
    this.samples = samples;
    this.units = new Map();
    for (const panel of panels)
      for (const name of panel.names) this.units.set(name, [panel.unit, panel.factor]);
    this.holder = document.getElementById('diagram');
    this.narrow = matchMedia('(max-width: 40rem)');
    this.narrow.addEventListener('change', () => this.build());
    this.greatest = new Map();
    this.build();
  }

  build() {
    const {box, places, flows} = this.narrow.matches ? TALL : WIDE;
    const svg = draw('svg', null, '', {viewBox: box.join(' '), role: 'img',
      'aria-label': 'block diagram of the drive with live values'});
    const add = (name, attributes, text = '') => draw(name, svg, text, attributes);
    const marker = add('marker', {id: 'tip', viewBox: '0 0 8 8', refX: 7, refY: 4, markerWidth: 8,
                                  markerHeight: 8, markerUnits: 'userSpaceOnUse', orient: 'auto'});
    draw('path', marker, '', {d: 'M0 0 L8 4 L0 8 z'});
    this.flows = flows.map(([name, d]) => [name, add('path', {
      d, class: 'flow', 'marker-end': 'url(#tip)'})]);
    this.texts = Object.entries(places).map(([key, [x, y, width]]) => {
      const [label, [name]] = BLOCKS[key];
      add('rect', {x, y, width, height: HEIGHT});
      add('text', {x: x + width / 2, y: y + 19}, label);
      const text = add('text', {x: x + width / 2, y: y + 41, class: 'value', 'data-signal': name});
      const number = draw('tspan', text, '–');
      draw('tspan', text, ` ${this.units.get(name)[0]}`, {class: 'unit'});
      return [name, number];
    });
    this.holder.replaceChildren(svg);
    this.draw();
  }

  draw() {
    const {samples} = this;
    for (const [name, number] of this.texts) {
      const shown = digits(samples.last(name) * this.units.get(name)[1]);
      if (number.textContent !== shown) number.textContent = shown;
    }
    for (const [name, path] of this.flows) {
      const size = Math.abs(samples.last(name));
      const most = Math.max(size, FORGET * (this.greatest.get(name) || 0));
      if (Number.isFinite(most)) this.greatest.set(name, most);
      const share = most > 0 && Number.isFinite(size) ? size / most : 0;
      const width = (1 + 3 * share).toFixed(1);
      if (path.getAttribute('stroke-width') !== width) path.setAttribute('stroke-width', width);
      path.classList.toggle('moving', share > 0.02);
    }
  }
}
