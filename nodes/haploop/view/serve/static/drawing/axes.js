// The axes of every chart.

import { axisNumbers } from "./amounts.js";
import { colour } from "./palette.js";

export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
// Axes keep their size whatever is written on them: the charts stay aligned, and nothing jumps. To the left there
// is room for "−60.0005" and "−100000".
const LEFT_PX = 66;
const BOTTOM_PX = 20;
const BARE_PX = 5;
const LABEL_PX = 17;
const DIGIT_PX = 7;

const common = () => ({
  stroke: () => colour("ink"),
  font: `12px ${FONT}`,
  labelFont: `12px ${FONT}`,
  labelSize: LABEL_PX,
  gap: 3,
  grid: { stroke: () => colour("grid"), width: 1 },
  ticks: { stroke: () => colour("grid"), width: 1, size: 4 },
});

const numbers = (u, splits, axis, space, step) => axisNumbers(splits, step);

// In a low chart the numbers are closer to each other, so that there are some.
const [LOW_PX, CLOSE_PX, APART_PX] = [130, 18, 24];
const numberSpace = (u, axis, low, high, size_px) => (size_px < LOW_PX ? CLOSE_PX : APART_PX);

/** The axis to the left. */
export const leftAxis = (label) => ({ ...common(), scale: "y", label, size: LEFT_PX, space: numberSpace, values: numbers });

/** The axis below; there are at least `space` px between its numbers, and more where they are long. */
export const bottomAxis = (label, space = 56) => ({
  ...common(),
  scale: "x",
  label,
  size: BOTTOM_PX,
  space: (u, axis, low, high) => Math.max(space, DIGIT_PX * (2 + widest(low, high))),
  values: numbers,
});

/** The most characters of a number between these, for numbers about a quarter of the way apart. */
const widest = (low, high) => Math.max(...axisNumbers([low, high], 10 ** Math.floor(Math.log10((high - low) / 4))).map(({ length }) => length));

/** The axis below a chart whose times are written below another one. */
export const bareAxis = () => ({
  ...common(),
  scale: "x",
  size: BARE_PX,
  space: 56,
  values: (u, splits) => splits.map(() => null),
});
