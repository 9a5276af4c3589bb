"""Tables of float64 as msgpack bytes, composed and taken apart by NumPy, a whole block of messages at once.

A message of a table is a msgpack map of float64 by column name, or an array of such maps (*samples*). With the names
fixed, every message of the table has the same bytes but for its numbers, each 0xcb and a big-endian float64: so one
message serves as the template, and the numbers are written into (and read from) a block of copies of it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, cast

import msgpack
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
# A message with more samples does not come from a run's log, whatever a schema says.
_MOST_SAMPLES = 1 << 20


def pack(value: Any) -> bytes:
    return cast(bytes, msgpack.packb(value))


class TableLayout:
    """Places of the numbers in a table's message.

    Attributes:
        columns: unit by column name, in the order of the map; "" for a pure number.
        samples: maps in a message's top-level array, 1 at least, or None when the message is one plain map.
        dtype: NumPy dtype of one message, as long as the msgpack message in bytes.
    """

    def __init__(self, columns: Mapping[str, str], samples: int | None = None) -> None:
        if samples is not None and samples < 1:
            raise ValueError(f"A message must hold at least one sample, but samples_per_message is {samples}.")
        self.columns = dict(columns)
        self.samples = samples
        one_map = dict.fromkeys(self.columns, 0.0)
        message = pack(one_map if samples is None else [one_map] * samples)
        map_bytes = len(pack(one_map))
        entry_bytes = [len(pack(name)) + 9 for name in self.columns]
        entry_ends = np.cumsum(entry_bytes, dtype=int) + map_bytes - sum(entry_bytes)
        of_map = np.dtype(
            {
                # Numbered, as NumPy would refuse some names that msgpack allows.
                "names": [str(number) for number in range(len(self.columns))],
                "formats": [">f8"] * len(self.columns),
                "offsets": [int(end) - 8 for end in entry_ends],
                "itemsize": map_bytes,
            }
        )
        maps = of_map if samples is None else (of_map, (samples,))
        head_bytes = len(message) - map_bytes * (samples or 1)
        self.dtype = np.dtype({"names": ["maps"], "formats": [maps], "offsets": [head_bytes], "itemsize": len(message)})
        self._template = np.frombuffer(message, self.dtype)

    def stamp(self, messages: NDArray[Any]) -> None:
        """Makes every message of an array of this dtype, of any strides, a copy of the template: all numbers 0."""
        as_bytes = np.dtype((np.void, self.dtype.itemsize))
        messages.view(as_bytes)[:] = self._template.view(as_bytes)

    def views(self, messages: NDArray[Any]) -> list[Floats]:
        """Returns the numbers inside an array of messages of this dtype, shape (messages,), in column order.

        They are writable views, big-endian float64, of shape (messages,) or, with samples, (messages, samples).
        """
        maps = messages["maps"]
        return [maps[str(number)] for number in range(len(self.columns))]

    def read(self, payload: bytes) -> list[Floats] | None:
        """Splits messages stored end to end into a native float64 array per column, flat over messages and samples.

        Returns None unless all of the bytes are of this layout. This is checked by putting the numbers back into the
        template: the bytes must be those that were read.
        """
        if len(payload) % self.dtype.itemsize:
            return None
        messages = np.frombuffer(payload, self.dtype)
        again = np.empty_like(messages)
        self.stamp(again)
        found = self.views(messages)
        for view, column in zip(self.views(again), found, strict=True):
            view[...] = column
        return [column.astype(np.float64).reshape(-1) for column in found] if again.tobytes() == payload else None

    def json_schema(self, title: str) -> bytes:
        """Returns the JSON Schema of a message: each column a number with its ``unit``, or any map without columns."""
        numbers = {name: {"type": "number", "unit": unit} for name, unit in self.columns.items()}
        one_map = {"type": "object", **({"properties": numbers, "required": list(numbers)} if numbers else {})}
        maps = {"type": "array", "items": one_map, "minItems": self.samples, "maxItems": self.samples}
        schema = {"title": title, **(one_map if self.samples is None else maps)}
        return json.dumps(schema, ensure_ascii=False).encode()

    @classmethod
    def from_json_schema(cls, schema: bytes) -> TableLayout:
        """Returns the layout that ``json_schema`` described; one without columns for any other schema."""
        try:
            found = json.loads(schema or b"{}")
            samples = found["minItems"] if found.get("type") == "array" else None
            if samples is not None and not 1 <= samples <= _MOST_SAMPLES:
                return cls({})
            numbers = (found if samples is None else found["items"])["properties"]
            return cls({name: str(kind.get("unit", "")) for name, kind in numbers.items()}, samples)
        except (ValueError, TypeError, AttributeError, KeyError):
            return cls({})
