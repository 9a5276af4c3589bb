"""Makes the pictures of README's walk by its own commands: ``python docs/site/pictures.py docs/pictures``."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

# Pixels across, and colours of a palette: a picture then takes some 80 kB.
WIDTH, COLOURS = 1000, 128
NO_SWAP = ("--set", "event=[]")
# By picture: the commands, {} the directory; the last writes figure.png there, or names its figure last on stdout.
STEPS = {
    "demo": [("demo", "--out", "{}")],
    "buzz": [("run", "demo", *NO_SWAP, "--out", "{}/run"), ("plot", "{}/run")],
    "damping": [("sweep", "demo_damping", "--out", "{}/sweep"), ("plot", "{}/sweep")],
    "advice": [("advise", "demo", *NO_SWAP, "--out", "{}")],
}


def make(name: str, target: Path) -> None:
    """Runs the commands of a picture and writes it, smaller, into a folder."""
    with tempfile.TemporaryDirectory() as directory:
        said = ""
        for words in STEPS[name]:
            command = [sys.executable, "-m", "haploop.tools.cli", *(word.format(directory) for word in words)]
            said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
        figure = Path(directory, "figure.png")
        shrink(figure if figure.exists() else Path(said.split()[-1]), target / f"{name}.png")


def shrink(figure: Path, target: Path) -> None:
    """Writes a picture ``WIDTH`` pixels wide with a palette."""
    with Image.open(figure) as picture:
        size = WIDTH, round(picture.height * WIDTH / picture.width)
        small = picture.convert("RGB").resize(size, Image.Resampling.LANCZOS)
        small.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)


if __name__ == "__main__":
    for each in sys.argv[2:] or STEPS:
        make(each, Path(sys.argv[1]))
