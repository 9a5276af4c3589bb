"""Executors of calls: this process, processes of this machine, or a Dask cluster, used as ``concurrent.futures``."""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent import futures
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection
from typing import Any, Self, TypeVar

from haploop.launch.one_thread import ask_for_one_thread
from haploop.protocol.installed import sources_brought
from haploop.protocol.plugin_file import bring_source
from haploop.protocol.transport.prints import unheard
from haploop.tools.machine import cores

_INTERRUPT = {signal.SIGINT}
Item = TypeVar("Item")
Answer = TypeVar("Answer")


class ExecutorError(Exception):
    """No worker is available; the message says why and what to do."""


class Executor:
    """Runs calls; a context manager, which at its end waits for the calls in flight, or drops them after an error.

    Attributes:
        count: how many calls run at once.
        room: how many calls are worth having under way.
        worker_died: errors of a call whose worker died; all others in flight may raise them, too.
    """

    count: int
    room: int
    worker_died: tuple[type[BaseException], ...]

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submits a call; starts the workers if there are none."""
        raise NotImplementedError

    def renew(self) -> None:
        """Replaces workers that died, where nothing else does."""

    def close(self, at_once: bool) -> None:
        """Ends the workers, if there are any: after the calls in flight, or now."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: Any) -> None:
        self.close(at_once=kind is not None)


def make_executor(workers: int | None = None, dask: str | None = None) -> Executor:
    """Makes an executor of ``workers`` processes (one per core when None, this one when 1) or of a Dask scheduler's.

    Raises ExecutorError if there is no such cluster.
    """
    if dask:
        return DaskExecutor(dask)
    count = workers or cores()
    return InlineExecutor() if count == 1 else ProcessExecutor(count)


def map_parallel(
    executor: Executor,
    call: Callable[[Item], Answer],
    items: Iterable[Item],
    advance: Callable[[], object] = lambda: None,
) -> list[Answer]:
    """Calls an importable function on each item, all under way at once; returns the answers in order.

    ``advance`` is called after each answer, in any thread.
    """
    submitted: list[Future[Answer]] = []
    for item in items:
        submitted.append(executor.submit(call, item))
        submitted[-1].add_done_callback(lambda _: advance())
        if submitted[-1].done():
            submitted[-1].result()  # an error ends the work at once
    return [future.result() for future in submitted]


class InlineExecutor(Executor):
    count = room = 1
    worker_died: tuple[type[BaseException], ...] = ()

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(call(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future


class ProcessExecutor(Executor):
    """Newly spawned processes of this machine, one thread each.

    They hold one end of a pipe and end at once when the other is closed, by this object or the end of this process.
    """

    worker_died: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, count: int) -> None:
        self.count, self.room = count, 2 * count
        self._executor: futures.Executor | None = None
        self._pipe: tuple[Connection, Connection] | None = None  # the workers' end, and ours

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with _one_thread_each(), _interrupts_held_back():  # processes may be started at any submit
            if self._executor is None:
                self._start()
            assert self._executor
            return self._executor.submit(call, *arguments)

    def renew(self) -> None:
        self.close(at_once=True)

    def close(self, at_once: bool) -> None:
        if not self._executor or not self._pipe:
            return
        held, ours = self._pipe
        if at_once:
            ours.close()
        self._executor.shutdown(wait=True, cancel_futures=at_once)
        ours.close()
        held.close()
        self._executor = self._pipe = None

    def _start(self) -> None:
        """Starts workers and checks that they do start: if one cannot, every scene would seem to be at fault."""
        context = get_context("spawn")
        held, _ = self._pipe = context.Pipe(duplex=False)
        begin = partial(_begin, held, sources_brought())
        self._executor = ProcessPoolExecutor(self.count, context, initializer=begin)
        try:
            self._executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            self.close(at_once=True)
            raise ExecutorError(
                "Worker processes cannot be started. In your own script, put what it does below "
                '`if __name__ == "__main__":`, since every worker imports the script; or ask for one worker.'
            ) from error


class DaskExecutor(Executor):
    """A Dask cluster that is already running; its scheduler finds new workers for those that died."""

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError as error:
            raise ExecutorError("A cluster needs Dask; install it with: pip install 'haploop[cluster]'") from error
        try:
            self._client = distributed.Client(address, timeout="10s", set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise ExecutorError(f"There is no Dask scheduler at {address}: {error}") from error
        self._executor = self._client.get_executor(pure=False)
        threads: Any = self._client.nthreads()
        self.count = sum(threads.values())
        self.room = 2 * self.count
        self.worker_died = (distributed.KilledWorker,)
        if not self.count:
            self.close(at_once=True)
            raise ExecutorError(f"The Dask scheduler at {address} has no workers yet; start some with: dask worker")

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._executor.submit(_called, sources_brought(), pickle.dumps((call, arguments)))

    def close(self, at_once: bool) -> None:
        self._executor.shutdown(wait=not at_once)
        self._client.close()


def _begin(held: Connection, sources: tuple[tuple[str, str], ...]) -> None:
    """Makes this process a worker: Ctrl-C is left to the process that started it, and it ends when that one does.

    ``sources`` are the plugin files that brought what scenes may name.
    """
    _bring(sources)

    def end_with() -> None:
        with contextlib.suppress(EOFError, OSError):
            held.recv()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, _INTERRUPT)
    threading.Thread(target=end_with, daemon=True).start()


@contextlib.contextmanager
def _interrupts_held_back() -> Iterator[None]:
    """Delivers Ctrl-C only afterwards; processes started in here inherit that it is blocked, until ``_begin``."""
    resource_tracker.ensure_running()  # its start would let Ctrl-C through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, _INTERRUPT)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _bring(sources: tuple[tuple[str, str], ...]) -> None:
    with unheard() if sources else contextlib.nullcontext():
        for source, origin in sources:
            bring_source(source, origin)


def _called(sources: tuple[tuple[str, str], ...], packed: bytes) -> Any:
    """Runs a packed call once the kinds it needs are known here."""
    _bring(sources)
    call, arguments = pickle.loads(packed)
    return call(*arguments)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Gives processes started in here one thread each, unless the user asked for another number."""
    ours = ask_for_one_thread(os.environ)
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]
