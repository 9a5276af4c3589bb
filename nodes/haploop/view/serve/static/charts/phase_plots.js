// The two loops of Choi et al. 2022: force against penetration (Fig. 3) and virtual momentum against velocity (Fig. 4).

import { named } from "../drawing/amounts.js";
import { ClimbingUnit } from "../drawing/climbing.js";
import { PhaseChart } from "./phase_chart.js";
import { linesFor } from "../drawing/palette.js";
import { dots, line } from "../drawing/paths.js";
import { scaled } from "../snapshot.js";

const GRAMS = 1e3;
// The axes of force and penetration never cover less than this, m and N.
const LEAST = [1e-5, 0.01];
const DOT_PX = 3;
const NOW_PX = 7;
const COARSE = "For this time only the minimum and maximum of each interval are kept here, so no loop is drawn; the log has every sample.";
const NONE_HERE = "No loop in this time.";
const NO_CONTACT = "Not in contact in this time.";
const NO_WALL = "No wall, so no loop of force and penetration.";
const NO_INERTIA = "No virtual inertia is active, so no loop of momentum and velocity.";
const LINES = {
  pressing: { colour: "pressing", width: 1.5 },
  releasing: { colour: "releasing", width: 1.5, dash: [6, 2] },
  spring: { colour: "ink", width: 1, dash: [4, 3] },
  now: { colour: "mark", width: 0, filled: true },
};

const whole = (u, xs, ys) => line(u, xs, ys);
const largest = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value) || 0), 0);
const inPixels = (size) => (u, xs, ys) => dots(u, xs, ys, size * devicePixelRatio);

export class PhasePlots {
  constructor(loop, momentum) {
    this.units = [new ClimbingUnit("m", "m"), new ClimbingUnit("N", "")];
    this.loop = new PhaseChart(loop, this.axesOfLoop());
    this.momentum = new PhaseChart(momentum, { x: "velocity (m/s)", y: "momentum (g m/s)", least: [1e-3, 0.01] });
    this.charts = [this.loop, this.momentum];
  }

  /** Names and least extents of the axes of force and penetration, in the units that serve now. */
  axesOfLoop() {
    const [depth, force] = this.units;
    const least = this.units.map(({ factor }, i) => LEAST[i] * factor);
    return { x: named("penetration", depth.name), y: named("force", force.name), least };
  }

  /** Show the loops among the tables of a snapshot, or say why there is none. */
  show({ tables: { loop, momentum }, coarse }, { wall, elements = [] }) {
    const why = coarse ? COARSE : NONE_HERE;
    const hasInertia = elements.some(({ kind }) => kind.includes("inertia"));
    const climbs = loop ? loop.columns.map(({ values }, i) => this.units[i].serve(largest(values))) : [];
    if (climbs.some(Boolean)) this.loop.rename(this.axesOfLoop());
    const parts = loop ? forceLoop(loop, this.units) : [];
    this.loop.show(parts, loop ? (parts.length ? "" : NO_CONTACT) : wall?.into_wall ? why : NO_WALL);
    this.momentum.show(momentum ? momentumLoops(momentum) : [], momentum ? "" : hasInertia ? why : NO_INERTIA);
  }

  drawAll() {
    for (const chart of this.charts) chart.draw(true);
  }

  /** Fit all axes closely the next time. */
  refit() {
    for (const { ranges } of this.charts) ranges.forEach((range) => range.forget());
  }
}

/** Pressing and releasing as separate lines, beside the wall as it should be; without what is outside the wall, an empty list if all is. */
function forceLoop({ columns, stiffness, curve }, [inDepth, inForce]) {
  const [depth, newtons] = columns.map(({ values }) => values);
  const force = scaled(newtons, inForce.factor);
  const x = new Float64Array(depth.length);
  let deepest = 0;
  for (let i = 0; i < x.length; i++) {
    x[i] = depth[i] > 0 || force[i] !== 0 ? depth[i] * inDepth.factor : NaN;
    if (depth[i] > deepest) deepest = depth[i];
  }
  if (!x.some((depth) => depth === depth)) return [];
  const presses = (i) => x[i + 1] > x[i];
  const parts = [
    { key: "pressing", label: "pressing", path: (u, xs, ys) => line(u, xs, ys, presses) },
    { key: "releasing", label: "releasing", path: (u, xs, ys) => line(u, xs, ys, (i) => !presses(i)) },
  ].map((part) => ({ ...part, line: LINES[part.key], x, y: force }));
  if (curve) {
    const ideal = { x: scaled(curve[0], inDepth.factor), y: scaled(curve[1], inForce.factor) };
    parts.push({ key: "spring", label: "ideal wall, at rest", line: LINES.spring, path: whole, ...ideal });
  } else if (Number.isFinite(stiffness)) {
    const spring = { x: [0, deepest * inDepth.factor], y: [0, stiffness * deepest * inForce.factor] };
    parts.push({ key: "spring", label: "ideal spring", line: LINES.spring, path: whole, ...spring });
  }
  parts.push({ key: "now", label: "", line: LINES.now, path: inPixels(NOW_PX), x: x.slice(-1), y: force.slice(-1) });
  return parts;
}

/** A loop for every virtual inertia: its samples as dots, joined by a thin line. */
function momentumLoops({ columns: [velocity, ...momenta] }) {
  const looks = linesFor(momenta);
  return momenta.flatMap(({ name, label, values }, i) => {
    const pair = { x: velocity.values, y: scaled(values, GRAMS), key: name };
    return [
      { ...pair, label, line: { ...looks[i], width: 0.7, dash: [] }, path: whole },
      { ...pair, label: "", line: { ...looks[i], filled: true }, path: inPixels(DOT_PX) },
    ];
  });
}
