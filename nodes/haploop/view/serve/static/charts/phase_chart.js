// A loop: one quantity against another, as in Figs. 3 and 4 of Choi et al. 2022.

import { bottomAxis, leftAxis } from "../drawing/axes.js";
import { boxOf, make, onSight, put } from "../dom.js";
import { Legend, stroke } from "../drawing/legend.js";
import { extent, Range } from "../drawing/range.js";

const NOTHING = new Float64Array(1).fill(NaN);
const SHAPE = { width: 1, dash: [] };

export class PhaseChart {
  /**
   * @param {HTMLElement} host takes the chart.
   * @param {object} options x and y: names of the axes with units; least: [x, y] the axes never cover less.
   */
  constructor(host, { x, y, least }) {
    this.host = host;
    this.name({ x, y, least });
    this.legend = new Legend(host, () => this.build());
    this.plot = host.appendChild(make("div", { class: "plot" }));
    this.box = boxOf(this.plot, () => this.resize());
    this.absent = host.appendChild(make("p", { class: "absent" }, "Nothing yet."));
    this.parts = [];
    this.plot.hidden = true;
    this.isSeen = true;
    this.build();
    onSight(host, (isSeen) => {
      this.isSeen = isSeen;
      this.draw();
    });
  }

  name({ x, y, least }) {
    this.labels = [x, y];
    this.ranges = least.map((smallest) => new Range(smallest));
  }

  /** Take other axes: their numbers have climbed to other units. */
  rename(axes) {
    this.name(axes);
    this.build();
  }

  build() {
    this.u?.destroy();
    const axis = (i) => ({ auto: false, range: () => this.ranges[i].now });
    const series = this.parts.map(({ key, label, line }) => ({
      label,
      stroke: line.filled ? undefined : stroke(line),
      fill: line.filled ? stroke(line) : undefined,
      width: line.width,
      dash: line.dash,
      show: this.legend.isShown(key),
      auto: false,
      paths: (u, i) => {
        const drawn = this.parts[i - 1].path(u, ...u.data[i]);
        return line.filled ? { stroke: null, fill: drawn } : { stroke: drawn, fill: null };
      },
      facets: [{ scale: "x", auto: false }, { scale: "y", auto: false }],
    }));
    const options = {
      mode: 2,
      ...this.size(),
      padding: [6, 10, 2, 0],
      legend: { show: false },
      cursor: { show: false },
      scales: { x: { time: false, ...axis(0) }, y: axis(1) },
      series: [null, ...(series.length ? series : [{ ...SHAPE, paths: () => null, points: { show: false } }])],
      axes: [bottomAxis(this.labels[0], 34), leftAxis(this.labels[1])],
    };
    this.u = new uPlot(options, this.data(), this.plot);
  }

  data() {
    const pairs = this.parts.map(({ x, y }) => (x.length ? [x, y] : [NOTHING, NOTHING]));
    return [null, ...(pairs.length ? pairs : [[NOTHING, NOTHING]])];
  }

  /**
   * Show parts of a loop, or say why there is none.
   *
   * @param {{key: string, label: string, line: object, path: Function, x: ArrayLike<number>, y: ArrayLike<number>}[]} parts
   * @param {string} absent a sentence instead of a loop.
   */
  show(parts, absent = "") {
    const signature = (list) => JSON.stringify(list.map(({ key, label }) => [key, label]));
    const isNew = signature(parts) !== signature(this.parts);
    this.parts = parts;
    put(this.absent, absent);
    this.plot.hidden = absent !== "";
    this.host.classList.toggle("bare", this.plot.hidden); // a sentence leaves its room to the other loop
    const [x, y] = ["x", "y"].map((side) => extent(parts.map((part) => part[side]), parts.length ? [0] : []));
    this.ranges[0].follow(...x);
    this.ranges[1].follow(...y);
    if (isNew) {
      this.legend.name(parts.filter(({ label }) => label));
      this.build();
    }
    this.draw();
  }

  draw(isWanted = this.isSeen) {
    if (!isWanted) return;
    this.u.setData(this.data(), false);
    ["x", "y"].forEach((side, i) => this.u.setScale(side, { min: this.ranges[i].now[0], max: this.ranges[i].now[1] }));
  }

  size() {
    return { width: Math.max(120, this.box.width), height: Math.max(80, this.box.height) };
  }

  resize() {
    const size = this.size();
    if (size.width !== this.u.width || size.height !== this.u.height) this.u.setSize(size);
  }
}
