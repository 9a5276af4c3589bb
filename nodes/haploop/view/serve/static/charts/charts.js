// All charts of the page, filled from one snapshot at a time.

import { amount, isNumber } from "../drawing/amounts.js";
import { byId } from "../dom.js";
import { Panels } from "./panels.js";
import { linesOf } from "../drawing/palette.js";
import { times } from "../snapshot.js";
import { TimeChart } from "./time_chart.js";

const CHARTS = {
  position: { label: "position", unit: "m", prefix: "m", least: 1e-5, zero: false, times: false },
  force: { label: "command", unit: "N", prefix: "", least: 1e-3, zero: true, times: false },
  energy: { label: "energy", unit: "J", prefix: "m", least: 1e-9, zero: true, times: true },
};
const NO_TIMES = new Float64Array(0);

export class Charts {
  /** @param {import("../viewport.js").Viewport} viewport what is shown. */
  constructor(viewport) {
    this.viewport = viewport;
    this.charts = Object.fromEntries(
      Object.entries(CHARTS).map(([name, options]) => [name, new TimeChart(byId(name), options, viewport)]),
    );
    this.panels = new Panels(viewport);
    new ResizeObserver(([{ contentRect }]) => viewport.fit(contentRect.width)).observe(byId("position"));
  }

  /**
   * Draw a snapshot.
   *
   * @param {object} snapshot as decoded.
   * @param {object} state the run's state.
   * @param {object[]} marks what changed the run.
   * @param {{label: string, fits: boolean}} behind the run that is drawn over it: its name, and whether the axes have room for it.
   */
  show(snapshot, state, marks, behind) {
    const { from_s, to_s, tables } = snapshot;
    this.viewport.shown = [from_s, to_s];
    for (const [name, chart] of Object.entries(this.charts)) {
      const lines = tables[name] ? linesOf(tables[name]) : [];
      const table = tables[`overlay_${name}`];
      chart.show([from_s, to_s], tables[name] ? times(tables[name]) : NO_TIMES, lines, {
        isEnvelope: tables[name]?.envelope,
        wall: name === "position" ? wallOf(lines, state) : null,
        marks,
        note: name === "energy" ? residual(state) : "",
        overlay: table ? { table, ...behind } : null,
      });
    }
    this.panels.show(snapshot, state, marks);
  }

  /** Draw what is out of sight, too. */
  drawAll() {
    for (const chart of [...Object.values(this.charts), ...this.panels.panels.own.charts]) chart.draw(true);
    this.panels.panels.loops.drawAll();
  }

  /** Fit all axes closely the next time: another stretch of time is shown. */
  refit() {
    for (const { range } of Object.values(this.charts)) range.forget();
    this.panels.refit();
  }
}

/** The wall's face and the side its material is on. */
function wallOf(lines, { wall }) {
  const face = lines.find(({ key }) => key === "wall");
  return face && wall?.into_wall ? { values: face.values, side: Math.sign(wall.into_wall) } : null;
}

/** The residual, in words if it is large enough for that: "This plant invents 27 %". */
function residual({ residual_J: rest, balance }) {
  if (balance) return balance.split(" of the energy")[0];
  return isNumber(rest) ? `residual ${amount(rest, "J", 2)}` : "";
}
