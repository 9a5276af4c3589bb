// What the lines of a chart read at a time: a number, or a range where a row of the chart stands for many samples.

import { NONE, steady } from "./amounts.js";

const DECIMALS = 3;

/** The least and the greatest of what a row stands for: in an envelope each pair of rows is the extremes of one interval. */
function reading(values, row, isEnvelope) {
  const [one, other] = isEnvelope ? [values[row - (row % 2)], values[row - (row % 2) + 1]] : [values[row], values[row]];
  return one < other ? [one, other] : [other, one];
}

/** The readings of all lines at a row. */
export const readingsAt = (t, lines, row, isEnvelope) => ({
  t: t[row],
  isEnvelope,
  values: new Map(lines.map(({ key, values }) => [key, reading(values, row, isEnvelope)])),
});

/** A reading in another unit as text: one number where its ends read the same, else both, to the digits that count. */
export function told([low, high], factor) {
  const [from, to] = [low, high].map((end) => steady(end * factor, DECIMALS));
  if (from === to || from === NONE || to === NONE) return to;
  const decimals = Math.min(DECIMALS, Math.max(0, 1 - Math.floor(Math.log10((high - low) * factor))));
  return [low, high].map((end) => steady(end * factor, decimals)).join("…");
}

const UNKNOWN = [NaN, NaN];

/** The difference between two readings of all lines: the time, and by how much a line may be higher at the second. */
export const between = (one, other) => ({
  time: other.t - one.t,
  of: (key) => {
    const [[low, high], [from, to]] = [one, other].map(({ values }) => values.get(key) ?? UNKNOWN);
    return [from - high, to - low];
  },
});

/** The readings at the times between which the charts measure; they stay when these times are moved out of sight. */
export class Marked {
  constructor() {
    this.known = new Map();
  }

  /** Read the lines at those of these times that are in sight, and return what is known; a reading of single samples is kept. */
  look(marks, t, lines, isEnvelope, rowOf) {
    for (const mark of [...this.known.keys()]) if (!marks.includes(mark)) this.known.delete(mark);
    for (const mark of marks) {
      const [before, isSeen] = [this.known.get(mark), mark >= t[0] && mark <= t.at(-1)];
      if (isSeen && (!before || before.isEnvelope || !isEnvelope)) this.known.set(mark, readingsAt(t, lines, rowOf(mark), isEnvelope));
    }
    return marks.map((mark) => this.known.get(mark));
  }
}
