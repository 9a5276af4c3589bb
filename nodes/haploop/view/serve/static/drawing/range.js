// The range of an axis that follows its data without trembling at every snapshot.

const MARGIN = 0.07;
// Data that fill less than this part of the axis make it fit more closely.
const FILLED = 0.5;

/** Smallest and largest of some columns and `extra` numbers; NaN is ignored. */
export function extent(columns, extra = []) {
  let low = Infinity;
  let high = -Infinity;
  for (const values of [...columns, extra]) {
    for (let i = 0; i < values.length; i++) {
      if (values[i] < low) low = values[i];
      if (values[i] > high) high = values[i];
    }
  }
  return [low, high];
}

export class Range {
  /** @param {number} least the axis never covers less than this, nor than this `share` of its largest number. */
  constructor(least, share = 0) {
    Object.assign(this, { least, share });
    this.now = [-least, least];
    this.forget();
  }

  /** Fit closely the next time. */
  forget() {
    this.fresh = true;
  }

  /** The range to show for data from `low` to `high`; the last one where there are no data. */
  follow(low, high) {
    if (!(low <= high)) return this.now;
    const [bottom, top] = this.now;
    const needed = Math.max(high - low, this.least, this.share * Math.max(Math.abs(low), Math.abs(high)));
    if (this.fresh || low < bottom || high > top || needed < FILLED * (top - bottom)) {
      const middle = (low + high) / 2;
      const half = needed * (0.5 + MARGIN);
      this.now = [middle - half, middle + half];
      this.fresh = false;
    }
    return this.now;
  }
}
