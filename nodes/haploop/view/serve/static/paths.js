// Paths through the points of a uPlot chart, broken where a number is not there (NaN).

/** From data to canvas pixels; what a path needs, worked out once for all its points. */
function projection(u) {
  const { left, top, width, height } = u.bbox;
  const { x, y } = u.scales;
  return { x0: x.min, kx: width / (x.max - x.min), left, y1: y.max, ky: height / (y.max - y.min), top };
}

/**
 * A line through all points, or through those alone that `drawn` is true of: a stretch goes on to the point after it.
 *
 * @param {(i: number) => boolean} [drawn]
 */
export function line(u, xs, ys, drawn) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const path = new Path2D();
  let pen = false;
  for (let i = 0; i < xs.length; i++) {
    const px = left + (xs[i] - x0) * kx;
    const py = top + (y1 - ys[i]) * ky;
    if (!(px - px + py - py === 0)) {
      pen = false;
      continue;
    }
    if (pen) path.lineTo(px, py);
    else path.moveTo(px, py);
    pen = drawn ? drawn(i) : true;
  }
  return path;
}

// An envelope thinner than this on average, in pixels, is drawn as a line.
const THIN_PX = 2;

/**
 * An envelope, whose rows are the two extremes of one interval after the other: a band from the least to the greatest
 * of each, or the line through their middles where that is thin. No pen goes to and fro, which is slow and grey.
 *
 * @returns {{stroke: Path2D, fill: Path2D | null}} what to draw.
 */
export function band(u, xs, ys) {
  const { x0, kx, left, y1, ky, top } = projection(u);
  const count = ys.length >> 1;
  let [thick, there] = [0, 0];
  for (let i = 0; i < count; i++) {
    const height = Math.abs(ys[2 * i + 1] - ys[2 * i]) * ky;
    if (height >= 0) [thick, there] = [thick + height, there + 1];
  }
  const isThin = thick < THIN_PX * there;
  const path = new Path2D();
  let from = -1;
  for (let i = 0; i <= count; i++) {
    const isThere = i < count && ys[2 * i] - ys[2 * i] + ys[2 * i + 1] - ys[2 * i + 1] === 0;
    if (isThere && from < 0) from = i;
    if (isThere || from < 0) continue;
    const px = (j) => left + ((xs[2 * j] + xs[2 * j + 1]) / 2 - x0) * kx;
    const py = (j, side) => top + (y1 - Math[side](ys[2 * j], ys[2 * j + 1])) * ky;
    path.moveTo(px(from), isThin ? middle(from) : py(from, "max"));
    for (let j = from; j < i; j++) path.lineTo(px(j), isThin ? middle(j) : py(j, "max"));
    if (!isThin) {
      for (let j = i - 1; j >= from; j--) path.lineTo(px(j), py(j, "min"));
      path.closePath();
    }
    from = -1;
  }
  return { stroke: path, fill: isThin ? null : path };

  function middle(j) {
    return top + (y1 - (ys[2 * j] + ys[2 * j + 1]) / 2) * ky;
  }
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
