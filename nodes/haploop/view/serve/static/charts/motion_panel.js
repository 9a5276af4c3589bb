// The loop in motion: wall, device, cable to its motor and hand, to scale along the line on which they move.

import { amount } from "../drawing/amounts.js";
import { FONT } from "../drawing/axes.js";
import { fitCanvas, make, put } from "../dom.js";
import { colour } from "../drawing/palette.js";
import { extent, Range } from "../drawing/range.js";
import { newest } from "../snapshot.js";

const HEIGHT = 170;
const LANE = 0.45;
const COARSE = "No picture: for this time only the minimum and maximum of each interval are kept here.";
const BODIES = { x: ["device", "ink", 9], tip_x: ["tip", "tip", 7], hand_x: ["hand", "hand", 13] };

export class MotionPanel {
  /** @param {HTMLElement} host takes the picture. */
  constructor(host) {
    this.canvas = make("canvas", { height: HEIGHT, role: "img", "aria-label": "wall, device and hand as they stand now" });
    this.note = make("p", { class: "about" });
    this.range = new Range(1e-4);
    host.append(make("h2", {}, "In motion"), this.canvas, this.note);
    this.tell = (words) => put(this.note, words); // with the picture: words that lag contradict it
    fitCanvas(this.canvas, HEIGHT, () => this.last && this.show(...this.last));
  }

  show(snapshot, state) {
    this.last = [snapshot, state];
    const { tables: { position, force } } = snapshot;
    const { wall } = state;
    const ratio = devicePixelRatio;
    const { width } = this.canvas;
    const ctx = this.canvas.getContext("2d");
    ctx.clearRect(0, 0, width, this.canvas.height);
    if (!position) return this.tell("Nothing moves yet.");
    const bodies = Object.keys(BODIES).flatMap((name) => {
      const column = position.columns.find((one) => one.name === name);
      return column ? [{ name, values: column.values, at: newest(column) }] : [];
    });
    const face = wall?.into_wall ? wall.position : NaN;
    this.range.follow(...extent(bodies.map(({ values }) => values), Number.isFinite(face) ? [face] : []));
    const [low, high] = this.range.now;
    const across = (x) => 24 * ratio + ((x - low) / (high - low)) * (width - 48 * ratio);
    this.wall(ctx, across(face), wall?.into_wall, width);
    this.links(ctx, bodies.map(({ at }) => across(at)), ratio);
    bodies.forEach((body, i) => this.body(ctx, body, across(body.at), i, ratio));
    const total = force?.columns.find(({ name }) => name === "total");
    const depth = (bodies[0].at - face) * (wall?.into_wall ?? 0);
    if (!Number.isFinite(bodies[0].at)) return this.tell(snapshot.coarse ? COARSE : "Not received yet.");
    const where = depth > 0 ? `${amount(depth, "m")} inside the wall` : "outside the wall";
    return this.tell(`${Number.isFinite(face) ? where : "no wall"}; ${amount(high - low, "m")} across${total ? `; force ${amount(newest(total), "N")}` : ""}`);
  }

  wall(ctx, x, side, width) {
    if (!Number.isFinite(x) || !side) return;
    ctx.fillStyle = colour("wall-fill");
    ctx.strokeStyle = colour("wall");
    const [from, to] = side > 0 ? [x, width] : [0, x];
    ctx.fillRect(from, 0, to - from, ctx.canvas.height);
    ctx.lineWidth = 2 * devicePixelRatio;
    ctx.beginPath();
    ctx.moveTo(x, 0);
    ctx.lineTo(x, ctx.canvas.height);
    ctx.stroke();
  }

  /** Cable and grip: from one body to the next. */
  links(ctx, xs, ratio) {
    ctx.strokeStyle = colour("grey");
    ctx.lineWidth = 1.5 * ratio;
    ctx.setLineDash([4 * ratio, 3 * ratio]);
    ctx.beginPath();
    xs.forEach((x, i) => ctx.lineTo(x, this.lane(ctx, i)));
    ctx.stroke();
    ctx.setLineDash([]);
  }

  lane = (ctx, i) => ctx.canvas.height * (LANE + 0.2 * i);

  body(ctx, { name }, x, i, ratio) {
    const [label, ink, radius] = BODIES[name];
    ctx.fillStyle = colour(ink);
    ctx.beginPath();
    ctx.arc(x, this.lane(ctx, i), radius * ratio, 0, 2 * Math.PI);
    ctx.fill();
    ctx.font = `${12 * ratio}px ${FONT}`;
    ctx.textAlign = "center";
    ctx.fillStyle = colour("ink");
    ctx.fillText(label, x, this.lane(ctx, i) - (radius + 5) * ratio);
  }
}
