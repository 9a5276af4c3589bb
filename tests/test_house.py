"""The house: one import name from four folders, arrows that only go down, and pinned dependencies."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from graphlib import CycleError, TopologicalSorter
from importlib.metadata import entry_points
from pathlib import Path

import grimp
import pytest

HOUSE = Path(__file__).parents[1]
SOURCE_ROOTS = ("protocol", "nodes", "launch", "tools")
PROJECT = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))
LOCK = (HOUSE / "requirements.lock").read_text(encoding="utf-8")


def lint_imports(house: Path) -> subprocess.CompletedProcess[str]:
    """Check the arrows of the sources under `house`, which go before the installed ones."""
    roots = os.pathsep.join(str(house / root) for root in SOURCE_ROOTS)
    return subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache", "--config", HOUSE / "pyproject.toml"],
        cwd=house,
        env={**os.environ, "PYTHONPATH": roots},
        capture_output=True,
        text=True,
        check=False,
    )


def test_no_source_root_claims_the_import_name_for_itself() -> None:
    claimed = [root for root in SOURCE_ROOTS if (HOUSE / root / "haploop" / "__init__.py").exists()]
    assert claimed == []


def test_every_package_has_its_place_in_the_layers() -> None:
    packages = {f"haploop.{init.parent.name}" for init in HOUSE.glob("*/haploop/*/__init__.py")}
    linter = PROJECT["tool"]["importlinter"]
    layered = re.findall(r"[\w.]+", " ".join(linter["contracts"][0]["layers"]))
    assert packages == set(linter["root_packages"]) == set(layered)


def test_the_arrows_between_the_packages_only_go_down() -> None:
    report = lint_imports(HOUSE)
    assert report.returncode == 0, report.stdout + report.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("importer", "imported"),
    [
        ("nodes/haploop/plant", "haploop.controller"),
        ("nodes/haploop/controller", "haploop.plant"),
        ("protocol/haploop/protocol", "haploop.logger"),
        ("launch/haploop/launch", "haploop.tools"),
    ],
)
def test_an_arrow_that_goes_up_or_sideways_is_caught(importer: str, imported: str, tmp_path: Path) -> None:
    for root in SOURCE_ROOTS:
        shutil.copytree(HOUSE / root / "haploop", tmp_path / root / "haploop")
    (tmp_path / importer / "offender.py").write_text(f"import {imported}\n", encoding="utf-8")
    report = lint_imports(tmp_path)
    assert report.returncode == 1, report.stdout + report.stderr
    assert f"{importer.split('/', 1)[1].replace('/', '.')}.offender -> {imported}" in report.stdout


def imports_within(packages: list[str]) -> dict[str, set[str]]:
    """Module -> the modules of the same package that it imports, within functions and for types included."""
    graph = grimp.build_graph(*packages, cache_dir=None)
    return {
        module: {
            imported
            for imported in graph.find_modules_directly_imported_by(module)
            if imported.startswith(f"{package}.")
        }
        for package in packages
        for module in graph.modules
        if module.startswith(f"{package}.")
    }


def circle(imports: dict[str, set[str]]) -> list[str]:
    """The modules of one circle, in order; empty where there is none."""
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_modules_of_a_package_import_each_other_in_a_circle() -> None:
    assert circle(imports_within(PROJECT["tool"]["importlinter"]["root_packages"])) == []


@pytest.mark.parametrize(
    "source",
    [
        "import circled.second",
        "def f():\n    from circled.second import X",
        "if TYPE_CHECKING:\n    from . import second",
    ],
)
def test_a_circle_is_found_however_it_is_imported(source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "circled").mkdir()
    (tmp_path / "circled/__init__.py").touch()
    (tmp_path / "circled/first.py").write_text(f"from typing import TYPE_CHECKING\n{source}\n", encoding="utf-8")
    (tmp_path / "circled/second.py").write_text("import circled.first\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    assert set(circle(imports_within(["circled"]))) == {"circled.first", "circled.second"}


def foreign_private_names(source: str) -> set[str]:
    """Private attributes that a module reads without defining them itself; those of a NamedTuple are public."""
    nodes, public = [*ast.walk(ast.parse(source))], {"_replace", "_asdict", "_fields", "_make", "_exit"}
    defined = {node.name for node in nodes if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)}
    private = [node for node in nodes if isinstance(node, ast.Attribute) and re.match("_(?!_)", node.attr)]
    own = {node.attr for node in private if ast.unparse(node.value) in ("self", "cls", "super()")}
    return {node.attr for node in private} - defined - own - public


def test_no_module_reads_the_private_names_of_another() -> None:
    files = [file for root in SOURCE_ROOTS for file in HOUSE.glob(f"{root}/haploop/**/*.py")]
    found = {str(file): foreign_private_names(file.read_text(encoding="utf-8")) for file in files}
    assert {name: names for name, names in found.items() if names} == {}


def test_a_private_name_of_another_module_is_found_and_one_of_its_own_is_not() -> None:
    own = "class A:\n    def f(self, other):\n        self._x = other._x"
    assert foreign_private_names(own) == set()
    assert foreign_private_names("def f(a):\n    return a.b._y + a._replace(c=1)") == {"_y"}


def test_a_wheel_holds_every_module_scene_sweep_device_hand_reference_and_the_live_page(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", str(tmp_path)]
    subprocess.run(build, cwd=HOUSE, check=True, capture_output=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        held = {name for name in archive.namelist() if ".dist-info/" not in name}
    modules = {
        file.relative_to(HOUSE / root) for root in SOURCE_ROOTS for file in HOUSE.glob(f"{root}/haploop/**/*.py")
    }
    toml = {
        "haploop" / file.relative_to(HOUSE)
        for kind in ("scenes", "sweeps", "devices", "hands")
        for file in HOUSE.glob(f"launch/{kind}/**/*.toml")
    }
    references = {file.relative_to(HOUSE / "tools") for file in HOUSE.glob("tools/haploop/**/references/*.json")}
    assert toml
    assert references
    page = {file.relative_to(HOUSE / "nodes") for file in HOUSE.glob("nodes/haploop/view/serve/static/**/*.*")}
    assert page
    assert held >= {path.as_posix() for path in modules | toml | references | page}
    assert {name.split("/")[0] for name in held} == {"haploop"}


def test_the_lock_records_no_address() -> None:
    assert "://" not in LOCK
    assert not re.search(r"^\s*(-i|-f|--index-url|--extra-index-url|--find-links)\b", LOCK, re.MULTILINE)
    assert " @ " not in LOCK


def test_every_locked_requirement_has_a_version_and_a_hash() -> None:
    requirements = LOCK.replace("\\\n", " ").splitlines()
    pinned = re.compile(r"[\w.-]+==\S+( ; [^#]+?)?(\s+--hash=sha256:[0-9a-f]{64})+")
    assert requirements
    assert [line for line in requirements if not pinned.fullmatch(line.strip())] == []


def test_the_lock_holds_every_declared_dependency() -> None:
    extras = PROJECT["project"]["optional-dependencies"]
    declared = [*PROJECT["project"]["dependencies"], *(name for extra in extras.values() for name in extra)]
    declared += PROJECT["build-system"]["requires"]
    names = {re.split(r"[\[><=~ ;]", requirement)[0] for requirement in declared}
    assert names <= set(re.findall(r"^([\w.-]+)==", LOCK, re.MULTILINE))


def test_every_dissipation_element_of_the_house_is_found_by_its_entry_point() -> None:
    found = {entry.name: entry.load().__name__ for entry in entry_points(group="haploop.dissipation")}
    ours = PROJECT["project"]["entry-points"]["haploop.dissipation"]
    assert {name: found.get(name) for name in ours} == {name: path.split(":")[1] for name, path in ours.items()}
