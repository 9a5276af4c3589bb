// The whole run as a strip: its position, what changed it, and which part the charts show; dragging shows another.

import { byId, fitCanvas, put, seldom } from "./dom.js";
import { colour } from "./drawing/palette.js";
import { extent } from "./drawing/range.js";

const HEIGHT = 24;
const STEPS = 1000;

export class Scrubber {
  /** @param {import("./viewport.js").Viewport} viewport what dragging changes. */
  constructor(viewport) {
    this.viewport = viewport;
    this.canvas = byId("overview");
    this.input = byId("scrub");
    Object.assign(this.input, { min: "0", max: String(STEPS), step: "1" });
    this.isHeld = false;
    this.input.addEventListener("pointerdown", () => (this.isHeld = true));
    for (const end of ["pointerup", "pointercancel"]) addEventListener(end, () => (this.isHeld = false));
    this.input.addEventListener("input", () => this.move(Number(this.input.value) / STEPS));
    this.show = seldom((...what) => this.draw(...what));
    fitCanvas(this.canvas, HEIGHT, () => this.last && this.draw(...this.last));
  }

  /** Show the part that ends at this share of the run; at its end, what comes next. */
  move(share) {
    const { first_s: first, last_s: last, shown } = this.viewport;
    const span = this.viewport.span_s ?? shown[1] - shown[0];
    const end = first + share * (last - first);
    if (share >= 1) this.viewport.live();
    else this.viewport.at(end - span, end);
  }

  draw(snapshot, marks) {
    this.last = [snapshot, marks];
    const { from_s: from, to_s: to, tables: { overview } } = snapshot;
    const ratio = devicePixelRatio;
    const { width, height } = this.canvas;
    const ctx = this.canvas.getContext("2d");
    ctx.clearRect(0, 0, width, height);
    const { first_s: first, last_s: last, end_s: end } = this.viewport;
    if (!(last > first)) return;
    const across = (t) => ((t - first) / (last - first)) * width;
    ctx.fillStyle = colour("grid");
    ctx.fillRect(across(from), 0, Math.max(2 * ratio, across(to) - across(from)), height);
    if (overview) this.band(ctx, overview, across, height);
    ctx.fillStyle = colour("mark");
    for (const { t_s, changes } of marks) if (changes) ctx.fillRect(Math.round(across(t_s)), 0, ratio, height);
    // The place that was asked for: what is drawn follows a little later.
    if (!this.isHeld) this.input.value = String(Math.round((STEPS * ((end ?? last) - first)) / (last - first)));
    this.input.setAttribute("aria-valuetext", `${from.toFixed(2)} to ${Math.min(to, last).toFixed(2)} s`);
    const decimals = last - first < 1 ? 3 : 1;
    put(byId("scrub-ends"), `${first.toFixed(decimals)}–${last.toFixed(decimals)} s`);
  }

  /** The band between the extremes of each stretch, which come in pairs: a swing too fast for the strip shows no zigzags. */
  band(ctx, { t0_s: t0, dt_s: dt, columns: [{ values }] }, across, height) {
    const [low, high] = extent([values]);
    const down = (value) => height * (0.1 + 0.8 * (high > low ? (high - value) / (high - low) : 0.5));
    const [upper, lower] = [[], []];
    for (let i = 0; i + 1 < values.length; i += 2) {
      const [one, other] = [values[i], values[i + 1]];
      if (one + other - (one + other) !== 0) continue;
      const x = across(t0 + (i + 0.5) * dt);
      upper.push([x, down(Math.max(one, other))]);
      lower.push([x, down(Math.min(one, other))]);
    }
    ctx.strokeStyle = ctx.fillStyle = colour("grey");
    ctx.lineWidth = devicePixelRatio;
    ctx.lineJoin = "round";
    ctx.beginPath();
    for (const [x, y] of [...upper, ...lower.reverse()]) ctx.lineTo(x, y);
    ctx.closePath();
    ctx.fill();
    ctx.stroke();
  }
}
