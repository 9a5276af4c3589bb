// The interval of simulated time that is shown: the last seconds, as they come, or one that is frozen.

export const SPANS_S = [0.2, 1, 2, 10, null];
// Fewer than this would make steps of a buzz on a narrow screen.
const LEAST_POINTS = 800;
const MOST_POINTS = 2000;
const LEAST_SPAN_S = 0.005;

export class Viewport {
  /** @param {() => void} changed called after every change. */
  constructor(changed) {
    this.changed = changed;
    this.span_s = 2;
    this.end_s = null;
    this.points = 1000;
    this.panel = "loops";
    this.sound = false;
    // Times between which the charts measure: none, one (to the cursor) or two.
    this.measured = [];
    // What can be shown, and what is on the page now.
    this.first_s = 0;
    this.last_s = 0;
    this.shown = [0, 0];
  }

  get frozen() {
    return this.end_s !== null;
  }

  /** The request as the server expects it. */
  request() {
    return { span_s: this.span_s, points: this.points, end_s: this.end_s, panel: this.panel, sound: this.sound };
  }

  /** Show this many seconds, or null for everything since the start. */
  show(span_s) {
    this.span_s = span_s;
    if (span_s === null) this.end_s = null;
    this.changed();
  }

  /** Take the next span of the row: +1 longer, -1 shorter. */
  widen(by) {
    const spans = SPANS_S.map((span) => span ?? Infinity);
    const now = this.span_s ?? Infinity;
    const next = by > 0 ? spans.find((span) => span > now) : spans.findLast((span) => span < now);
    if (next !== undefined) this.show(next === Infinity ? null : next);
  }

  /** Freeze, or follow the run again. */
  freeze(on = !this.frozen) {
    if (!on) return this.live();
    this.end_s = this.shown[1];
    this.span_s ??= Math.max(LEAST_SPAN_S, this.shown[1] - this.shown[0]);
    return this.changed();
  }

  live() {
    this.measured = [];
    if (!this.frozen) return;
    this.end_s = null;
    if (!SPANS_S.includes(this.span_s)) this.span_s = 2;
    this.changed();
  }

  /** Show the time from ... to ..., s. */
  at(from_s, to_s) {
    this.span_s = Math.max(LEAST_SPAN_S, to_s - from_s);
    this.end_s = this.within(to_s);
    this.changed();
  }

  /** Go back (negative) or forward by a part of what is shown. */
  shift(part) {
    const [from_s, to_s] = this.shown;
    if (this.span_s === null || (!this.frozen && part > 0)) return;
    this.end_s = this.within(to_s + part * (to_s - from_s));
    this.changed();
  }

  within(end_s) {
    return Math.max(Math.min(end_s, this.last_s), Math.min(this.first_s + this.span_s, this.last_s));
  }

  /** Set whether the samples of the force are wanted, to play them. */
  listen(on) {
    this.sound = on;
    this.changed();
  }

  /** Measure from here; when called again, to here; a third time, stop measuring. */
  mark(t_s) {
    this.measured = this.measured.length < 2 ? [...this.measured, t_s] : [];
    this.changed();
  }

  /** Choose what is shown beside the charts over time. */
  choose(panel) {
    if (panel === this.panel) return;
    this.panel = panel;
    this.changed();
  }

  /** Ask for as many points as the charts are wide. */
  fit(width_px) {
    const points = Math.min(MOST_POINTS, Math.max(LEAST_POINTS, Math.round(width_px)));
    if (Math.abs(points - this.points) < 50) return;
    this.points = points;
    this.changed();
  }
}
