// A chart over simulated time: lines of one unit, the events that changed the run, a cursor shared with its neighbours.

import { amount, named, steady } from "./amounts.js";
import { bareAxis, bottomAxis, leftAxis } from "./axes.js";
import { make, onSight, seldom } from "./dom.js";
import { Legend, stroke } from "./legend.js";
import { drawMarks, drawMeasured } from "./marks.js";
import { ClimbingUnit } from "./climbing.js";
import { colour } from "./palette.js";
import { drawStrips, halfPlane, line as linePath, strips } from "./paths.js";
import { last, scaled, times } from "./snapshot.js";
import { extent, Range } from "./range.js";

const CURSORS = "haploop";
const DECIMALS = 3;
// Where the charts lie one below the other, each has its times: that of the last is out of sight.
const NARROW = matchMedia("(max-width: 699px)");
const OVERLAY = { colour: "mark", width: 1 };

export class TimeChart {
  /**
   * @param {HTMLElement} host takes the chart.
   * @param {object} options label, SI unit and first prefix of the left axis; least: it never covers less, in SI; zero:
   *   it always shows 0; times: whether the times stand below it.
   * @param {import("./viewport.js").Viewport} viewport what dragging in the chart changes.
   */
  constructor(host, options, viewport) {
    Object.assign(this, { host, options, viewport });
    this.unit = new ClimbingUnit(options.unit, options.prefix);
    this.range = new Range(options.least * this.unit.factor);
    this.legend = new Legend(host, () => this.retoggle());
    this.plot = host.appendChild(make("div", { class: "plot" }));
    this.lines = [];
    this.rough = [];
    this.overlay = null;
    this.fits = true;
    this.columns = [];
    this.t = new Float64Array(0);
    this.span = [0, 1];
    this.marks = [];
    this.wall = null;
    this.note = "";
    this.isSeen = true;
    this.tellSeldom = seldom(() => this.tell());
    this.build();
    onSight(host, (isSeen) => {
      this.isSeen = isSeen;
      this.draw();
    });
    new ResizeObserver(() => this.resize()).observe(this.plot);
    this.turn = () => this.build();
    NARROW.addEventListener("change", this.turn);
  }

  remove() {
    NARROW.removeEventListener("change", this.turn);
    this.u.destroy();
    this.host.remove();
  }

  build() {
    this.u?.destroy();
    const { label, times } = this.options;
    const series = this.lines.map(({ line, label: name, key }) => ({
      label: name,
      stroke: stroke(line),
      width: line.width,
      dash: line.dash,
      show: this.legend.isShown(key),
      auto: false,
      points: { show: false },
      paths: (u, i) => {
        this.rough[i] = strips(u, u.data[0], u.data[i]);
        return this.rough[i] ? null : { stroke: linePath(u, u.data[0], u.data[i]) };
      },
    }));
    const options = {
      ...this.size(),
      padding: [8, 26, 2, 0], // room for half of the last label of the time axis
      legend: { show: false },
      scales: {
        x: { time: false, auto: false, range: (u, min, max) => [min, max] },
        y: { auto: false, range: () => this.range.now },
      },
      series: [{}, ...series],
      axes: [times || NARROW.matches ? bottomAxis("simulated time (s)") : bareAxis(), leftAxis(named(label, this.unit.name))],
      cursor: {
        y: false,
        points: { show: false },
        drag: { x: true, y: false, setScale: false, dist: 6 },
        sync: { key: CURSORS, scales: ["x", null], filters: { sub: (type) => type === "mousemove" } },
        bind: { dblclick: () => () => this.viewport.live() },
      },
      hooks: {
        drawSeries: [(u, i) => this.rough[i] && drawStrips(u, this.rough[i], this.lines[i - 1].line)],
        drawClear: [(u) => this.shade(u)],
        draw: [(u) => this.layOver(u), (u) => drawMarks(u, this.marks), (u) => drawMeasured(u, this.viewport.measured)],
        setCursor: [() => this.tell()],
        setSelect: [(u) => this.select(u)],
      },
    };
    this.u = new uPlot(options, [this.t, ...this.columns], this.plot);
    this.u.over.addEventListener("click", () => this.viewport.mark(this.u.posToVal(this.u.cursor.left, "x")));
    this.draw();
  }

  /**
   * Show lines: a key, a name, a look and numbers each.
   *
   * @param {[number, number]} span first and last time, s.
   * @param {Float64Array} t times of the numbers, s.
   * @param {{key: string, label: string, line: object, values: ArrayLike<number>}[]} lines
   * @param {object} more wall: {values, side} to shade, or null; marks; note for the end of the legend;
   *   overlay: the table of another run, or null; fits: whether the axis has room for that one, too.
   */
  show(span, t, lines, { wall = null, marks = [], note = "", overlay = null, fits = true } = {}) {
    const signature = (list) => JSON.stringify(list.map(({ key, label }) => [key, label]));
    const isNew = signature(lines) !== signature(this.lines);
    const climbs = this.climb(lines);
    const columns = lines.map(({ values }) => scaled(values, this.unit.factor));
    Object.assign(this, { span, t, lines, wall, marks, note, overlay, fits, columns });
    this.rerange();
    if (isNew || climbs) {
      this.legend.name(lines);
      this.build();
    }
    this.draw();
  }

  /** Whether other numbers want another unit. */
  climb(lines) {
    const [low, high] = extent(lines.map(({ values }) => values));
    const climbs = this.unit.serve(Math.max(Math.abs(low), Math.abs(high), this.options.least));
    if (climbs) Object.assign(this, { range: new Range(this.options.least * this.unit.factor) });
    return climbs;
  }

  rerange() {
    const shown = this.columns.filter((_, i) => this.legend.isShown(this.lines[i].key));
    if (this.overlay && this.fits) shown.push(scaled(this.overlay.columns[0].values, this.unit.factor));
    this.range.follow(...extent(shown, this.options.zero && shown.length ? [0] : []));
  }

  draw(isWanted = this.isSeen) {
    if (!isWanted) return;
    this.u.setData([this.t, ...this.columns], false);
    this.u.setScale("x", { min: this.span[0], max: this.span[1] });
    this.tellSeldom();
  }

  retoggle() {
    this.range.forget();
    this.rerange();
    this.lines.forEach(({ key }, i) => this.u.setSeries(i + 1, { show: this.legend.isShown(key) }, false));
    this.draw();
  }

  shade(u) {
    if (!this.wall || !this.legend.isShown("wall")) return;
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.fillStyle = colour("wall-fill");
    u.ctx.fill(halfPlane(u, this.t, scaled(this.wall.values, this.unit.factor), this.wall.side));
    u.ctx.restore();
  }

  /** The same quantity of another run, faintly. */
  layOver(u) {
    if (!this.overlay) return undefined;
    const [t, values] = [times(this.overlay), scaled(this.overlay.columns[0].values, this.unit.factor)];
    const rough = strips(u, t, values);
    if (rough) return drawStrips(u, rough, OVERLAY);
    u.ctx.save();
    u.ctx.beginPath();
    u.ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    u.ctx.clip();
    u.ctx.strokeStyle = colour(OVERLAY.colour);
    u.ctx.lineWidth = OVERLAY.width * devicePixelRatio;
    u.ctx.stroke(linePath(u, t, values));
    return u.ctx.restore();
  }

  /** The numbers under the cursor, or the last ones. */
  tell() {
    if (!this.u) return;
    const [begin, end] = this.viewport.measured;
    const at = end === undefined ? this.u.cursor.idx : this.u.valToIdx(end);
    if (begin !== undefined && at != null) return this.measure(this.u.valToIdx(begin), at);
    const texts = this.columns.map((values) => steady(at == null ? last(values) : values[at], DECIMALS));
    const time = at == null ? "" : `at ${steady(this.t[at], 4)} s`;
    return this.legend.tell(texts, time || this.note);
  }

  /** The differences between two rows. */
  measure(from, to) {
    const texts = this.columns.map((values) => `Δ ${steady(values[to] - values[from], DECIMALS)}`);
    const time = this.t[to] - this.t[from];
    this.legend.tell(texts, `Δ ${steady(time, 4)} s${time ? `, ${amount(Math.abs(1 / time), "Hz")}` : ""}`);
  }

  select(u) {
    const { left, width } = u.select;
    if (width > 0) this.viewport.at(u.posToVal(left, "x"), u.posToVal(left + width, "x"));
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  }

  size() {
    return { width: Math.max(120, this.plot.clientWidth), height: Math.max(60, this.plot.clientHeight) };
  }

  resize() {
    const size = this.size();
    if (size.width !== this.u.width || size.height !== this.u.height) this.u.setSize(size);
  }
}
