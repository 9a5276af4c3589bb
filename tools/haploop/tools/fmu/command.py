"""``haploop export-fmu``: a scene's controller for Simulink, Modelica tools and other importers of FMUs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.options import FAILED, WRONG_USE, SceneFile, Set, leave, plain_errors


def export_fmu(
    scene: SceneFile,
    set: Set = None,
    out: Annotated[Path | None, typer.Option(metavar="FILE.fmu", help="file, or directory [SCENE.fmu here]")] = None,
    force: Annotated[bool, typer.Option("--force", help="overwrite an existing file")] = False,
) -> None:
    """Write the controller of a scene as an FMU, position to force. FMI 3.0, co-simulation, in C.

    Wall, elements, estimators and delay, without Python, with the same bits as a run. It needs a C compiler.
    """
    from haploop.launch.scene.file import load
    from haploop.protocol.ticks import Timebase
    from haploop.tools.export.command import ExportFailed, new_files
    from haploop.tools.fmu.package import NotCompiled, make_fmu
    from haploop.tools.fmu.variables import NotExportable, step_count

    target = Path(f"{scene.stem}.fmu") if out is None else out / f"{scene.stem}.fmu" if out.is_dir() else out
    if target.suffix != ".fmu":
        leave(f"The name of an FMU must end in .fmu, but {target.name} was given.", WRONG_USE)
    with plain_errors():
        resolved = load(scene, set or [])
        try:
            made = make_fmu(resolved, scene.stem)
            with new_files([target], force) as [file]:
                file.write(made)
        except NotExportable as error:
            leave(str(error), WRONG_USE)
        except (NotCompiled, ExportFailed) as error:
            leave(str(error), FAILED)
    time = Timebase.from_scene(resolved)
    longest, least = step_count(time) / time.plant_rate, 1.0 / time.plant_rate
    print(f"Communication step: {longest:g} s, or whole plant steps of {least:g} s up to a tick.", file=sys.stderr)
    print(target)
