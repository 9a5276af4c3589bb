"""Variants of a machine and of an installation, in which every bit of a trajectory must be the same."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
# Kernels of OpenBLAS: the oldest of 64 bits, and those of three families of processors.
KERNELS = ("Prescott", "Haswell", "Zen", "SkylakeX")

# What a variant chooses, and no environment of its own accord.
CHOSEN = ("OPENBLAS_CORETYPE", "OPENBLAS_NUM_THREADS", "NPY_DISABLE_CPU_FEATURES", "GLIBC_TUNABLES")
_EXTRAS = ("plot", "pandas", "parquet", "view", "dev")
_NEED = re.compile(r"([\w-]+)(?:\[[\w,-]+\])?>=([\d.]+)")


@dataclass(frozen=True)
class Variant:
    """A way to run the tests.

    Attributes:
        environment: variables that are set for it.
        python: version of CPython, such as "3.12"; "" for the present one.
        resolution: "locked", or versions that the resolver chooses: "lowest-direct", "highest".
    """

    name: str
    environment: Mapping[str, str] = field(default_factory=dict[str, str])
    python: str = ""
    resolution: str = "locked"


def of_the_machine() -> list[Variant]:
    """Returns what can be tried with the present installation: kernels, vector units, threads, the C library."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__  # pyright: ignore

    present = [name for name in __cpu_dispatch__ if __cpu_features__.get(name)]
    found = [Variant("default"), *(Variant(f"OpenBLAS {name}", {"OPENBLAS_CORETYPE": name}) for name in KERNELS)]
    if present:
        found.append(Variant("NumPy without vector units", {"NPY_DISABLE_CPU_FEATURES": " ".join(present)}))
    found += [Variant(f"{count} threads of BLAS", {"OPENBLAS_NUM_THREADS": str(count)}) for count in (1, 8)]
    if sys.platform == "linux":
        off = "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-AVX512F,-ERMS"
        found.append(Variant("C library without FMA", {"GLIBC_TUNABLES": off}))
    return found


def of_installations() -> list[Variant]:
    """Returns installations of their own: other versions of CPython, the lowest and newest of every dependency."""
    own = f"{sys.version_info.major}.{sys.version_info.minor}"
    others = [name for name in ("3.11", "3.12", "3.13", "3.14") if name != own]
    found = [Variant(f"CPython {name}", python=name) for name in others]
    return [*found, *(Variant(f"{of} dependencies", resolution=of) for of in ("lowest-direct", "highest"))]


def python_of(variant: Variant, folder: Path) -> Path | str:
    """Returns the interpreter of a variant, installed into a folder where it is another; or why there is none.

    Installs by the pip of the interpreter that this one's virtual environment was made of, as the Makefile does.
    """
    if not variant.python and variant.resolution == "locked":
        return Path(sys.executable)
    base = shutil.which(f"python{variant.python}") if variant.python else _base()
    if base is None:
        return f"python{variant.python} is not on the path"
    venv = folder / variant.name.replace(" ", "-")
    python = venv / "bin" / "python"
    lowest = folder / "lowest.txt"
    lowest.write_text("".join(f"{pin}\n" for pin in lowest_direct()), encoding="utf-8")
    install = [_base(), "-m", "pip", "--python", str(python), "-q", "--disable-pip-version-check", "install"]
    own = ["-e", f".[{','.join(_EXTRAS)}]"]
    commands = {
        "locked": [["--require-hashes", "-r", "requirements.lock"], ["--no-deps", "--no-build-isolation", "-e", "."]],
        "lowest-direct": [["-c", str(lowest), *own]],
        "highest": [["--upgrade", "--upgrade-strategy", "eager", *own]],
    }
    made = [base, "-m", "venv", "--clear", "--without-pip", str(venv)]
    for command in (made, *([*install, *arguments] for arguments in commands[variant.resolution])):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            return f"it cannot be installed: {(done.stderr.strip().splitlines() or ['?'])[-1]}"
    return python


def _base() -> str:
    return str(Path(sys.base_prefix) / "bin" / f"python{sys.version_info.major}.{sys.version_info.minor}")


def lowest_direct() -> list[str]:
    """Returns the lowest version that is allowed of every direct dependency, as pins."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = [need for extra in _EXTRAS for need in project["optional-dependencies"][extra]]
    found = [_NEED.match(need) for need in (*project["dependencies"], *extras)]
    return [f"{each[1]}=={each[2]}" for each in found if each]
