"""One thread for NumPy: matrices here are small, and starting one thread per core takes as long as NumPy itself."""

from __future__ import annotations

from collections.abc import MutableMapping

# Read by the libraries that NumPy may be built with, when it is imported.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def ask_for_one_thread(environment: MutableMapping[str, str]) -> list[str]:
    """Asks for one thread in an environment; variables that the user has set stay. Returns those that are new."""
    new = [name for name in THREADS if name not in environment]
    environment.update(dict.fromkeys(new, "1"))
    return new
