// The colours of the charts: they stand in page.css, once for light and once for dark, and are read from there.

const ELEMENTS = 6;
// A second way to tell lines apart, for eyes and paper without colour. Forces of elements are never drawn solid.
const DASHES = [[7, 3], [2, 3], [10, 3, 2, 3], [4, 4], [1, 2], [12, 4]];
const LINES = {
  x: { colour: "ink", width: 1.6 },
  tip_x: { colour: "tip", width: 1.3, dash: [6, 2] },
  hand_x: { colour: "hand", width: 1.3, dash: [3, 3] },
  x_measured: { colour: "grey", width: 1, dash: [2, 2] },
  wall: { colour: "wall", width: 1.8 },
  total: { colour: "ink", width: 1.2 },
};

// Kinds get their colours by their place here, in every window; other kinds by their letters.
const KINDS = [
  "damping", "unidirectional-inertia", "bidirectional-inertia", "unidirectional-damping", "passivity-controller",
  "force-bounding", "virtual-coupling", "adaptive-inertia", "force-rate", "passivity-controller-reset",
  "passivity-controller-reference",
];

const dark = matchMedia("(prefers-color-scheme: dark)");
let known = new Map();

/** The colour with this name in page.css, as it is now. */
export function colour(name) {
  if (!known.has(name)) {
    known.set(name, getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim());
  }
  return known.get(name);
}

/** How the lines of some columns look, in their order: an element's kind has one colour in every chart. */
export function linesFor(columns) {
  const seen = new Map();
  return columns.map(({ name, label }) => LINES[name] ?? elementLine(kindOf(label), seen));
}

/** Every column as a line; the residual is a number beside the chart, too small for a line. */
export function linesOf({ columns }) {
  const drawn = columns.filter(({ name }) => name !== "residual");
  const looks = linesFor(drawn);
  return drawn.map(({ name, label, values, last }, i) => ({ key: name, label, line: looks[i], values, last }));
}

/** "element 0: damping", its own column "element 0: damping, alpha" and the book "damping-2" are of the kind "damping". */
const kindOf = (label) => label.replace(/^element \d+: /, "").replace(/, .*$/, "").replace(/-\d+$/, "");

function elementLine(kind, seen) {
  const number = placeOf(kind);
  const before = seen.get(kind) ?? 0;
  seen.set(kind, before + 1);
  return { colour: `element-${number % ELEMENTS}`, width: 1.5, dash: DASHES[(number + Math.floor(number / ELEMENTS) + before) % DASHES.length] };
}

function placeOf(kind) {
  const place = KINDS.indexOf(kind);
  return place >= 0 ? place : [...kind].reduce((sum, letter) => (31 * sum + letter.codePointAt(0)) % 997, 7);
}

/** Calls `again` whenever the page changes between light and dark. */
export function onSchemeChange(again) {
  dark.addEventListener("change", () => {
    known = new Map();
    again();
  });
}
