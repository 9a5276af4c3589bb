"""Labels beside points, placed where they cover neither each other nor a point; what has no room goes without."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from haploop.tools.figure.style import SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Box = tuple[float, float, float, float]
# Where a label may stand around its point, as unit vectors, the liked ones first; and how far from its edge, in pixels.
_DIRECTIONS = [(0, 1), (1, 1), (1, 0), (0, -1), (-1, 1), (1, -1), (-1, 0), (-1, -1)]
_NEAR_PX, _FAR_PX = (2.0, 4.0), (2.0, 4.0, 10.0, 18.0, 28.0, 42.0)
_MARGIN_PX = 1.5


@dataclass(frozen=True)
class Label:
    """Text for a point, in data coordinates; of every ``group`` at least one is placed. ``half_px`` is the point's."""

    x: float
    y: float
    text: str
    colour: str
    group: str = ""
    half_px: float = 5.0


@dataclass
class _Room:
    """What is taken, in pixels; ``lines`` may be covered, but rather not. Shape of lines: (segments, 2, 2)."""

    inside: Box
    boxes: list[Box]
    lines: np.ndarray
    placed: dict[Label, Box] = field(default_factory=dict)

    def free(self, box: Box) -> bool:
        """Whether a box lies within the axes and covers nothing."""
        left, low, right, high = self.inside
        within = left <= box[0] and low <= box[1] and box[2] <= right and box[3] <= high
        return within and not any(_overlap(box, other) for other in (*self.boxes, *self.placed.values()))

    def crossings(self, box: Box) -> int:
        """How many lines run through a box, near enough: points along them are looked at."""
        along = np.linspace(0.0, 1.0, 60)[:, None, None]
        points = self.lines[:, 0] + along * (self.lines[:, 1] - self.lines[:, 0])
        inside = (points > np.array(box[:2])) & (points < np.array(box[2:]))
        return int(inside.all(axis=2).any(axis=0).sum())


def place_labels(ax: Axes, labels: Sequence[Label], lines: Iterable[np.ndarray]) -> None:
    """Write labels beside their points; call when the axes have their place, size and limits.

    Args:
        labels: the important ones first; no label covers the point of another.
        lines: data coordinates of lines that labels keep off where they can, shape (n, 2) each.
    """
    to_px = ax.transData.transform
    frame = ax.get_window_extent()
    corners = [_square(to_px((label.x, label.y)), label.half_px) for label in labels]
    segments = [to_px(line) for line in lines if len(line) > 1]
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in segments]
    room = _Room(
        (frame.x0, frame.y0, frame.x1, frame.y1),
        corners,
        np.concatenate([np.empty((0, 2, 2)), *pairs]),
    )
    sizes = _sizes(ax, {label.text for label in labels})
    for group in dict.fromkeys(label.group for label in labels):
        members = [label for label in labels if label.group == group]
        for reach in (_NEAR_PX, _FAR_PX):
            if any(_place(label, to_px((label.x, label.y)), sizes[label.text], reach, room) for label in members):
                break
    for label in labels:
        if label not in room.placed:
            _place(label, to_px((label.x, label.y)), sizes[label.text], _NEAR_PX, room)
    _write(ax, room.placed)


def _place(label: Label, at: np.ndarray, size: tuple[float, float], reach: Sequence[float], room: _Room) -> bool:
    """Find the best free place for a label; False if there is none."""
    for distance in reach:
        boxes = [_box(at, size, direction, label.half_px + _MARGIN_PX + distance) for direction in _DIRECTIONS]
        if free := [box for box in boxes if room.free(box)]:
            room.placed[label] = min(free, key=room.crossings)
            return True
    return False


def _square(at: np.ndarray, half: float) -> Box:
    return at[0] - half, at[1] - half, at[0] + half, at[1] + half


def _box(at: np.ndarray, size: tuple[float, float], direction: tuple[int, int], distance: float) -> Box:
    x, y = (at[i] + direction[i] * (distance + size[i] / 2.0) for i in (0, 1))
    width, height = size[0] / 2.0 + _MARGIN_PX, size[1] / 2.0 + _MARGIN_PX
    return x - width, y - height, x + width, y + height


def _overlap(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _sizes(ax: Axes, texts: set[str]) -> dict[str, tuple[float, float]]:
    """Width and height of each text in pixels."""
    probe = ax.text(0.5, 0.5, "", transform=ax.transAxes, fontsize=SMALL)
    sizes = {}
    for text in texts:
        probe.set_text(text)
        extent = probe.get_window_extent()
        sizes[text] = extent.width, extent.height
    probe.remove()
    return sizes


def _write(ax: Axes, placed: dict[Label, Box]) -> None:
    from matplotlib.patheffects import withStroke

    to_data = ax.transData.inverted().transform
    for label, box in placed.items():
        middle = (box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0
        x, y = to_data(middle)
        ax.text(
            x, y, label.text, ha="center", va="center", fontsize=SMALL, color=label.colour, gid="rate", zorder=5,
            path_effects=[withStroke(linewidth=2.0, foreground="white")],
        )  # fmt: skip
        away = np.hypot(*(np.array(middle) - ax.transData.transform((label.x, label.y))))
        if away > _FAR_PX[1] + max(box[2] - box[0], box[3] - box[1]):
            ax.plot([label.x, x], [label.y, y], color=label.colour, linewidth=0.6, alpha=0.6, zorder=4)
