"""Keys of a scene file that stand for others: the file of a recorded force, range and bits of an encoder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from pydantic_core import PydanticCustomError

from haploop.launch.scene.mistakes import COMMAND_LINE
from haploop.launch.scene.models import number_of
from haploop.launch.scene.reading.layers import Layers
from haploop.launch.scene.reading.lines import KeyPath
from haploop.protocol.quantity import si
from haploop.protocol.scene.table import Table

_FORCE: KeyPath = ("hand", "force")
_FILE, _COLUMNS = (*_FORCE, "file"), ("time_column", "force_column")


class CountedRange(Table):
    """The range of an encoder and its bits, in place of its resolution, which is range / 2^bits."""

    bits: Annotated[int, si("", "there are 2^bits counts over the range", whole=True, at_least=1, at_most=64)]
    range: Annotated[float, si("m", "distance that the counts cover", above=0)]


def put_in_full(layers: Layers) -> None:
    """Puts the keys that a resolved scene has in place of those that stand for them; mistakes go to ``layers``."""
    _read_recording(layers)
    _count_range(layers)


def _count_range(layers: Layers) -> None:
    encoder = layers.data.get("encoder")
    names = [field.name for field in CountedRange.fields()]
    if not isinstance(encoder, dict) or not encoder.keys() & set(names):
        return
    expected, read = "An encoder has its resolution, or both bits and range.", dict[str, Any]()
    for name in names:
        try:
            read[name] = number_of(CountedRange, name).read(encoder[name])
        except KeyError:
            [other] = {*names} - {name}
            layers.complain(("encoder", name), expected, "is missing", place=("encoder", other))
        except PydanticCustomError as error:
            layers.complain(("encoder", name), error.message() + _of_a_count(name, encoder[name]))
    if "resolution" in encoder:
        layers.complain(("encoder", "resolution"), expected, "is given as well as bits or range")
    count_m = read["range"] / 2 ** read["bits"] if len(read) == 2 else encoder.get("resolution", 1.0)
    given = next((name for name in names if name in encoder), "resolution")
    layers.lay({"resolution": count_m}, layers.origin(("encoder", given)), ("encoder",))


_IN_BITS, _IN_COUNTS = " {0} counts are {1} bits.", ' {0} counts over 0.2 m are resolution = "0.2 m / {0}".'


def _of_a_count(name: str, value: object) -> str:
    """Returns how to write a number of counts that was given as the number of bits; "" for any other value."""
    if name != "bits" or not isinstance(value, int) or value <= 64:
        return ""
    bits = value.bit_length() - 1
    return (_IN_BITS if value == 1 << bits else _IN_COUNTS).format(value, bits)


def told_of_recording(layers: Layers) -> str:
    """Returns a sentence on how the recorded hand force of valid layers is read; "" where there is none."""
    if (force := _recorded(layers)) is None:
        return ""
    from haploop.launch.scene.reading.trace import told

    return told(*_file_and_columns(layers, force))


def _recorded(layers: Layers) -> dict[str, Any] | None:
    hand = layers.data.get("hand")
    force = hand.get("force") if isinstance(hand, dict) else None
    return force if isinstance(force, dict) and force.get("kind") == "trace" and "file" in force else None


def _file_and_columns(layers: Layers, force: dict[str, Any]) -> tuple[Path, str | None, str | None]:
    """Returns the file of a recorded force, and the columns of times and forces where they are named."""
    origin = layers.origin(_FILE)
    time, newton = (str(force[name]) if name in force else None for name in _COLUMNS)
    return (Path() if origin == COMMAND_LINE else Path(origin).parent) / force["file"], time, newton


def _read_recording(layers: Layers) -> None:
    """Puts the samples of a recorded hand force in place of its file, so that the scene can be run on its own."""
    if (force := _recorded(layers)) is None:
        return
    from haploop.launch.scene.reading.trace import RecordingError, read_trace  # numpy, only where a file is read

    times, forces = [0.0], [0.0]
    given = [name for name in _COLUMNS if name in force]
    if "time" in force or "force" in force:
        layers.complain(_FILE, "A trace has either a file or the lists time and force.")
    elif not isinstance(force["file"], str):
        layers.complain(_FILE, "It must be the path of a text file of time and force, such as a CSV.")
    elif wrong := [name for name in given if type(force[name]) not in (str, int)]:
        layers.complain((*_FORCE, wrong[0]), "It must be the name of a column, or its number from 1.")
    else:
        try:
            times, forces = read_trace(*_file_and_columns(layers, force))
        except RecordingError as error:
            layers.complain(_FILE, str(error))
    for name in ("file", *given):
        del force[name]
    force |= {"time": times, "force": forces}
