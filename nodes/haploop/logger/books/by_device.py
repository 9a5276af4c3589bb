"""The books of a batch with friction whose members have several devices: one set of books for each device."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from haploop.logger.books.chain import ChainBooks
from haploop.logger.books.segments import BatchColumns
from haploop.logger.books.work import Displacement
from haploop.plant.chain.chain import Chain
from haploop.plant.chain.transition import devices_of
from haploop.protocol.scene.scene import Scene
from haploop.protocol.ticks import Timebase
from haploop.protocol.trees import tree_map, tree_take

# (members that have pieces, how many each has, columns of all pieces); see ``BatchFrictionMotion.take_record``.
Pieces = tuple[np.ndarray, np.ndarray, dict[str, np.ndarray]]


def books_of_batch(scene: Scene, time: Timebase, members: int) -> ChainBooks | BooksByDevice:
    """Returns the books of a batch with friction, from its stacked scene."""
    devices, _ = devices_of(Chain.from_scene(scene), members)
    return ChainBooks(scene, time, members) if len(devices) == 1 else BooksByDevice(scene, time, members)


class BooksByDevice:
    """``ChainBooks`` of the members of each device, with the results put back into the order of the members.

    Attributes:
        names: the books, in the order in which ``increments`` yields them.
    """

    def __init__(self, scene: Scene, time: Timebase, members: int) -> None:
        _, self._device = devices_of(Chain.from_scene(scene), members)
        self._books: dict[int, ChainBooks] = {}
        for device, places in self._places():
            of_device = tree_map(_shared_where_alike, tree_take(scene, places))
            self._books[device] = ChainBooks(of_device, time, len(places))
        self.names = self._books[0].names

    def _places(self) -> Iterator[tuple[int, np.ndarray]]:
        """Yields each device that occurs, and the places of its members."""
        for device in np.unique(self._device).tolist():
            yield device, np.flatnonzero(self._device == device)

    def increments(
        self, first_step: int, columns: BatchColumns, moved: Displacement, commanded: Iterable[np.ndarray]
    ) -> Iterator[np.ndarray]:
        """Yields the energy each interval adds to each book, J, shape (ticks, members); see ``ChainBooks``."""
        found, commanded = [np.empty_like(moved.by_tick) for _ in self.names], list(commanded)
        for device, places in self._places():
            of_device, moved_so, commanded_so = tree_take((_by_member(columns), moved, commanded), places)
            if "pieces" in columns:
                of_device["pieces"] = _pieces_of(columns["pieces"], places)
            books = self._books[device].increments(first_step, of_device, moved_so, commanded_so)
            for row, book in zip(found, books, strict=True):
                row[:, places] = book
        yield from found

    def stored_J(self, columns: BatchColumns) -> np.ndarray:
        """Returns kinetic and spring energy in the first state of some telemetry, J, shape (members,)."""
        stored_J = np.empty(len(self._device))
        for device, places in self._places():
            stored_J[places] = self._books[device].stored_J(tree_take(_by_member(columns), places))
        return stored_J

    def select(self, kept: np.ndarray) -> None:
        """Drops the members for which ``kept``, shape (members,), is false."""
        for device, places in self._places():
            if kept[places].any():
                self._books[device].select(kept[places])
        self._device = self._device[kept]


def _by_member(columns: BatchColumns) -> BatchColumns:
    """Returns the columns that have a number for every member."""
    return {name: of for name, of in columns.items() if getattr(of, "shape", ()) == columns["x"].shape}


def _shared_where_alike(leaf: Any) -> Any:
    """Returns a single number in place of an array that has the same value for all members."""
    if not getattr(leaf, "shape", ()) or not (leaf == leaf[:1]).all():
        return leaf
    return leaf[0].item()


def _pieces_of(pieces: Pieces, places: np.ndarray) -> Pieces:
    """Returns the pieces of the members at ``places``, which are numbered from 0 on."""
    members, counts, columns = pieces
    there = np.isin(members, places)
    rows = np.repeat(there, counts)
    own = {name: np.ascontiguousarray(column[rows]) for name, column in columns.items()}
    return np.searchsorted(places, members[there]), counts[there], own
