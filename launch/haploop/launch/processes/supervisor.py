"""A run as processes: start them, lead them by the clock, watch them, end them, leave nothing behind."""

from __future__ import annotations

import gc
import math
import secrets
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import zmq

from haploop.controller.dissipation.registry import installed
from haploop.launch.clock.clock import Clock
from haploop.launch.clock.commands import Commands
from haploop.launch.clock.device_time import PLANT, lateness_told
from haploop.launch.clock.server import ClockServer
from haploop.launch.foreign import Program
from haploop.launch.processes import open_files, private_directory, run_directory
from haploop.launch.processes.awaited import Awaited
from haploop.launch.processes.children import Child, interrupts, start_children
from haploop.launch.processes.deadlines import LAST_WORDS_S, Deadlines
from haploop.launch.shown_prints import PRINTS, ShownPrints
from haploop.launch.spec import OutputError, RunFailed, RunSpec
from haploop.protocol.brought import names_of_files
from haploop.protocol.changes import Event
from haploop.protocol.scene.scene import Run
from haploop.protocol.ticks import Timebase
from haploop.protocol.transport.machine import Machine, machine_of
from haploop.protocol.transport.sockets import SecureContext, Transport, with_host_of
from haploop.protocol.transport.wire import Message

if TYPE_CHECKING:
    from haploop.logger.summary import Summary

# Starts the nodes, given the directory of sockets, what the node of a role is told at its start, whether cores are
# pinned, the number of the run, and the foreign programs that take the place of its own.
Start = Callable[[Path, Callable[[str], Message], bool, int, Mapping[str, Program]], dict[str, Child]]

# After a node has failed, in s: nodes heard from within the first time have the second to hand over their last blocks;
# then the logger has the third to save its files. A run.deadline longer than the default makes them longer, too: it is
# given where a machine is busy.
_SILENT_S, _HANDING_S, _SAVING_S = 0.5, 1.0, 2.0
# Time between looks at silent nodes; commands, reports and deaths are noticed at once.
_LOOK_MS = 100


def run_processes(
    spec: RunSpec,
    make_context: Callable[[Transport], SecureContext] = SecureContext.from_transport,
    start_nodes: Start = start_children,
    interrupts: Callable[..., AbstractContextManager[list[int]]] = interrupts,
) -> tuple[Summary, list[tuple[int, Event]]]:
    """Carries out a run to its end; returns the summary, and every event with its tick.

    The first SIGINT or SIGTERM ends the run in order, with a summary of what ran; the second at once.

    Raises:
        NeverBegan: a program that somebody else was to start did not join.
        RunFailed: a process was killed, hung or could not go on; nothing of the run is left but its files.
        OutputError: sockets or processes cannot be made, or too few files can be opened.
        KeyboardInterrupt: the second signal came.
    """
    open_files.allow_many()
    with interrupts(usual_from=3) as received, private_directory.made() as sockets:
        context = make_context(replace(spec.transport, patience_s=spec.scene.run.deadline))
        try:
            supervisor = Supervisor(spec, sockets, received, context, start_nodes)
        except BaseException as error:
            context.destroy(linger=0)
            if not isinstance(error, OSError | zmq.ZMQError):
                raise
            reason = error.strerror or str(error)
            raise OutputError(f"Sockets and processes of the run cannot be made: {reason}.") from error
        return supervisor.run(), supervisor.events


def _with_lateness(summary: Summary, lateness: Message, out: Path, machine: Machine) -> Summary:
    """Adds to a run's summary, also on disk, how late its ticks were; that of a run in no real time stays as it is."""
    if lateness:
        from haploop.logger.session import write_summary

        summary = summary | {"lateness": lateness}
        write_summary(summary, out, machine)
    return summary


class Supervisor:
    """One run's processes and its clock."""

    def __init__(
        self, spec: RunSpec, sockets: Path, received: list[int], context: SecureContext, start_nodes: Start
    ) -> None:
        self._spec, self._sockets, self._interrupts = spec, sockets, received
        scene = spec.scene
        timebase = Timebase.from_scene(scene)
        self._clock = Clock(scene, timebase, spec.kinds, spec.pace, in_leaps=spec.clock == PLANT)
        self._context, self._machine = context, machine_of(context)
        secret = secrets.token_hex(16)
        told = {
            "out": str(spec.out.resolve()),
            "plugins": [str(path.resolve()) for path in spec.plugins],
            "brings": [str(path.resolve()) for path in spec.plugins] if names_of_files(scene) else [],
            "elements": installed(),
            "attachments": spec.attachments,
            "clock": spec.clock,
        }
        welcome = sockets.name, scene.as_dict(), timebase.as_dict(), told
        commands = Commands(self._clock, spec, lambda: self._server.roster)
        self._server = ClockServer(
            self._context, sockets, secret, self._clock, welcome, commands, spec.start_gate, spec.programs
        )
        transport = replace(spec.transport, patience_s=scene.run.deadline)
        loopback = "tcp://[::1]:0" if ":" in (spec.transport.host or "") else "tcp://127.0.0.1:0"
        here = with_host_of(self._server.address, loopback)
        keys = str(spec.transport.directory) if spec.transport.directory else None
        run_directory.announce(sockets, here, scene.title, str(spec.out.resolve()), keys)
        run_number = len(run_directory.live_runs()) - 1
        self._prints = ShownPrints(spec.out.resolve() / PRINTS)
        start = {"address": here, "secret": secret, "prints": str(spec.out.resolve() / PRINTS)}

        def told_to(role: str) -> Message:
            if role in spec.programs and spec.programs[role].is_external:  # perhaps on another host
                own = {"address": self._server.address, "transport": transport.of(role, elsewhere=True).as_dict()}
                return start | own
            # A node on this machine ends with its launcher, and may wait for one that is stopped.
            return {**start, "transport": replace(transport.of(role), patience_s=0.0).as_dict()}

        self._told_to = told_to
        self._start_nodes = partial(start_nodes, sockets, told_to, scene.run.pin, run_number, spec.programs)
        self._external = [program for program in spec.programs.values() if program.is_external]
        self._children: dict[str, Child] = {} if self._external else self._start_nodes()
        self._deadlines = self._watch()
        if not math.isinf(spec.pace):  # while the nodes are loading
            self._clock.prepare()
        self._stopping = False

    def _watch(self) -> Deadlines:
        return Deadlines(self._spec, self._clock, self._server, self._children, self._machine)

    def run(self) -> Summary:
        failed = True
        gc.freeze()  # all that was loaded: a collection that went through it would hold up the clock for some 50 ms
        try:
            address = f" at {self._server.address}" if self._spec.transport.host else ""
            self._spec.on_started(self._sockets.name + address)
            if self._external:
                awaited = Awaited(self._sockets, self._external, self._server, self._machine)
                awaited.wait(self._told_to, self._spec.wait_s, self._interrupts)
                self._children = self._start_nodes()
                self._deadlines = self._watch()
            self._lead()
            failed = False
            summary = self._server.results["logger"]
            of_plant = self._spec.clock == PLANT
            late = lateness_told(self._server.results["plant"]) if of_plant else self._clock.pace.lateness()
            return _with_lateness(summary, late, self._spec.out, self._machine)
        except RunFailed as error:
            self._save(str(error))
            raise
        finally:
            gc.unfreeze()
            for child in self._children.values():
                child.kill()
            self._prints.close(failed)
            self._server.close()
            self._context.destroy(linger=0)

    @property
    def events(self) -> list[tuple[int, Event]]:
        return self._clock.events

    def _lead(self) -> None:
        poller = self._machine.poller()
        poller.register(self._server.socket, zmq.POLLIN)
        for child in self._children.values():
            poller.register(child.died, zmq.POLLIN)
        self._held = set(self._children)
        while not self._server.roster.all_own("done"):
            wait_s = self._clock.wait_s(self._machine.now())
            ready = self._machine.wait(poller, _LOOK_MS / 1000 if wait_s is None else min(wait_s, _LOOK_MS / 1000))
            self._server.serve()
            self._heed_signals()
            for child in self._children.values():
                if child.died in ready:
                    self._look_at(child)
                    poller.unregister(child.died)
            self._deadlines.check()
            self._prints.look(self._machine.now())
            self._prints.tell(self._server.untold)
            if logger := self._server.roster.own("logger"):
                self._spec.on_progress(logger.status)
            if self._server.results:
                self._let_go()
        self._see_off()
        for child in self._children.values():
            child.wait(self._spec.transport.linger_s + 1.0)

    def _let_go(self) -> None:
        """Lets every process that is done end, unless a node that may miss nothing still follows."""
        if not self._server.roster.followers():
            for role in self._server.results.keys() & self._held:
                self._held.remove(role)
                self._children[role].let_go()

    def _see_off(self) -> None:
        """Keeps what was published until all who may miss nothing have it; a signal, or their deadline, ends this."""
        signals, ended_at = len(self._interrupts), self._machine.now()
        while self._server.roster.followers() and len(self._interrupts) == signals:
            self._server.socket.poll(_LOOK_MS)
            self._server.serve()
            self._deadlines.check_observers(ended_at)
        for role in self._held:
            self._children[role].let_go()

    def _look_at(self, child: Child) -> None:
        """Deals with the end of a process: it is in order after DONE, otherwise the run fails."""
        ended = child.exit_description()
        given_up = self._machine.now() + (LAST_WORDS_S if child.exited() else 0.0)
        self._server.serve()
        while not ((node := self._server.roster.own(child.role)) and node.done):
            if self._machine.now() > given_up:
                # A process that was killed was not refused: the refused JOIN was somebody else's.
                refused = self._server.roster.refused.get(child.role) if not node and child.exited() else None
                raise RunFailed(
                    f"The {self._server.roster.label(child.role)} {ended}; {refused or self._deadlines.where()}"
                )
            self._server.socket.poll(20)
            self._server.serve()

    def _heed_signals(self) -> None:
        if len(self._interrupts) > 1:
            raise KeyboardInterrupt
        if self._interrupts and not self._stopping:
            self._stopping = True
            self._clock.note({"stop": True, "by": "signal"})
            self._clock.stop()
            self._server.serve()

    def _save(self, reason: str) -> None:
        """Has the nodes that answer hand their last blocks to the logger, ends them, and lets it write what it has."""
        roster, loop = self._server.roster, [child for role, child in self._children.items() if role != "logger"]
        patience = max(1.0, self._spec.scene.run.deadline / Run.deadline)
        lost = {node.role for node in roster.silent(self._machine.now(), patience * _SILENT_S)}
        lost |= {child.role for child in loop if child.wait(0.0)}
        if (logger := roster.own("logger")) and not self._children["logger"].wait(0.0):
            for child in loop:
                if child.role in lost:
                    child.kill()
            self._server.abort(reason, but=logger)
            given_up = self._machine.now() + patience * _HANDING_S
            for child in loop:
                child.wait(max(0.0, given_up - self._machine.now()))
        for child in loop:
            child.kill()
        self._server.abort(reason)
        if logger:
            self._children["logger"].wait(patience * _SAVING_S)
