// Paths through the points of a uPlot chart, broken where a number is missing (NaN).

import { colour } from "./palette.js";

/** From data to canvas pixels: what a path needs, computed once for all its points. */
function projection(u) {
  const { left, top, width, height } = u.bbox;
  const { x, y } = u.scales;
  return { x0: x.min, kx: width / (x.max - x.min), left, y1: y.max, ky: height / (y.max - y.min), top };
}

// A line passes its points at this many pixels at most, and goes through every steep peak: straight stretches are drawn in
// one stroke, since most of a picture's time goes into the bends of its lines.
const NEAR_PX = 0.25;

/**
 * A line through all points, or only through those for which `drawn` is true: a stretch continues to the point after it.
 *
 * @param {(i: number) => boolean} [drawn]
 */
export function line(u, xs, ys, drawn) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const path = new Path2D();
  // From the last bend at x, y the line runs to the point that is held, as long as its slope is between low and high.
  let [pen, x, y, holds, heldX, heldY, low, high] = [false, 0, 0, false, 0, 0, 0, 0];
  const bend = () => {
    if (holds) path.lineTo(heldX, heldY);
    if (holds) [x, y] = [heldX, heldY];
    holds = false;
  };
  for (let i = 0; i < xs.length; i++) {
    const px = left + (xs[i] - x0) * kx;
    const py = top + (y1 - ys[i]) * ky;
    if (!(px - px + py - py === 0)) {
      bend();
      pen = false;
      continue;
    }
    const goesOn = drawn ? drawn(i) : true;
    if (pen) {
      const slope = (py - y) / (px - x);
      const isPeak = Math.abs(slope) > 1 && (py - heldY) * (heldY - y) < 0;
      if (holds && !(px > heldX && slope >= low && slope <= high && !isPeak)) bend();
      const dx = px - x;
      if (dx > 0) {
        const near = NEAR_PX * Math.hypot(1, (py - y) / dx);
        const [least, most] = [(py - near - y) / dx, (py + near - y) / dx];
        [low, high] = holds ? [Math.max(low, least), Math.min(high, most)] : [least, most];
        [holds, heldX, heldY] = [true, px, py];
      } else {
        path.lineTo(px, py);
        [x, y] = [px, py];
      }
      if (!goesOn) bend();
    } else {
      path.moveTo(px, py);
      [x, y] = [px, py];
    }
    pen = goesOn;
  }
  bend();
  return path;
}

// A line that goes up and down by more than this many times the chart's height is rough, if it has about a point per pixel;
// a fourth of that is enough where it turns every third pixel.
const ROUGH = 50;
const OFTEN_PX = 3;
const POINTS_A_PIXEL = 0.6;
// A strip thicker than this, in line widths, is filled faintly where strips fill more than this part of what all of them cover.
const THICK = 4;
const FILLED = 0.5;
const FAINT = 0.45;

/**
 * A rough line as upright strips: top and bottom of each column of canvas pixels of the chart, NaN where there is none; null
 * where the line is smooth or its points lie apart. A pen that moves up and down thousands of times takes twenty times as long.
 */
export function strips(u, xs, ys) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const wide = Math.round(u.bbox.width);
  if (xs.length < POINTS_A_PIXEL * u.bbox.width) return null;
  const [tops, bottoms] = [new Float32Array(wide).fill(NaN), new Float32Array(wide).fill(NaN)];
  const begin = left - Math.round(left);
  let [at, low, high, y, way, turns, rise] = [NaN, 0, 0, NaN, 0, 0, 0];
  // A strip extends to the next one; columns outside the chart are left out, since writing there takes long.
  const fill = (from, to) => {
    for (let x = Math.max(0, from), end = Math.min(wide, to); x < end; x++) {
      tops[x] = low;
      bottoms[x] = high;
    }
  };
  for (let i = 0; i < xs.length; i++) {
    const px = Math.round(begin + (xs[i] - x0) * kx);
    const py = top + (y1 - ys[i]) * ky;
    const isThere = py - py === 0;
    if (px !== at || !isThere) {
      if (at === at) fill(at, isThere ? px : at + 1);
      if (isThere) [at, low, high] = [px, y < py ? y : py, y > py ? y : py];
      else at = NaN;
    } else if (py < low) low = py;
    else if (py > high) high = py;
    if (y === y && isThere) {
      way += Math.abs(py - y);
      if ((py - y) * rise < 0) turns++;
      if (py !== y) rise = py - y;
    }
    y = isThere ? py : NaN;
  }
  if (at === at) fill(at, at + 1);
  const isBusy = turns * OFTEN_PX * devicePixelRatio > u.bbox.width;
  return way > (isBusy ? ROUGH / 4 : ROUGH) * u.bbox.height ? { tops, bottoms } : null;
}

// Strips are drawn on a separate sheet, which is laid on the chart: a rectangle for each takes three times as long.
const sheet = new OffscreenCanvas(1, 1);
const paper = sheet.getContext("2d");
let buffer = new ArrayBuffer(0);

/** Draw strips with a line's width and dashes; where they cover the same heights again and again, faintly between edges. */
export function drawStrips(u, { tops, bottoms }, { colour: name, width, dash = [] }) {
  const pen = Math.max(1, Math.round(width * devicePixelRatio));
  const wide = tops.length;
  const [low, high, mean] = heights(tops, bottoms);
  const top = Math.max(Math.round(u.bbox.top), Math.floor(low - pen));
  const tall = Math.min(Math.round(u.bbox.top + u.bbox.height), Math.ceil(high + pen)) - top;
  if (!(tall > 0)) return;
  if (buffer.byteLength < 4 * wide * tall) buffer = new ArrayBuffer(4 * wide * tall);
  const pixels = new Uint32Array(buffer, 0, wide * tall).fill(0);
  const pattern = dash.flatMap((length, i) => Array(length).fill(i % 2 === 1));
  const [full, faint] = [1, FAINT].map((alpha) => pixelOf(name, alpha));
  const isFaint = mean > FILLED * (high - low);
  for (let x = 0; x < wide; x++) {
    if (Number.isNaN(tops[x])) continue;
    const from = Math.round(tops[x] - top - pen / 2);
    const to = Math.max(from + pen, Math.round(bottoms[x] - top + pen / 2));
    const isThick = to - from > THICK * pen;
    const isGap = pattern.length > 0 && pattern[Math.floor(x / devicePixelRatio) % pattern.length];
    const edge = !isGap ? full : isThick ? faint : 0; // a peak is not left out between two dashes
    const [inside, below] = isFaint && isThick ? [from + pen, to - pen] : [to, to];
    let at = Math.max(0, from) * wide + x;
    for (const end = Math.min(tall, inside) * wide; at < end; at += wide) pixels[at] = edge;
    for (const end = Math.min(tall, below) * wide; at < end; at += wide) pixels[at] = faint;
    for (const end = Math.min(tall, to) * wide; at < end; at += wide) pixels[at] = edge;
  }
  if (sheet.width < wide || sheet.height < tall) Object.assign(sheet, { width: wide, height: tall });
  paper.putImageData(new ImageData(new Uint8ClampedArray(buffer, 0, 4 * wide * tall), wide, tall), 0, 0);
  u.ctx.drawImage(sheet, 0, 0, wide, tall, Math.round(u.bbox.left), top, wide, tall);
}

/** Highest and lowest pixel of strips, and their mean height. */
function heights(tops, bottoms) {
  let [low, high, sum, count] = [Infinity, -Infinity, 0, 0];
  for (let x = 0; x < tops.length; x++) {
    if (tops[x] < low) low = tops[x];
    if (bottoms[x] > high) high = bottoms[x];
    if (tops[x] <= bottoms[x]) [sum, count] = [sum + bottoms[x] - tops[x], count + 1];
  }
  return [low, high, sum / count];
}

/** A colour of the page as the number of a pixel. */
function pixelOf(name, alpha) {
  const [red, green, blue] = colour(name).match(/[0-9a-f]{2}/gi).map((two) => parseInt(two, 16));
  return ((Math.round(255 * alpha) << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}

/** Each pair of points, the extremes of an interval, as a box around what lies between them. */
export function boxes(u, xs, ys) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const path = new Path2D();
  for (let i = 0; i + 1 < xs.length; i += 2) {
    const half = (xs[i + 1] - xs[i]) / 2;
    const [from, to] = [xs[i] - half, xs[i + 1] + half].map((x) => left + (x - x0) * kx);
    const [one, other] = [ys[i], ys[i + 1]].map((y) => top + (y1 - y) * ky);
    if (one - one + other - other === 0) path.rect(from, Math.min(one, other), to - from, Math.abs(other - one));
  }
  return path;
}

/** Small squares at all points. */
export function dots(u, xs, ys, size) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const path = new Path2D();
  const half = size / 2;
  for (let i = 0; i < xs.length; i++) {
    const px = left + (xs[i] - x0) * kx;
    const py = top + (y1 - ys[i]) * ky;
    if (px - px + py - py === 0) path.rect(px - half, py - half, size, size);
  }
  return path;
}

/** The half-plane on one side of a line: down to the bottom of the chart (`side` < 0) or up to its top. */
export function halfPlane(u, xs, ys, side) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const edge = side < 0 ? top + u.bbox.height : top;
  const path = new Path2D();
  let open = false;
  let px = 0;
  for (let i = 0; i < xs.length; i++) {
    const there = !Number.isNaN(ys[i]);
    if (open && !there) path.lineTo(px, edge);
    px = left + (xs[i] - x0) * kx;
    if (there && !open) path.moveTo(px, edge);
    if (there) path.lineTo(px, top + (y1 - ys[i]) * ky);
    open = there;
  }
  if (open) path.lineTo(px, edge);
  return path;
}
