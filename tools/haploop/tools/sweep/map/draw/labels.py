"""Names written on lines and beside points of a map, none over another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np

from haploop.tools.figure.style import SMALL

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

_MARGIN_PX = 3.0
# Steps from one tried place on a line to the next, and how far from its point a label may stand.
_PLACES, _DISTANCES_PX = 60, (12.0, 22.0, 36.0, 54.0)
_AROUND = [(1, 1), (-1, 1), (1, -1), (-1, -1), (0, 1), (0, -1), (1, 0), (-1, 0)]
_BOX = {"boxstyle": "round,pad=0.18", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


class LabelRoom:
    """The room for labels in a panel that has its place and limits; what has no room is not written."""

    def __init__(self, ax: Axes) -> None:
        self._ax = ax
        self._frame = ax.get_window_extent()
        self._taken: list[Bbox] = []
        self._avoided: list[Bbox] = []
        self._lines: list[Bbox] = []

    def keep_off(self, texts: Iterable[Text]) -> None:
        """Write over none of these, if there is other room."""
        self._avoided += [text.get_window_extent() for text in texts]

    def keep_off_lines(self, lines: Iterable[np.ndarray]) -> None:
        """Write beside no point over these lines, if there is other room; data coordinates, shape (n, 2) each."""
        from matplotlib.transforms import Bbox

        for line in lines:
            ends = self._ax.transData.transform(line)
            for start, end in pairwise(ends):
                share = np.linspace(0.0, 1.0, max(2, int(np.hypot(*(end - start)) / 6.0)))[:, None]
                for x, y in start + share * (end - start):
                    self._lines.append(Bbox.from_extents(x - 2, y - 2, x + 2, y + 2))

    def keep_off_markers(self) -> None:
        """Write over no marker of the panel, if there is other room."""
        from matplotlib.transforms import Bbox

        for line in self._ax.lines:
            if line.get_marker() not in ("", "None", None):
                for x, y in line.get_transform().transform(line.get_xydata()):
                    self._avoided.append(Bbox.from_extents(x - 4, y - 4, x + 4, y + 4))

    def on_line(self, points: np.ndarray, text: str, colour: str, gid: str) -> bool:
        """Write on a line, as near to its middle as there is room; ``points`` are data coordinates, shape (n, 2)."""
        pixels = self._ax.transData.transform(points)
        inside = self._inside(pixels)
        if not inside.any():
            return False
        pixels = pixels[inside]
        order = np.argsort(np.abs(np.arange(len(pixels)) - len(pixels) // 2), kind="stable")
        every = max(1, len(order) // _PLACES)
        return self._write([tuple(pixels[index]) for index in order[::every]], text, colour, gid)

    def beside(self, x: float, y: float, texts: Sequence[str], colour: str, gid: str) -> bool:
        """Write the first of some texts that has room beside a point, which itself stays free."""
        from matplotlib.transforms import Bbox

        at = self._ax.transData.transform((x, y))
        self._taken.append(Bbox.from_extents(at[0] - 7, at[1] - 7, at[0] + 7, at[1] + 7))
        return any(self._around(at, text, colour, gid) for text in texts)

    def _around(self, at: np.ndarray, text: str, colour: str, gid: str) -> bool:
        width, height = self._size(text)
        places = [
            (at[0] + right * (width / 2 + far), at[1] + up * (height / 2 + far))
            for far in _DISTANCES_PX
            for right, up in _AROUND
        ]
        return self._write(places, text, colour, gid, self._lines, fontweight="bold")

    def _write(
        self,
        places: list[tuple[float, float]],
        text: str,
        colour: str,
        gid: str,
        lines: Sequence[Bbox] = (),
        **look: Any,
    ) -> bool:
        """Write at the first place that is free; of lines and what is avoided, if there is one."""
        from matplotlib.transforms import Bbox

        width, height = self._size(text)
        half = width / 2 + _MARGIN_PX, height / 2 + _MARGIN_PX
        strict = self._taken + self._avoided
        for taken, (px, py) in product(([*strict, *lines], strict, self._taken), places):
            box = Bbox.from_extents(px - half[0], py - half[1], px + half[0], py + half[1])
            if self._fits(box) and not any(box.overlaps(other) for other in taken):
                x, y = self._ax.transData.inverted().transform((px, py))
                self._ax.text(
                    x, y, text, ha="center", va="center", fontsize=SMALL, color=colour, bbox=_BOX, zorder=6, gid=gid,
                    **look,
                )  # fmt: skip
                self._taken.append(box)
                return True
        return False

    def _inside(self, pixels: np.ndarray) -> np.ndarray:
        frame = self._frame
        return (
            (pixels[:, 0] >= frame.x0) & (pixels[:, 0] <= frame.x1)
            & (pixels[:, 1] >= frame.y0) & (pixels[:, 1] <= frame.y1)
        )  # fmt: skip

    def _fits(self, box: Bbox) -> bool:
        frame = self._frame
        return frame.x0 <= box.x0 and box.x1 <= frame.x1 and frame.y0 <= box.y0 and box.y1 <= frame.y1

    def _size(self, text: str) -> tuple[float, float]:
        probe = self._ax.text(0.5, 0.5, text, transform=self._ax.transAxes, fontsize=SMALL, fontweight="bold")
        extent = probe.get_window_extent()
        probe.remove()
        return extent.width, extent.height
