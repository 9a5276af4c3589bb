// The axes of every chart.

import { axisNumbers } from "./amounts.js";
import { colour } from "./palette.js";

export const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif';
// Axes keep their size whatever stands on them: the charts stay below each other, and nothing jumps. To the left there
// is room for "−60.0005" and "−100000".
const LEFT_PX = 66;
const BOTTOM_PX = 20;
const BARE_PX = 5;
const LABEL_PX = 17;

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

/** The axis to the left. */
export const leftAxis = (label) => ({ ...common(), scale: "y", label, size: LEFT_PX, space: 24, values: numbers });

/** The axis below; `space` px at least lie between its numbers. */
export const bottomAxis = (label, space = 56) => ({ ...common(), scale: "x", label, size: BOTTOM_PX, space, values: numbers });

/** The axis below a chart whose times stand below another one. */
export const bareAxis = () => ({
  ...common(),
  scale: "x",
  size: BARE_PX,
  space: 56,
  values: (u, splits) => splits.map(() => null),
});
