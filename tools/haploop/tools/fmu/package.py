"""The FMU of a scene's controller: model description, sources and the library compiled from them, in one archive."""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile
from importlib.resources import files
from io import BytesIO
from pathlib import Path

from haploop.protocol.scene.scene import Scene
from haploop.tools.fmu.description import BUILD, model_description
from haploop.tools.fmu.variables import controller_of, header, variables_of

SOURCES = ("fmi3.c", "controller.h")
# No multiply-add with a single rounding, which Python does not do either.
_FLAGS = ("-O2", "-std=c99", "-ffp-contract=off", "-fPIC", "-shared", "-fvisibility=hidden")
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib")}
_COMPILE_S = 120.0


class NotCompiled(Exception):
    """There is no C compiler, or it failed; the message says what to do."""


def make_fmu(scene: Scene, stem: str) -> bytes:
    """Makes the FMU of a resolved scene's controller; the same scene and its identifier's ``stem`` give the same bytes.

    Raises:
        NotExportable: no FMU can be made of this scene.
        NotCompiled: no library could be made.
    """
    params = controller_of(scene)
    variables = variables_of(scene, params)
    sources = {name: files("haploop.tools.fmu").joinpath(name).read_text(encoding="utf-8") for name in SOURCES}
    identifier = re.sub(r"\W|^(?=\d)", "_", stem, flags=re.ASCII)
    without_token = [header(scene, params, variables, ""), *sources.values()]
    digest = hashlib.sha256("\0".join([*without_token, model_description(scene, variables, identifier, "")]).encode())
    token = f"{{{digest.hexdigest()}}}"
    sources["scene.h"] = header(scene, params, variables, token)
    tuple_, suffix = host_platform()
    library = _library(sources, suffix)
    contents = {
        "modelDescription.xml": model_description(scene, variables, identifier, token).encode(),
        f"binaries/{tuple_}/{identifier}{suffix}": library,
        "sources/buildDescription.xml": BUILD.format(identifier=identifier).encode(),
        **{f"sources/{name}": text.encode() for name, text in sources.items()},
    }
    made = BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name)  # dated 1980, whenever it is made
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return made.getvalue()


def host_platform() -> tuple[str, str]:
    """Returns this machine's platform tuple, as FMI 3.0 names it, and the suffix of its libraries."""
    machine, system = _MACHINES.get(platform.machine().lower()), _SYSTEMS.get(sys.platform)
    if machine is None or system is None:
        here = f"{platform.machine()} with {sys.platform}"
        raise NotCompiled(
            f"Libraries can be built on x86_64 or aarch64 with Linux or macOS, but this machine is {here}."
        )
    return f"{machine}-{system[0]}", system[1]


def _library(sources: dict[str, str], suffix: str) -> bytes:
    """Returns the shared library of these sources."""
    try:
        compiler = shlex.split(os.environ.get("CC", "")) or [next(filter(shutil.which, ("cc", "gcc", "clang")), "cc")]
    except ValueError as error:
        raise NotCompiled(f"CC must be a command, but {os.environ['CC']} was given: {error}.") from error
    with tempfile.TemporaryDirectory() as folder:
        for name, text in sources.items():
            Path(folder, name).write_text(text, encoding="utf-8")
        library = Path(folder, f"fmu{suffix}")
        command = [*compiler, *_FLAGS, "-o", library.name, "fmi3.c", "-lm"]
        try:
            done = subprocess.run(command, cwd=folder, capture_output=True, timeout=_COMPILE_S)
        except OSError as error:
            raise NotCompiled(
                f"A C compiler was expected, but {compiler[0]} cannot be started ({error.strerror}). Install one "
                "(Debian, Ubuntu: apt install gcc; Fedora: dnf install gcc; macOS: xcode-select --install), or name "
                "an installed one: CC=/path/to/compiler haploop export-fmu ..."
            ) from error
        except subprocess.TimeoutExpired as error:
            raise NotCompiled(f"The C compiler {compiler[0]} did not finish within {_COMPILE_S:g} s.") from error
        if done.returncode or not library.exists():
            told = (done.stderr or done.stdout).decode(errors="replace").strip()
            said = "\n".join(told.splitlines()[:8]) or "it printed nothing"
            raise NotCompiled(
                f"The C compiler produced no library (exit status {done.returncode}): {shlex.join(command)}\n{said}\n"
                "Name another compiler: CC=gcc haploop export-fmu ..."
            )
        return library.read_bytes()
