"""Recordings in, results out: in the order of the files, whoever replays them."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from onboard.answers.fleet.record import Flown
from onboard.batches.cluster import PER_BATCH, on_cluster
from onboard.batches.crew import Told, outcomes
from onboard.batches.job import Job, Outcome, version
from onboard.printable import encodable

Paged = Callable[[str, bytes], None]
"""Told the name of a recording and its report, packed by gzip."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Orders:
    """How recordings are to be replayed.

    Attributes:
        processes: on this machine.
        imu: answer for this accelerometer only; None: all.
        paged: a report of each is wanted.
        documents: what only a JSON document asks for is wanted.
        store: where results are kept; None: nowhere.
        scheduler: of a Dask cluster that does it instead; empty: this machine does.
        per_batch: recordings for each task of the cluster.
    """

    processes: int
    imu: int | None = None
    paged: bool = False
    documents: bool = True
    store: Path | None = None
    scheduler: str = ""
    per_batch: int = PER_BATCH


def fly(
    files: Sequence[tuple[Path, str]],
    orders: Orders,
    *,
    told: Told | None = None,
    paged: Paged | None = None,
) -> Iterator[Flown]:
    """Replay each file by itself.

    Args:
        files: as :func:`onboard.answers.fleet.places.found` gives them.
        orders: how.
        told: of what is going on.
        paged: takes each report as soon as it is there: many are large.

    Raises:
        UsageError, LinkError: the cluster cannot be used.
    """
    jobs = [_job(path, orders) for path, _ in files]
    if orders.scheduler:
        source = on_cluster(orders.scheduler, jobs, orders.per_batch)
    else:
        source = outcomes(jobs, orders.processes, told)
    early: dict[int, Flown] = {}
    following = 0
    for number, outcome in source:
        path, name = files[number]
        if paged is not None and outcome.page:
            paged(name, outcome.page)
        if told is not None:
            told(number, 1.0)
        one = _flown(path, name, outcome, jobs[number])
        if one.record is not None and not orders.documents:
            one = replace(one, record=one.record.lean)
        early[number] = one
        while following in early:
            yield early.pop(following)
            following += 1


def _job(path: Path, orders: Orders) -> Job:
    """Absolute paths: a process elsewhere has another working directory."""
    return Job(
        path=os.fsencode(path.absolute()),
        imu=orders.imu,
        paged=orders.paged,
        store="" if orders.store is None else str(orders.store.absolute()),
        version=version(),
    )


def _flown(path: Path, name: str, outcome: Outcome, job: Job) -> Flown:
    record = None if outcome.record is None else outcome.record.named(path)
    there = encodable(str(job.file))  # as it came back from another process
    error = outcome.error.replace(str(job.file), str(path)).replace(there, str(path))
    return Flown(path, name, record, error, outcome.notes)
