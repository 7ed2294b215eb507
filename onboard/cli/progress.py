"""Progress for people: bars on standard error while a terminal is there, else nothing at all."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

Told = Callable[[float], None]
"""Told the share of the work that is done, 0 ... 1."""


@contextmanager
def reading(logs: Sequence[Path], then: str = "") -> Iterator[Told | None]:
    """A bar for the reading of recordings; ``then`` is said when that is done."""
    if not sys.stderr.isatty():
        yield None
        return
    name = logs[0].name if len(logs) == 1 else f"{len(logs)} recordings"
    columns = SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"reading {name}", total=1.0)

        def told(done: float) -> None:
            said = then if then and done >= 1.0 else f"reading {name}"
            bar.update(task, completed=done, description=said)

        yield told


@contextmanager
def waiting(what: str) -> Iterator[None]:
    """A spinner for what takes long and tells no share of it."""
    if not sys.stderr.isatty():
        yield
        return
    with Console(stderr=True).status(what):
        yield


@contextmanager
def many(total: int) -> Iterator[Callable[[int, float], None] | None]:
    """A bar for many recordings: told the number of one and the share of it that is done."""
    if not sys.stderr.isatty():
        yield None
        return
    columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn()
    shares: dict[int, float] = {}
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"reading {total} recordings", total=total)

        def told(number: int, share: float) -> None:
            shares[number] = max(share, shares.get(number, 0.0))
            done = sum(s >= 1.0 for s in shares.values())
            said = f"reading, {done} of {total} done"
            bar.update(task, completed=sum(shares.values()), description=said)

        yield told
