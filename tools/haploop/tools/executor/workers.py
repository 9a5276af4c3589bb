"""Where the parts of a sweep are run: in this process, in processes of this machine, or on a Dask cluster.

All three are used as ``concurrent.futures``.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor, Executor, Future, ProcessPoolExecutor
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, Protocol

# NumPy's linear algebra would start a thread a core in every worker.
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


class WorkersError(Exception):
    """No worker can be had; the message says why and what to do."""


class Workers(Protocol):
    """What runs calls.

    Attributes:
        count: how many run at once.
        room: calls that are worth having under way.
        deaths: what a call raises whose worker died; all others in flight may raise it, too.
    """

    count: int
    room: int
    deaths: tuple[type[BaseException], ...]

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Have a call run; starts the workers when there are none."""
        ...

    def renew(self) -> None:
        """New workers in place of those that died."""
        ...

    def close(self, at_once: bool) -> None:
        """End them: after the calls in flight, or now."""
        ...


class Here:
    """This process: a call is done when it has been submitted."""

    count = room = 1
    deaths: tuple[type[BaseException], ...] = ()

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        future: Future[Any] = Future()
        try:
            future.set_result(call(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def renew(self) -> None:
        """Nothing dies without this process."""

    def close(self, at_once: bool) -> None:
        """Nothing is in flight."""


class Processes:
    """Processes of this machine, started anew (spawned), one thread each.

    They hold one end of a line of life; when the other goes, with this object or with this process, however it ended,
    they end at once.
    """

    deaths: tuple[type[BaseException], ...] = (BrokenExecutor,)

    def __init__(self, count: int) -> None:
        self.count, self.room = count, 2 * count
        self._executor: Executor | None = None
        # Workers hold the first end, this process alone the second.
        self._line: tuple[Connection, Connection] | None = None

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        with _one_thread_each():  # processes may be started at any submit
            if self._executor is None:
                self._start()
            assert self._executor
            return self._executor.submit(call, *arguments)

    def renew(self) -> None:
        self.close(at_once=True)

    def close(self, at_once: bool) -> None:
        if not self._executor or not self._line:
            return
        held, ours = self._line
        if at_once:
            ours.close()
        self._executor.shutdown(wait=True, cancel_futures=at_once)
        ours.close()
        held.close()
        self._executor = self._line = None

    def _start(self) -> None:
        """Start workers and see that they do start: of one that cannot, every scene would seem to be at fault."""
        context = get_context("spawn")
        self._line = context.Pipe(duplex=False)
        self._executor = ProcessPoolExecutor(self.count, context, initializer=_begin, initargs=self._line[:1])
        try:
            self._executor.submit(os.getpid).result()
        except BrokenExecutor as error:
            self.close(at_once=True)
            raise WorkersError(
                "Worker processes cannot be started. In a script of your own, what it does must stand below "
                '`if __name__ == "__main__":`, since every worker imports the script; or ask for one worker.'
            ) from error


class Cluster:
    """A Dask cluster that runs already; its scheduler finds new workers for those that died."""

    def __init__(self, address: str) -> None:
        try:
            import distributed
        except ImportError as error:
            raise WorkersError("A cluster needs Dask; install it with: pip install 'haploop[cluster]'") from error
        try:
            self._client = distributed.Client(address, timeout="10s", set_as_default=False)
        except (OSError, ValueError, TypeError) as error:
            raise WorkersError(f"There is no Dask scheduler at {address}: {error}") from error
        self._executor = self._client.get_executor(pure=False)
        self.count = sum(dict(self._client.nthreads()).values())  # pyright: ignore
        self.room = 2 * self.count
        self.deaths: tuple[type[BaseException], ...] = (distributed.KilledWorker,)
        if not self.count:
            self.close(at_once=True)
            raise WorkersError(f"The Dask scheduler at {address} has no workers yet; start some with: dask worker")

    def submit(self, call: Callable[..., Any], *arguments: Any) -> Future[Any]:
        return self._executor.submit(call, *arguments)

    def renew(self) -> None:
        """The scheduler does."""

    def close(self, at_once: bool) -> None:
        self._executor.shutdown(wait=not at_once)
        self._client.close()


def _begin(held: Connection) -> None:
    """Make this process a worker: Ctrl-C is for the one that started it, and without that one it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(held,), daemon=True).start()


def _end_with(held: Connection) -> None:
    with contextlib.suppress(EOFError, OSError):
        held.recv()
    os._exit(1)


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes started in here use one thread each, unless the user asked for another number."""
    ours = [name for name in _THREADS if name not in os.environ]
    os.environ.update(dict.fromkeys(ours, "1"))
    try:
        yield
    finally:
        for name in ours:
            del os.environ[name]
