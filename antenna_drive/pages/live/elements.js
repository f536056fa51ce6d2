// Small helpers: elements, numbers for people, and a line at the bottom of the page.

export function make(name, parent, text = '', attributes = {}) {
  return finished(document.createElement(name), parent, text, attributes);
}

export function draw(name, parent, text = '', attributes = {}) {
  return finished(document.createElementNS('http://www.w3.org/2000/svg', name), parent, text,
                  attributes);
}

function finished(element, parent, text, attributes) {
  element.textContent = text;
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  parent?.append(element);
  return element;
}

export const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

// Colours that stay apart for colour-blind readers (Okabe and Ito), as on the other pages; lighter
// ones on a dark page.
const ON_LIGHT = ['#0072b2', '#d55e00', '#009e73', '#cc79a7', '#e69f00', '#56b4e9'];
const ON_DARK = ['#56b4e9', '#f0894a', '#3fcf9f', '#e3a3c6', '#f2bf4d', '#8fd0f5'];
export const dark = matchMedia('(prefers-color-scheme: dark)');
export const colour = n => (dark.matches ? ON_DARK : ON_LIGHT)[n % ON_LIGHT.length];

// A number with about four digits, and never a stray minus before a zero.
export function digits(value, most = 4) {
  if (!Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size === 0) return '0';
  if ((size >= 1e6 || size < 1e-4)) return value.toExponential(2);
  const after = Math.max(0, Math.min(6, most - 1 - Math.floor(Math.log10(size))));
  const text = value.toFixed(after);
  return Number(text) === 0 ? text.replace('-', '') : text;
}

// A number in a field: as short as it can be without another value.
export function plain(value) {
  return String(Number(value.toPrecision(7)));
}

// The class of a level of /diagnostics.
const LEVELS = ['OK', 'WARN', 'ERROR', 'STALE'];
export const levelClass = level => `level-${LEVELS[level] || 'ERROR'}`;

let hiding = 0;
export function say(text) {
  const line = document.getElementById('said');
  line.textContent = text;
  clearTimeout(hiding);
  hiding = setTimeout(() => { line.textContent = ''; }, 7000);
}
