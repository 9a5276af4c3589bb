"""The directory a run writes to: new or empty, holding the scene it can be run from again."""

from __future__ import annotations

import hashlib
import time
from pathlib import Path

from haploop.launch.scene.toml_writer import to_toml
from haploop.protocol.scene.scene import Scene

SCENE, PLUGINS = "scene.toml", "plugins"


class OutputError(Exception):
    """The directory cannot be used; the message says why and what to do."""


def make_output(out: Path | None, scene_path: Path) -> Path:
    """Makes the run's directory: ``out``, or a new one below ``runs/`` named by scene and time.

    Raises:
        OutputError: ``out`` holds something already, or cannot be made.
    """
    if out is None:
        stem = f"{scene_path.stem}-{time.strftime('%Y%m%d-%H%M%S')}"
        candidates = (Path("runs") / (stem + suffix) for suffix in ("", *(f"-{n}" for n in range(2, 1000))))
        out = next(path for path in candidates if not path.exists())
    try:
        out.mkdir(parents=True, exist_ok=True)
        if any(out.iterdir()):
            raise OutputError(f"{out} must be new or empty, so that no earlier run is lost; name another with --out.")
    except OSError as error:
        raise OutputError(f"The run's directory {out} cannot be made: {error.strerror}.") from error
    return out


def write_scene(scene: Scene, out: Path) -> str:
    """Writes the resolved scene, which runs by itself; returns its text."""
    text = to_toml(scene.as_dict())
    try:
        (out / SCENE).write_text(text, encoding="utf-8")
    except OSError as error:
        raise OutputError(f"{out / SCENE} cannot be written: {error.strerror}.") from error
    return text


def kept_name(path: Path) -> str:
    """Returns the name under which a plugin file is kept: its own with its digest, unless that is its name already."""
    digest = hashlib.sha256(path.read_bytes()).hexdigest()[:12]
    return path.name if path.stem.endswith(f"-{digest}") else f"{path.stem}-{digest}.py"


def keep_plugin(path: Path, out: Path) -> Path:
    """Copies a plugin file into the run's directory under a name with its digest, so that a replay finds it.

    Raises:
        OutputError: the file cannot be read or copied.
    """
    try:
        name = kept_name(path)
        (out / PLUGINS).mkdir(exist_ok=True)
        (out / PLUGINS / name).write_bytes(path.read_bytes())
    except OSError as error:
        raise OutputError(f"The plugin {path} cannot be copied into {out / PLUGINS}: {error.strerror}.") from error
    return out / PLUGINS / name
