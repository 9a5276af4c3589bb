"""Programs of examples/ as commands for ``--node``; a test is skipped where something they need is missing."""

from __future__ import annotations

import atexit
import os
import shlex
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[3] / "examples"


@cache
def _has_packages(node: str) -> bool:
    packages = 'require("zeromq"); require("@msgpack/msgpack")'
    return not subprocess.run([node, "-e", packages], cwd=EXAMPLES, capture_output=True).returncode


def in_node(name: str) -> list[str]:
    """The words that start a program in Node.js, with the packages of NODE_PATH or of examples/node_modules."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    if not _has_packages(node):
        pytest.skip(
            "zeromq and @msgpack/msgpack are not installed for node (npm ci --ignore-scripts --prefix examples)"
        )
    return [node, str(EXAMPLES / name)]


@cache
def compiled(name: str) -> list[str]:
    """The words that start a program in C, which is compiled once."""
    compiler = shutil.which(os.environ.get("CC", "cc"))
    if compiler is None or not shutil.which("pkg-config"):
        pytest.skip("a C compiler and pkg-config are not installed")
    for package in ("msgpack", "msgpack-c"):
        found = subprocess.run(["pkg-config", "--cflags", "--libs", "libzmq", package], capture_output=True, text=True)
        if not found.returncode:
            break
    else:
        pytest.skip("libzmq and msgpack-c are not installed with their headers")
    program = Path(tempfile.mkdtemp()) / Path(name).stem
    atexit.register(shutil.rmtree, program.parent)
    strict = ("-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function")
    command = [compiler, *strict, "-o", str(program), str(EXAMPLES / name), *shlex.split(found.stdout)]
    subprocess.run(command, check=True, timeout=120)
    return [str(program)]


def program(name: str) -> list[str]:
    return compiled(name) if name.endswith(".c") else in_node(name)


def seat(role: str, words: list[str]) -> tuple[str, str]:
    """The options of ``haploop run`` that give a program a role."""
    return "--node", f"{role}={shlex.join(words)}"
