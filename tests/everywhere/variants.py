"""Variants of a machine and of an installation, in which every bit of a trajectory must be the same."""

from __future__ import annotations

import itertools
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
# Kernels of OpenBLAS: the oldest of 64 bits, and those of three families of processors.
KERNELS = ("Prescott", "Haswell", "Zen", "SkylakeX")
# What NumPy calls the vector units that a kernel needs; a processor without them ends the program.
_NEEDS = {"Haswell": "AVX2", "Zen": "AVX2", "SkylakeX": "AVX512_SKX"}
# What a variant chooses, and no environment of its own accord.
CHOSEN = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES")
EVERY_TEST = ("tests",)
# Those that calculate, in one process: what starts processes, serves pages or reads files does nothing that the kernels
# of a processor could round otherwise.
CALCULATING = tuple(
    f"tests/{folder}"
    for folder in (
        *("advise", "arrays", "compare", "cost", "dissipate", "estimators", "linear", "paper", "physics", "search"),
        "stability",
    )
)
_NEED = re.compile(r"([\w-]+)(?:\[[\w,-]+\])?>=([\d.]+)")


@dataclass(frozen=True)
class Variant:
    """A way to run the tests.

    Attributes:
        environment: variables that are set for it.
        python: version of CPython, such as "3.12"; "" for the present one.
        resolution: "locked", or versions that the resolver chooses: "lowest-direct", "highest".
        tests: folders of those that may come to something else in it.
        lacks: what this processor lacks for it; "" for nothing.
    """

    name: str
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    python: str = ""
    resolution: str = "locked"
    tests: tuple[str, ...] = EVERY_TEST
    lacks: str = ""


def of_the_machine() -> list[Variant]:
    """Returns what can be tried with the present installation: kernels, vector units, threads, the C library."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__  # pyright: ignore

    present = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    off = "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F,-ERMS"
    chosen = {
        **{f"OpenBLAS {name}": {"OPENBLAS_CORETYPE": name} for name in KERNELS},
        **({"NumPy without vector units": {"NPY_DISABLE_CPU_FEATURES": " ".join(present)}} if present else {}),
        **{f"{count} threads of BLAS": {"OPENBLAS_NUM_THREADS": str(count)} for count in (1, 8)},
        **({"C library without FMA": {"GLIBC_TUNABLES": off}} if sys.platform == "linux" else {}),
    }
    lacks = {f"OpenBLAS {name}": unit for name, unit in _NEEDS.items() if not __cpu_features__.get(unit)}
    others = (Variant(name, of, tests=CALCULATING, lacks=lacks.get(name, "")) for name, of in chosen.items())
    return [Variant("default"), *others]


def of_installations() -> list[Variant]:
    """Returns installations of their own: other versions of CPython, the lowest and newest of every dependency."""
    own = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = [name for name in ("3.11", "3.12", "3.13", "3.14") if name != own]
    found = [Variant(f"CPython {name}", python=name) for name in others]
    return [*found, *(Variant(f"{of} dependencies", resolution=of) for of in ("lowest-direct", "highest"))]


def python_of(variant: Variant, folder: Path) -> Path | str:
    """Returns the interpreter of a variant, installed into a folder where it is another; or why there is none.

    Installs by the pip of the interpreter that this one's virtual environment was made of, as the Makefile does;
    RuntimeError with the last words of what did not work.
    """
    if variant.lacks:
        return f"this processor has no {variant.lacks}"
    if not variant.python and variant.resolution == "locked":
        return Path(sys.executable)
    base = shutil.which(f"python{variant.python}") if variant.python else _base()
    if base is None or subprocess.run([base, "-V"], capture_output=True, check=False).returncode:
        return f"there is no python{variant.python}"
    venv = folder / variant.name.replace(" ", "-")
    python = venv / "bin" / "python"
    lowest = folder / "lowest.txt"
    lowest.write_text("".join(f"{pin}\n" for pin in lowest_direct()), encoding="utf-8")
    install = [_base(), "-m", "pip", "--python", str(python), "-q", "--disable-pip-version-check", "install"]
    own = ["-e", f".[{','.join(_project()['optional-dependencies'])}]"]
    commands = {
        "locked": [["--require-hashes", "-r", "requirements.lock"], ["--no-deps", "--no-build-isolation", "-e", "."]],
        "lowest-direct": [["-c", str(lowest), *own]],
        "highest": [["--upgrade", "--upgrade-strategy", "eager", *own]],
    }
    made = [base, "-m", "venv", "--clear", "--without-pip", str(venv)]
    for command in (made, *([*install, *arguments] for arguments in commands[variant.resolution])):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"it cannot be installed: {(done.stderr.strip().splitlines() or ['?'])[-1]}")
    return python


def _base() -> str:
    return str(Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}")


@cache
def _project() -> dict[str, Any]:
    return tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def lowest_direct() -> list[str]:
    """Returns the lowest version that is allowed of every direct dependency, those of extras among them, as pins."""
    pins: list[str] = []
    for need in (*_project()["dependencies"], *itertools.chain(*_project()["optional-dependencies"].values())):
        bound = _NEED.match(need)
        assert bound, f"{need} has no lower bound"
        pins.append(f"{bound[1]}=={bound[2]}")
    return pins
