"""The single description of a run, and the directory it writes to: new or empty, with the run's scene."""

from __future__ import annotations

import contextlib
import hashlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

from haploop.launch.foreign import WAIT_S, Program
from haploop.launch.scene.toml_writer import to_toml
from haploop.launch.shown_prints import PRINTS
from haploop.protocol.scene.scene import Scene
from haploop.protocol.transport.sockets import Transport
from haploop.protocol.transport.wire import Message

if TYPE_CHECKING:
    from haploop.controller.dissipation import Element


SCENE, PLUGINS, PROGRAMS = "scene.toml", "plugins", "programs.json"


class OutputError(Exception):
    """The directory cannot be used; the message says why and what to do."""


class NeverBegan(Exception):
    """A run for which no program came to take part; the message says for whom it waited."""


class RunFailed(Exception):
    """A run that could not go on; the message names the node and the last common tick."""


@dataclass(frozen=True)
class RunSpec:
    """A scene ready to run: checked, with its directory made; ``dataclasses.replace`` gives one with other options.

    Attributes:
        kinds: element kinds by name; a plugin reloaded during the run adds its kinds.
        out: the run's directory, already made; ``is_new``: whether it was not there before.
        attachments: text files for the log, by name.
        plugins: plugin files within ``out`` that the controller loads.
        plugin_sources: kind -> the user's file it came from, for reloading.
        plugin_files: kind -> the file within ``out`` that its code at work is from; a reload changes it.
        pace: simulated seconds per wall second; infinite for as fast as possible. For processes only.
        clock: who owns the time: ``run``, or ``plant`` where a program in the plant's place keeps it as a device does.
        transport: addresses and keys of the sockets. For processes only.
        programs: foreign programs that take the place of plant or controller, by role; no scene names them. For
            processes only.
        wait_s: how long an external program is awaited, s.
        on_progress: called now and then with the logger's status.
        on_started: called once with the run's id, and with the clock's address if that is a TCP address. For
            processes only.
        on_judging: called when the run is over and is gone through again to be judged. For processes only.
        start_gate: given the pids of all nodes that are ready, returns whether the first tick may be worked on. It is
            asked again until it returns true; for a process that must be there from the start. For processes only.
    """

    scene: Scene
    kinds: dict[str, type[Element]]
    out: Path
    attachments: dict[str, str] = field(default_factory=dict)
    plugins: list[Path] = field(default_factory=list)
    plugin_sources: dict[str, Path] = field(default_factory=dict)
    plugin_files: dict[str, Path] = field(default_factory=dict)
    pace: float = math.inf
    clock: str = "run"
    transport: Transport = field(default_factory=Transport)
    programs: Mapping[str, Program] = field(default_factory=dict[str, Program])
    wait_s: float = WAIT_S
    on_progress: Callable[[Message], None] = lambda status: None
    on_started: Callable[[str], None] = lambda run_id: None
    on_judging: Callable[[], None] = lambda: None
    start_gate: Callable[[set[int]], bool] = lambda ready: True
    is_new: bool = False


def make_output(out: Path | None, scene_path: Path, first: str = SCENE, parent: Path = Path("runs")) -> Path:
    """Makes the run's directory: ``out``, or a new one below ``parent`` named by scene and time.

    The directory is claimed by making the file ``first``, empty, which its owner then writes: of many processes that
    start at the same instant only one can do so.

    Raises OutputError where ``out`` holds something already, or cannot be made.
    """
    try:
        if out is None:
            stem = f"{scene_path.stem}-{time.strftime('%Y%m%d-%H%M%S')}"
            names = (stem + suffix for suffix in chain([""], map("-{}".format, count(2))))
            return next(path for name in names if _claimed(path := parent / name, first))
        if not _claimed(out, first):
            raise OutputError(f"{out} must be new or empty, so that no earlier run is lost; name another with --out.")
    except OSError as error:
        place = parent if out is None else out
        why = f"{error.strerror}. Name another with --out."
        raise OutputError(f"The directory {place} cannot be made: {why}") from error
    return out


def _claimed(out: Path, first: str) -> bool:
    is_new = not out.exists()
    out.mkdir(parents=True, exist_ok=True)
    try:
        if any(out.iterdir()):
            return False
        (out / first).touch(exist_ok=False)
    except FileExistsError:
        return False
    except OSError:
        if is_new:
            out.rmdir()
        raise
    return True


def discard(out: Path, is_new: bool) -> None:
    """Removes what a run that never began has put into its directory, and the directory if it was made for that run.

    A directory that holds anything else stays as it is.
    """
    with contextlib.suppress(OSError):
        if (prints := out / PRINTS).is_file() and not prints.stat().st_size:
            prints.unlink()
        kept = list((out / PLUGINS).glob("*-????????????.py"))
        if {path.name for path in out.iterdir()} <= {SCENE, PLUGINS}:
            for path in (out / SCENE, *kept):
                path.unlink(missing_ok=True)
            if (out / PLUGINS).is_dir():
                (out / PLUGINS).rmdir()
            if is_new:
                out.rmdir()


def write_scene(scene: Scene, out: Path) -> str:
    """Writes the resolved scene, which can be run on its own; returns its text."""
    text = to_toml(scene.as_dict())
    try:
        (out / SCENE).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{out / SCENE} cannot be written: {error.strerror}.") from error
    return text


def kept_name(path: Path, data: bytes | None = None) -> str:
    """Returns the name under which a plugin file is kept: its own with its digest, unless it has the digest already."""
    digest = hashlib.sha256(path.read_bytes() if data is None else data).hexdigest()[:12]
    return path.name if path.stem.endswith(f"-{digest}") else f"{path.stem}-{digest}.py"


def keep_plugin(path: Path, out: Path, data: bytes | None = None) -> Path:
    """Copies a plugin file into the run's directory under a name with its digest, so that a replay finds it.

    Args:
        data: its content if it was read already; None to read it here.

    Raises OutputError where it cannot be read or copied.
    """
    try:
        data = path.read_bytes() if data is None else data
        kept = out / PLUGINS / kept_name(path, data)
        kept.parent.mkdir(exist_ok=True)
        kept.write_bytes(data)
    except OSError as error:
        raise OutputError(f"The plugin {path} cannot be copied into {out / PLUGINS}: {error.strerror}.") from error
    return kept
