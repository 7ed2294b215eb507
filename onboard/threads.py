"""Linear algebra in one thread: its matrices are small, and a second thread mostly waits busily."""

from __future__ import annotations

from collections.abc import MutableMapping

ONE_THREAD = (
    "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS",
    "NUMBA_NUM_THREADS",
)  # fmt: skip
"""What libraries look at when they are loaded."""


def in_one_thread(environment: MutableMapping[str, str]) -> None:
    """Ask for one thread where nobody has asked for another number; before numpy is imported."""
    for name in ONE_THREAD:
        environment.setdefault(name, "1")
