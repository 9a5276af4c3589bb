"""Paths through the points of a chart: few bends, near every point, and through every peak."""

import math
from itertools import pairwise

import pytest

# The points of a path through these values, one a pixel, in a chart as high as 100.
DRAWN = """async (ys) => {
    const { line } = await import("/static/drawing/paths.js");
    const [Own, points] = [globalThis.Path2D, []];
    globalThis.Path2D = class {
        moveTo(x, y) { points.push(["move", x, y]); }
        lineTo(x, y) { points.push(["line", x, y]); }
    };
    const scales = { x: { min: 0, max: ys.length }, y: { min: 0, max: 100 } };
    const bbox = { left: 0, top: 0, width: ys.length, height: 100 };
    line({ bbox, scales }, ys.map((_, x) => x), ys.map((y) => y ?? NaN));
    globalThis.Path2D = Own;
    return points;
}"""


def drawn(page, ys):
    return [(how, x, 100 - y) for how, x, y in page.evaluate(DRAWN, ys)]


def distance(point, bends):
    """From a point to the nearest piece of a line."""
    pieces = pairwise(bends)
    return min(
        math.dist(point, (x + t * (u - x), y + t * (v - y)))
        for (x, y), (u, v) in pieces
        for t in [
            max(0.0, min(1.0, ((point[0] - x) * (u - x) + (point[1] - y) * (v - y)) / math.dist((x, y), (u, v)) ** 2))
        ]
    )


@pytest.mark.slow
def test_a_straight_line_is_one_stroke_and_is_broken_where_there_are_no_values(stand_in, page):
    ramp = [i / 10 for i in range(600)]
    assert [how for how, *_ in drawn(page, ramp)] == ["move", "line"]
    broken = drawn(page, [None if 200 <= i < 300 else y for i, y in enumerate(ramp)])
    assert [(how, x) for how, x, _ in broken] == [("move", 0), ("line", 199), ("move", 300), ("line", 599)]


@pytest.mark.slow
@pytest.mark.parametrize("period", [7.3, 31.0, 400.0])
@pytest.mark.parametrize("height", [0.5, 40.0])
def test_a_line_stays_near_every_point_and_reaches_every_peak(stand_in, page, period, height):
    ys = [50 + height * math.sin(2 * math.pi * i / period) for i in range(600)]
    bends = [(x, y) for _, x, y in drawn(page, ys)]
    assert len(bends) < 600
    assert max(distance(point, bends) for point in enumerate(ys)) < 0.5
    for x in range(1, 599):
        if height > 10 and period < 100 and (ys[x] - ys[x - 1]) * (ys[x + 1] - ys[x]) < 0:
            assert min(abs(y - ys[x]) for at, y in bends if abs(at - x) <= 1) < 0.5, x
