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
