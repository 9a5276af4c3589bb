"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Scene = Annotated[Path, typer.Argument(help="scene file (TOML)", show_default=False)]
Directory = Annotated[Path, typer.Argument(help="directory of a run", show_default=False)]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="change a key of the scene")]
Plugin = Annotated[list[Path] | None, typer.Option("--plugin", metavar="FILE", help="Python file with elements")]
Run = Annotated[str | None, typer.Option("--run", metavar="ID", help="which run, when several are live")]
Json = Annotated[bool, typer.Option("--json", help="one JSON object on stdout")]
At = Annotated[str | None, typer.Option("--at", metavar="TIME", help='simulated time, s or "1500 ms"; at once without')]
