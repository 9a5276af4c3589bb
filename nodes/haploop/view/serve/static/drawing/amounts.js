// Numbers as people read them: with a prefix that suits their size, and their unit.

const PREFIXES = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
const MOST_DECIMALS = 4;
const MOST_WHOLE = 999_999;
export const NONE = "–";

const minus = (text) => text.replaceAll("-", "−");

/** Whether there is a number at all. */
export const isNumber = (value) => typeof value === "number" && Number.isFinite(value);

/** `digits` significant digits without powers of ten; digits before the point are never rounded away. */
export function fixed(value, digits = 3) {
  if (value === 0) return "0";
  const beforePoint = Math.floor(Math.log10(Math.abs(value))) + 1;
  return minus(value.toFixed(Math.min(20, Math.max(0, digits - beforePoint))));
}

const prefixOf = (size) => (size === 0 ? [1, ""] : PREFIXES.find(([f]) => size >= f * 0.9995) ?? PREFIXES.at(-1));

/** A number with its unit: "5.14 mm"; a dash for no number, powers of ten where no prefix helps. */
export function amount(value, unit, digits = 3) {
  if (!isNumber(value)) return NONE;
  const size = Math.abs(value);
  const [factor, letter] = prefixOf(size);
  if (size && !(size / factor >= 1e-3 && size / factor < 1e5)) return `${power(value, digits)} ${unit}`;
  return `${fixed(value / factor, digits)} ${letter}${unit}`;
}

/** From one number to another, both in the unit of the larger: "−3.19 to −1.00 mm". */
export function amounts(low, high, unit) {
  if (!isNumber(low) || !isNumber(high)) return NONE;
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const [factor, letter] = prefixOf(largest);
  const decimals = (fixed(largest / factor).split(".")[1] ?? "").length;
  return `${[low, high].map((value) => steady(value / factor, decimals)).join(" to ")} ${letter}${unit}`;
}

/** A part of a whole, both in the whole's unit and to its digits: "0.52 of 1.00 MN/m". */
export function amountOf(part, whole, unit) {
  const [factor, letter] = prefixOf(whole);
  const text = fixed(whole / factor);
  return `${steady(part / factor, (text.split(".")[1] ?? "").length)} of ${text} ${letter}${unit}`;
}

/** A number in powers of ten: "2.1e−16". */
export const power = (value, digits = 2) => (isNumber(value) ? minus(value.toExponential(digits - 1)) : NONE);

/** A number with a fixed number of decimals, so that it keeps its place while it changes. */
export const steady = (value, decimals) =>
  isNumber(value) ? minus(value.toFixed(decimals).replace(/^-(0\.?0*)$/, "$1")) : NONE;

/** The shortest text of a number that a form can take back: no more digits than a scene would have. */
export const plain = (value) => String(Number(value.toPrecision(12)));

const isWhole = (value) => value >= 0.5 && Math.abs(value - Math.round(value)) < 1e-6 * value;

const magnitude = (value) => Math.floor(Math.log10(value));

/** The numbers along an axis, all with the decimals their step needs; powers of ten where digits would be many. */
export function axisNumbers(splits, step) {
  const largest = Math.max(...splits.map(Math.abs));
  let decimals = 0;
  while (decimals <= MOST_DECIMALS && !isWhole(step * 10 ** decimals)) decimals += 1;
  if (decimals <= MOST_DECIMALS && largest <= MOST_WHOLE) return splits.map((value) => steady(value, decimals));
  const digits = Math.max(2, 1 + magnitude(largest) - magnitude(step));
  return splits.map((value) => (value === 0 ? "0" : power(value, digits).replace("e+", "e")));
}

/** The name along an axis: a quantity with its unit, or only one of the two if the other is missing. */
export const named = (label, unit) => (label && unit ? `${label} (${unit})` : label || unit || "pure number");

/** Name, version and command of a program that is not haploop's own, as far as they are known. */
export function programName({ name, version, command }) {
  const named = [name, version].filter(Boolean).join(" ") || "a program without a name";
  return command ? `${named} (${command})` : named;
}
