"""The private directory of a run: held by its launcher's lock, and removed file by file, only what is haploop's."""

from __future__ import annotations

import contextlib
import fcntl
import os
import re
import secrets
import stat
import tempfile
from collections.abc import Iterator
from pathlib import Path

from haploop.launch.foreign import ROLES, seat_file
from haploop.launch.spec import OutputError
from haploop.protocol.transport.messages import PROCESSES

ENTRY, PART, LOCK = "run.json", "run.part", "lock"
# Every name that may be in a private directory; the lock is removed last, as it says that the directory is haploop's.
_SOCKETS = ("clock", *(name for process in PROCESSES.values() for name in process.binds.values()))
_OURS = (*(f"{name}.sock" for name in _SOCKETS), *map(seat_file, ROLES), PART, ENTRY, LOCK)
_OWNER = b"haploop"
_NAME = re.compile(r"[0-9a-f]{6}")
# A socket's path must stay below the kernel's 107 bytes; this leaves room for the run and the socket's name.
_LONGEST_BASE = 70
_ADVICE = "set XDG_RUNTIME_DIR to a directory that you own."


def base_directory() -> Path:
    """Returns the user's directory of live runs, mode 0700, below XDG_RUNTIME_DIR or the temporary directory.

    Raises OutputError if it cannot be made, is a link or not a directory, or is open to others.
    """
    candidate = Path(os.environ.get("XDG_RUNTIME_DIR") or "-") / "haploop"
    try:
        if not (candidate.is_absolute() and candidate.parent.is_dir()) or _is_long(candidate):
            candidate = Path(tempfile.gettempdir()) / f"haploop-{os.getuid()}"
        if _is_long(candidate):
            candidate = Path("/tmp") / f"haploop-{os.getuid()}"
        with contextlib.suppress(FileExistsError):
            candidate.mkdir(mode=0o700)
        status = candidate.lstat()
    except OSError as error:
        what = f"The directory of live runs {candidate} cannot be made: {_why(error)}"
        raise OutputError(f"{what}; {_ADVICE}") from error
    if not stat.S_ISDIR(status.st_mode):
        raise OutputError(f"{candidate} must be a directory, not a link or a file; remove it or {_ADVICE}")
    if status.st_uid != os.getuid() or status.st_mode & 0o777 != 0o700:
        raise OutputError(
            f"{candidate} must belong to you alone (mode 0700), but it belongs to user {status.st_uid} with mode "
            f"{status.st_mode & 0o777:04o}; repair it with chmod 700, or {_ADVICE}"
        )
    return candidate


def _why(error: OSError) -> str:
    return error.strerror or str(error)


def _is_long(path: Path) -> bool:
    return len(os.fsencode(path)) > _LONGEST_BASE


def directories() -> list[Path]:
    """Returns what is named like a run's private directory in the user's directory of live runs, oldest first."""
    found = [path for path in base_directory().iterdir() if _NAME.fullmatch(path.name)]
    return sorted(found, key=_mtime)


@contextlib.contextmanager
def made() -> Iterator[Path]:
    """Makes a private directory named by the run's id, and holds its lock: a sign of life that any death releases.

    At the end the files of the run are removed, and the directory unless something else is in it. Raises OutputError
    if it cannot be made.
    """
    with contextlib.ExitStack() as held:
        path = base_directory()
        try:
            while not (path := _made_in(path, held)):
                path = base_directory()
        except OSError as error:
            raise OutputError(f"A run's directory in {path} cannot be made: {_why(error)}; {_ADVICE}") from error
        yield path


def _made_in(base: Path, held: contextlib.ExitStack) -> Path | None:
    """Makes a directory that ``held`` removes; None if the name is taken, or it was cleared away unlocked."""
    path = base / secrets.token_hex(3)
    try:
        path.mkdir(mode=0o700)
    except FileExistsError:
        return None
    held.callback(_rmdir, path)
    directory = held.enter_context(_opened(path))
    held.callback(_unlink, directory)
    lock = os.open(LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600, dir_fd=directory)
    held.callback(os.close, lock)
    fcntl.flock(lock, fcntl.LOCK_EX)
    os.write(lock, _OWNER)
    return path if os.fstat(lock).st_nlink else None


def is_held(path: Path) -> bool:
    """Tells whether a launcher holds a private directory, in whatever container it runs."""
    try:
        with _opened(path) as directory:
            lock = _free_lock(directory, fcntl.LOCK_SH)
    except OSError:  # gone, or never haploop's
        return False
    if lock is not None:
        os.close(lock)
    return lock is None


def clear_dead(path: Path) -> None:
    """Removes what a dead launcher has left; one that is not haploop's, or holds anything else, stays as it is."""
    with contextlib.suppress(OSError), _opened(path) as directory:
        if not set(os.listdir(directory)) <= set(_OURS):  # noqa: PTH208 (of a descriptor)
            return
        lock = _free_lock(directory, fcntl.LOCK_EX)
        if lock is not None:
            _unlink(directory)
            os.close(lock)
            _rmdir(path)


def read_entry(path: Path) -> bytes:
    """Returns the content of the entry of a run, at most 64 KiB; raises OSError if there is none."""
    with _opened(path) as directory, open(_open_file(directory, ENTRY), "rb") as file:
        return file.read(1 << 16)


def _free_lock(directory: int, kind: int) -> int | None:
    """Takes the lock of a directory and returns its descriptor, None if somebody holds it; OSError if it has none."""
    lock = _open_file(directory, LOCK)
    try:
        if os.pread(lock, len(_OWNER), 0) != _OWNER:  # another program's, or not ready
            raise PermissionError
        fcntl.flock(lock, kind | fcntl.LOCK_NB)
    except OSError as error:
        os.close(lock)
        if isinstance(error, BlockingIOError):
            return None
        raise
    return lock


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[int]:
    """Opens a directory that is not a link and belongs to this user; raises OSError for any other."""
    directory = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        if os.fstat(directory).st_uid != os.getuid():
            raise PermissionError
        yield directory
    finally:
        os.close(directory)


def _open_file(directory: int, name: str) -> int:
    """Opens a regular file of this user in a directory, following no link and without waiting; else raises OSError."""
    descriptor = os.open(name, os.O_RDWR | os.O_NOFOLLOW | os.O_NONBLOCK, dir_fd=directory)
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode) or status.st_uid != os.getuid():
        os.close(descriptor)
        raise PermissionError
    return descriptor


def _unlink(directory: int) -> None:
    for name in _OURS:
        with contextlib.suppress(OSError):  # not there, or no file
            os.unlink(name, dir_fd=directory)


def _rmdir(path: Path) -> None:
    with contextlib.suppress(OSError):  # gone, or something else is in it
        path.rmdir()


def _mtime(path: Path) -> float:
    """Returns the time at which a run's directory was made; 0 for one that its run has just removed."""
    try:
        return path.lstat().st_mtime
    except OSError:
        return 0.0
