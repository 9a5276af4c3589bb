"""A plugin that is reloaded while a run goes on, sound or broken in any way; of its trial the outcome is simulated.

The trial itself, a process that is killed or hangs, is tried with real ones (tests/faults).
"""

from __future__ import annotations

from collections.abc import Generator, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from haploop.controller.active_elements import make_element
from haploop.controller.dissipation import Element, PluginError
from haploop.controller.dissipation.registry import load_source
from haploop.launch.processes.run_directory import CommandRefused, RunNotFound, ask
from haploop.launch.spec import PLUGINS, RunSpec, keep_plugin
from haploop.protocol.scene.scene import ElementTable
from simulation.computer.world import Process
from simulation.visitors import Live, Visit

if TYPE_CHECKING:
    from simulation.sim import Sim

KIND = "brake"
_FILE = """
from typing import Annotated
from haploop.controller.dissipation import Element, Quantity

class Brake(Element):
    kind = "brake"
    damping: Annotated[float, Quantity("N s/m", at_least=0)] = {default}

    def force(self, motion):
        return {factor} * self.damping * motion.v
"""
HANGS, _DIES = "# hangs", "# dies"
SOUND = tuple(_FILE.format(default=0.1, factor=factor) for factor in (-1.0, -0.5))
BROKEN = (
    *("def", "1 / 0", "raise SystemExit(3)", HANGS, _DIES, SOUND[0].replace("brake", "drag")),
    _FILE.format(default="float('nan')", factor=-1.0),
    SOUND[1] + SOUND[0].replace("brake", "damping").replace("Brake", "Damping"),
)


def with_plugin(spec: RunSpec) -> RunSpec:
    """Puts the sound file into the directory of a run that has claimed it, and its kind at hand."""
    source = spec.out.with_name("brake.py")
    source.write_text(SOUND[0])
    kept = keep_plugin(source, spec.out)
    spec.kinds.update(load_source(SOUND[0], str(source)))
    spec.plugins.append(kept)
    spec.plugin_sources[KIND], spec.plugin_files[KIND] = source, kept
    return spec


def broken_kept(out: Path) -> str:
    """Returns a broken file that the run has taken up, "" for none."""
    kept = (
        [path for path in (out / PLUGINS).iterdir() if path.read_text() in BROKEN] if (out / PLUGINS).exists() else []
    )
    return f"a broken plugin was taken up: {kept[0].read_text()}" if kept else ""


class SimTrial:
    """``PluginTrial`` in virtual time: its answer takes a while to come."""

    def __init__(self, sim: Sim, source: str, origin: str) -> None:
        self._world, self._source, self._origin = sim.world, source, origin

    def _after(self, seconds: float) -> Generator[None, None, None]:
        due = self._world.now + seconds
        while self._world.now < due:
            yield

    def load(self) -> Generator[None, None, dict[str, type[Element]]]:
        yield from self._after(10.0 if self._source == HANGS else self._world.dice.expovariate(30.0))
        if self._source in (HANGS, _DIES):
            raise PluginError(f"The plugin {self._origin} was stopped, or ended the process it was tried in.")
        return load_source(self._source, self._origin)

    def make(self, elements: Iterable[ElementTable]) -> Generator[None, None, None]:
        yield from self._after(self._world.dice.expovariate(30.0))
        for element in elements:
            make_element(element, load_source(self._source, self._origin))

    def __enter__(self) -> SimTrial:
        return self

    def __exit__(self, *_: object) -> None:
        """There is no process."""


@dataclass(frozen=True)
class Reload(Visit):
    """Somebody who writes the plugin's file anew, time and again, and asks the run to take it up."""

    files: tuple[str, ...]

    @property
    def lasts_s(self) -> float:
        return 31.0 * len(self.files)

    def visit(self, sim: Sim, process: Process) -> None:
        live, source = Live(sim, process), sim.out.with_name("brake.py")
        for text in self.files:
            source.write_text(text)
            arguments: dict[str, Any] = {"swap": {"kind": KIND, "damping": 0.3}, "reload": True}
            try:
                sim.world.note(ask(live, "swap", **arguments)[0])
            except CommandRefused as error:
                sim.world.note(f"reload refused: {error}")
            except RunNotFound:
                if not sim.run.launcher.alive:
                    return
                if not sim.is_held_up("launcher"):
                    sim.watch.fail("a reload was not answered within 30 s")
