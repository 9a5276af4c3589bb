"""Labels on lines and beside points, placed where they cover no other label; what has no room is not written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text

# Left, low, right and high end, in pixels.
Box = tuple[float, float, float, float]
# Where a label may stand around its point, the liked ones first, and how far from it, in pixels.
_DIRECTIONS = [(0, 1), (1, 1), (1, 0), (0, -1), (-1, 1), (1, -1), (-1, 0), (-1, -1)]
_NEAR_PX, _FAR_PX = (2.0, 4.0), (2.0, 4.0, 10.0, 18.0, 28.0, 42.0)
_AROUND_STAR_PX, _STAR_HALF_PX = (3.0, 13.0, 27.0, 45.0), 7.0
_MARGIN_PX = 1.5
# Places tried along a line, and points looked at along each of its segments.
_PLACES, _SAMPLES = 60, 60
_FRAME = {"boxstyle": "round,pad=0.18", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


class LabelRoom:
    """The room for labels in a panel that has its place, size and limits.

    No label covers another, or what is marked as taken; what is to be avoided, and then lines, are covered only where
    there is no other place.
    """

    def __init__(self, ax: Axes) -> None:
        frame = ax.get_window_extent()
        self._ax = ax
        self._frame: Box = (frame.x0, frame.y0, frame.x1, frame.y1)
        self._taken: list[Box] = []
        self._avoided: list[Box] = []
        self._segments = np.empty((0, 2, 2))

    def pixels(self, points: Any) -> np.ndarray:
        return self._ax.transData.transform(points)

    def take(self, x: float, y: float, half_px: float) -> None:
        """Keeps a square around a point free, in data coordinates."""
        self._taken.append(_square(self.pixels((x, y)), half_px))

    def avoid_texts(self, texts: Iterable[Text]) -> None:
        for text in texts:
            extent = text.get_window_extent()
            self._avoided.append((extent.x0, extent.y0, extent.x1, extent.y1))

    def avoid_markers(self) -> None:
        for line in self._ax.lines:
            if line.get_marker() not in ("", "None", None):
                places = np.asarray(line.get_transform().transform(line.get_xydata()))
                self._avoided += [_square(place, 4.0) for place in places]

    def avoid_lines(self, lines: Iterable[np.ndarray]) -> None:
        """Avoids lines; data coordinates, shape (n, 2) each."""
        pixels = [self.pixels(line) for line in lines if len(line) > 1]
        segments = [np.stack([line[:-1], line[1:]], axis=1) for line in pixels]
        self._segments = np.concatenate([self._segments, *segments])

    def on_line(self, points: np.ndarray, text: str, colour: str, gid: str) -> None:
        """Writes on a line of points in data coordinates, shape (n, 2), as near to its middle as there is room."""
        pixels = self.pixels(points)
        pixels = pixels[((pixels >= self._frame[:2]) & (pixels <= self._frame[2:])).all(axis=1)]
        order = np.argsort(np.abs(np.arange(len(pixels)) - len(pixels) // 2), kind="stable")
        places = [tuple(pixels[index]) for index in order[:: max(1, len(order) // _PLACES)]]
        size = self.size(text)
        if box := self.best((_box(place, size) for place in places), self._covers_avoided):
            self.write(box, text, color=colour, gid=gid, bbox=_FRAME, zorder=6)

    def beside(self, x: float, y: float, texts: Sequence[str], colour: str, gid: str) -> None:
        """Writes the first of some texts that has room beside a sign, which stays free."""
        self.take(x, y, _STAR_HALF_PX)
        at = self.pixels((x, y))
        for text in texts:
            size = self.size(text)
            boxes = (box for distance in _AROUND_STAR_PX for box in around(at, size, _STAR_HALF_PX + distance))
            if box := self.best(boxes, lambda box: (self._covers_avoided(box), self.crossings(box) > 0)):
                self.write(box, text, color=colour, gid=gid, bbox=_FRAME, zorder=6, fontweight="bold")
                return

    def best(self, boxes: Iterable[Box], penalty: Callable[[Box], Any]) -> Box | None:
        """Returns the first of the boxes with the least penalty that lie in the panel and cover nothing taken."""
        left, low, right, high = self._frame
        free = [
            box
            for box in boxes
            if left <= box[0] and low <= box[1] and box[2] <= right and box[3] <= high
            if not any(_overlap(box, other) for other in self._taken)
        ]
        return min(free, key=penalty, default=None)

    def crossings(self, box: Box) -> int:
        """Counts the segments of lines that run through a box, near enough: points along them are looked at."""
        along = np.linspace(0.0, 1.0, _SAMPLES)[:, None, None]
        points = self._segments[:, 0] + along * (self._segments[:, 1] - self._segments[:, 0])
        inside = (points > np.array(box[:2])) & (points < np.array(box[2:]))
        return int(inside.all(axis=2).any(axis=0).sum())

    def size(self, text: str) -> tuple[float, float]:
        probe = self._ax.text(0.5, 0.5, text, transform=self._ax.transAxes, fontsize=SMALL, fontweight="bold")
        extent = probe.get_window_extent()
        probe.remove()
        return extent.width + 2.0 * _MARGIN_PX, extent.height + 2.0 * _MARGIN_PX

    def write(self, box: Box, text: str, **look: Any) -> tuple[float, float]:
        """Writes in the middle of a box, which is taken from then on; returns where, in data coordinates."""
        self._taken.append(box)
        middle = (box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0
        x, y = self._ax.transData.inverted().transform(middle)
        self._ax.text(x, y, text, ha="center", va="center", fontsize=SMALL, **look)
        return x, y

    def _covers_avoided(self, box: Box) -> bool:
        return any(_overlap(box, other) for other in self._avoided)


@dataclass(frozen=True)
class Label:
    """Text for a point, in data coordinates; of every ``group`` at least one is placed. ``half_px`` is the point's."""

    x: float
    y: float
    text: str
    colour: str
    group: str = ""
    half_px: float = 5.0


def place_labels(ax: Axes, labels: Sequence[Label], lines: Iterable[np.ndarray]) -> None:
    """Writes labels beside their points; the axes must have their place, size and limits.

    Args:
        labels: the important ones first; no label covers the point of another.
        lines: data coordinates of lines that labels keep off where they can, shape (n, 2) each.
    """
    room = LabelRoom(ax)
    room.avoid_lines(lines)
    for label in labels:
        room.take(label.x, label.y, label.half_px)
    placed: set[Label] = set()
    for group in dict.fromkeys(label.group for label in labels):
        members = [label for label in labels if label.group == group]
        for reach in (_NEAR_PX, _FAR_PX):
            if fitting := next((label for label in members if _place(ax, room, label, reach)), None):
                placed.add(fitting)
                break
    for label in labels:
        if label not in placed:
            _place(ax, room, label, _NEAR_PX)


def _place(ax: Axes, room: LabelRoom, label: Label, reach: Sequence[float]) -> bool:
    """Writes a label at its best free place, with a thin line to its point from afar; tells whether there was one."""
    from matplotlib.patheffects import withStroke

    at, size = room.pixels((label.x, label.y)), room.size(label.text)
    for distance in reach:
        if box := room.best(around(at, size, label.half_px + distance), room.crossings):
            halo = [withStroke(linewidth=2.0, foreground="white")]
            x, y = room.write(box, label.text, color=label.colour, gid="rate", zorder=5, path_effects=halo)
            away = float(np.hypot(*(room.pixels((x, y)) - at)))
            if away > _FAR_PX[1] + max(box[2] - box[0], box[3] - box[1]):
                ax.plot([label.x, x], [label.y, y], color=label.colour, linewidth=0.6, alpha=0.6, zorder=4)
            return True
    return False


def around(at: np.ndarray, size: tuple[float, float], distance: float) -> Iterator[Box]:
    """Yields the boxes of a size at a distance from a point, in pixels, the liked ones first."""
    for right, up in _DIRECTIONS:
        x, y = at[0] + right * (distance + size[0] / 2.0), at[1] + up * (distance + size[1] / 2.0)
        yield _box((x, y), size)


def _box(middle: tuple[float, ...], size: tuple[float, float]) -> Box:
    x, y, width, height = *middle, size[0] / 2.0, size[1] / 2.0
    return x - width, y - height, x + width, y + height


def _square(at: np.ndarray, half: float) -> Box:
    return float(at[0]) - half, float(at[1]) - half, float(at[0]) + half, float(at[1]) + half


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
