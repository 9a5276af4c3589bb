"""Labels on lines and beside points, placed where they cover no other label; a label without room is not written."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox, BboxBase

# Where a label may be placed around its point, preferred places first, and how far from it, in pixels.
_DIRECTIONS = [(0, 1), (1, 1), (1, 0), (0, -1), (-1, 1), (1, -1), (-1, 0), (-1, -1)]
_NEAR_PX, _FAR_PX = (2.0, 4.0), (2.0, 4.0, 10.0, 18.0, 28.0, 42.0)
_AROUND_STAR_PX, _STAR_HALF_PX, _MARKER_PX = (3.0, 13.0, 27.0, 45.0), 7.0, (8.0, 8.0)
_MARGIN_PX = 1.5
# Places tried along a line.
_PLACES = 60
_FRAME = {"boxstyle": "round,pad=0.18", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


class LabelRoom:
    """The room for labels in a panel whose place, size and limits are fixed.

    No label covers another, or an area marked as taken; areas to be avoided, and then lines, are covered only where
    there is no other place.
    """

    def __init__(self, ax: Axes) -> None:
        self._ax, self._frame = ax, ax.get_window_extent()
        self._taken: list[BboxBase] = []
        self._avoided: list[BboxBase] = []
        self._lines: list[Path] = []

    def pixels(self, points: Any) -> np.ndarray:
        return self._ax.transData.transform(points)

    def take(self, x: float, y: float, half_px: float) -> None:
        """Keeps a square around a point free, in data coordinates."""
        self._taken.append(_box(self.pixels((x, y)), (2.0 * half_px, 2.0 * half_px)))

    def avoid_texts(self, texts: Iterable[Text]) -> None:
        self._avoided += [text.get_window_extent() for text in texts]

    def avoid_markers(self) -> None:
        for line in self._ax.lines:
            if line.get_marker() not in ("", "None", None):
                places = np.asarray(line.get_transform().transform(line.get_xydata()))
                self._avoided += [_box(place, _MARKER_PX) for place in places]

    def avoid_lines(self, lines: Iterable[np.ndarray]) -> None:
        """Avoids lines; data coordinates, shape (n, 2) each."""
        from matplotlib.path import Path

        self._lines += [Path(self.pixels(line)) for line in lines if len(line) > 1]

    def on_line(self, points: np.ndarray, text: str, colour: str, gid: str) -> None:
        """Writes on a line of points in data coordinates, shape (n, 2), as near to its middle as there is room."""
        pixels = [place for place in self.pixels(points) if self._frame.contains(*place)]
        order = np.argsort(np.abs(np.arange(len(pixels)) - len(pixels) // 2), kind="stable")
        size = self.size(text)
        boxes = (_box(pixels[index], size) for index in order[:: max(1, len(order) // _PLACES)])
        if box := self.best(boxes, lambda box: box.count_overlaps(self._avoided)):
            self.write(box, text, color=colour, gid=gid, bbox=_FRAME, zorder=6)

    def beside(
        self, x: float, y: float, texts: Sequence[str], colour: str, gid: str, off: Sequence[np.ndarray] = ()
    ) -> None:
        """Writes the first of some texts, ever shorter, that has room beside a marker, which stays free.

        Args:
            off: areas that the text keeps off, each given by two opposite corners in data coordinates, shape (2, 2);
                where no text can, the last one that has room is written on them.
        """
        from matplotlib.transforms import Bbox

        self.take(x, y, _STAR_HALF_PX)
        at, found = self.pixels((x, y)), None
        avoided = [*self._avoided, *(Bbox(np.sort(self.pixels(corners), axis=0)) for corners in off)]
        for text in texts:
            size = self.size(text)
            boxes = (box for distance in _AROUND_STAR_PX for box in around(at, size, _STAR_HALF_PX + distance))
            if box := self.best(boxes, lambda box: (box.count_overlaps(avoided) > 0, self.crossings(box) > 0)):
                found = box, text
                if not off or not box.count_overlaps(avoided):
                    break
        if found:
            self.write(*found, color=colour, gid=gid, bbox=_FRAME, zorder=6, fontweight="bold")

    def best(self, boxes: Iterable[Bbox], penalty: Callable[[Bbox], Any]) -> Bbox | None:
        """Returns the first box with the least penalty among those that lie in the panel and cover nothing taken."""
        inside = (box for box in boxes if self._frame.contains(*box.min) and self._frame.contains(*box.max))
        return min((box for box in inside if not box.count_overlaps(self._taken)), key=penalty, default=None)

    def crossings(self, box: Bbox) -> int:
        """Counts the lines that run through a box."""
        return sum(line.intersects_bbox(box, filled=False) for line in self._lines)

    def size(self, text: str) -> tuple[float, float]:
        probe = self._ax.text(0.5, 0.5, text, transform=self._ax.transAxes, fontsize=SMALL, fontweight="bold")
        extent = probe.get_window_extent()
        probe.remove()
        return extent.width + 2.0 * _MARGIN_PX, extent.height + 2.0 * _MARGIN_PX

    def write(self, box: Bbox, text: str, **look: Any) -> tuple[float, float]:
        """Writes in the middle of a box, which is taken from then on; returns where, in data coordinates."""
        self._taken.append(box)
        x, y = self._ax.transData.inverted().transform(box.get_points().mean(axis=0))
        self._ax.text(x, y, text, ha="center", va="center", fontsize=SMALL, **look)
        return x, y


@dataclass(frozen=True)
class Label:
    """Text for a point, in data coordinates; of every ``group`` at least one is placed. ``half_px`` is of the point."""

    x: float
    y: float
    text: str
    colour: str
    group: str = ""
    half_px: float = 5.0


def place_labels(ax: Axes, labels: Sequence[Label], lines: Iterable[np.ndarray]) -> None:
    """Writes labels beside their points; place, size and limits of the axes must be fixed.

    Args:
        labels: the important ones first; no label covers the point of another.
        lines: data coordinates of lines that labels keep off where they can, shape (n, 2) each.
    """
    room = LabelRoom(ax)
    room.avoid_lines(lines)
    for label in labels:
        room.take(label.x, label.y, label.half_px)
    written = {label.group for label in labels if _place(ax, room, label, _NEAR_PX)}
    for label in labels:
        if label.group not in written and _place(ax, room, label, _FAR_PX):
            written.add(label.group)


def _place(ax: Axes, room: LabelRoom, label: Label, reach: Sequence[float]) -> bool:
    """Writes a label at its best free place, with a thin line to a distant point; tells whether there was one."""
    from matplotlib.patheffects import withStroke

    at, size = room.pixels((label.x, label.y)), room.size(label.text)
    for distance in reach:
        if box := room.best(around(at, size, label.half_px + distance), room.crossings):
            halo = [withStroke(linewidth=2.0, foreground="white")]
            x, y = room.write(box, label.text, color=label.colour, gid="rate", zorder=5, path_effects=halo)
            if distance > _NEAR_PX[-1] + min(size):
                ax.plot([label.x, x], [label.y, y], color=label.colour, linewidth=0.6, alpha=0.6, zorder=4)
            return True
    return False


def around(at: np.ndarray, size: tuple[float, float], distance: float) -> Iterator[Bbox]:
    """Yields the boxes of a size at a distance from a point, in pixels, preferred ones first."""
    for right, up in _DIRECTIONS:
        yield _box(at + np.array((right, up)) * (distance + np.array(size) / 2.0), size)


def _box(middle: np.ndarray, size: tuple[float, float]) -> Bbox:
    from matplotlib.transforms import Bbox

    return Bbox.from_bounds(middle[0] - size[0] / 2.0, middle[1] - size[1] / 2.0, *size)
