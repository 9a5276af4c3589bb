"""The command ``haploop demo``; it imports what it works with when it is called."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from haploop.tools.command.interrupt import LeavingAtOnce
from haploop.tools.command.options import FAILED, leave, plain_errors, what_was_logged

SCENE, FIGURE = "demo", "figure.png"

_NEXT = (
    'A verdict holds for this scene alone. Next: haploop advise {scene} --set "event=[]" tries other holds, delays and '
    "devices (minutes); haploop new my.toml, haploop replay {directory}, haploop run {scene} --view."
)


def demo(
    out: Annotated[
        Path, typer.Option(help="directory in which a new one is created for the run and its figure")
    ] = Path("runs"),
) -> None:
    """Show in seconds how a wall buzzes, why, and what steadies it. The element is swapped in during contact.

    Plant, controller and logger run as three processes. The last line names the figure's file.
    """
    with LeavingAtOnce():
        from haploop.launch.runs.loaded_scene import load
        from haploop.launch.runs.start import lay_out
        from haploop.launch.scene.bundled import bundled
        from haploop.launch.spec import RunFailed, make_output
        from haploop.tools.demo.figure import draw
        from haploop.tools.demo.report import report
        from haploop.tools.demo.story import tell
        from haploop.tools.figure.data import FigureError
        from haploop.tools.render.terminal import console

    with plain_errors():
        scene = load(bundled("scenes")[SCENE])
        directory = make_output(None, Path(SCENE), parent=out)
        try:
            story = tell(lay_out(scene.scene, dict(scene.kinds), directory, is_new=True))
        except RunFailed as error:
            leave(f"{error}\n{what_was_logged(directory)}", FAILED)
        except KeyboardInterrupt:
            leave(f"Interrupted; what was logged is in {directory}.", FAILED)
        console().print(report(story))
        try:
            figure = draw(story, directory / FIGURE)
        except FigureError as error:
            leave(f"No figure: {error}\nThe run is in {directory}.", FAILED)
    print(_NEXT.format(scene=SCENE, directory=shlex.quote(str(directory))), file=sys.stderr)
    print(figure)
