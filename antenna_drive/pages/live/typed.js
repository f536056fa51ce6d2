// Numbers as people type them. A decimal comma is right where it can mean nothing else, and refused
// where it could: nothing that is typed becomes another number in silence.

const NUMBER = /^[+-]?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?$/i;
const COMMA = /^([+-]?\d*),(\d+(?:e[+-]?\d+)?)$/i;
const THOUSAND = /^[+-]?[1-9]\d{0,2},\d{3}$/;

// {value}, or {reason} for what is no number; `whole` allows whole numbers only.
export function readNumber(text, whole = false) {
  const typed = text.trim().replace('\u2212', '-');
  if (THOUSAND.test(typed))
    return {reason: `${typed}: write ${typed.replace(',', '.')} or ${typed.replace(',', '')}`};
  const pointed = typed.replace(COMMA, '$1.$2');
  if (!NUMBER.test(pointed))
    return {reason: typed ? `${typed}: is no number; write one such as 0.5` : 'a number is missing'};
  const value = Number(pointed);
  if (whole && !Number.isInteger(value)) return {reason: `${typed}: is no whole number`};
  return {value};
}

// {values} of numbers between which stand spaces, semicolons, or commas with a space, or {reason}.
export function readNumbers(text) {
  const values = [];
  for (const item of text.split(/[\s;]+|,\s+/).map(one => one.replace(/,$/, '')).filter(Boolean)) {
    const [first, ...more] = item.split(',');
    if (more.length)
      return {reason: `${item}: write ${first}.${more[0]} or ${item.split(',').join('; ')}`};
    const {value, reason} = readNumber(item);
    if (reason) return {reason};
    values.push(value);
  }
  return {values};
}
