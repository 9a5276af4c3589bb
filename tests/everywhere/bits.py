"""Digests of what every shipped scene comes to, on stdout as JSON: ``python -m everywhere.bits``."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable

from haploop.controller.dissipation import registry
from haploop.launch.runs.in_batch import run_batch
from haploop.launch.runs.in_process import run_in_process
from haploop.launch.scene.bundled import bundled
from haploop.launch.scene.file import load


def digests(names: Iterable[str] = ()) -> dict[str, str]:
    """Returns by name the digest of the trajectory of every shipped scene, or of some, alone and in a batch of two."""
    kinds, found = registry(), {}
    for name, path in bundled("scenes").items():
        if names and name not in names:
            continue
        scene = load(path, ["run.verdict=window"])
        found[name] = str(run_in_process(scene, kinds)["trajectory_sha256"])
        [result, _] = run_batch([scene, scene], kinds, energy=False, trajectories=True)
        found[f"{name} in a batch"] = str(result["trajectory_sha256"])
    return found


if __name__ == "__main__":
    print(json.dumps(digests(sys.argv[1:])))
