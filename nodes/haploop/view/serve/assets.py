"""The files of the page: its own, and those of uPlot as they lie in the installed package."""

from __future__ import annotations

import importlib.util
from pathlib import Path

_OWN = Path(__file__).with_name("static")
_OF_UPLOT = ("uPlot.iife.js", "uPlot.min.css")
TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".svg": "image/svg+xml"}


class MissingExtra(RuntimeError):
    """Raised where a package that the page needs is not installed; the message says how to get it."""


def check_installed() -> None:
    """Looks for the packages that the page needs, without importing them; raises MissingExtra if one is missing."""
    if importlib.util.find_spec("aiohttp") is None or _uplot() is None:
        raise MissingExtra(
            "haploop view needs aiohttp and uplot-python; install them with pip install 'haploop[view]'."
        )


def _uplot() -> Path | None:
    """Returns the folder of uPlot's files in the installed package; importing that would load far more."""
    spec = importlib.util.find_spec("uplot")
    places = spec.submodule_search_locations if spec else None
    folders = [Path(place, "static") for place in places or ()]
    return next((folder for folder in folders if all((folder / name).is_file() for name in _OF_UPLOT)), None)


def assets() -> dict[str, Path]:
    """Returns every file the page may ask for, by its place under /static; raises MissingExtra without uPlot."""
    check_installed()
    folder = _uplot()
    assert folder
    own = {path.relative_to(_OWN).as_posix(): path for path in _OWN.rglob("*") if path.suffix in TYPES}
    return own | {name: folder / name for name in _OF_UPLOT}
