"""The same jobs on a Dask cluster that is there: batches of them, each a task.

A task starts a process of its own for its logs, as the local crew does: results are the same, and a
log that kills its process costs itself.  A worker that is lost loses its batch, which the scheduler
gives to another one; of a batch that has lost too many workers each log is tried by itself.  Logs,
and the store, have to be under the same path on every worker.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from onboard.batches.crew import outcomes
from onboard.batches.job import Job, Outcome, version
from onboard.errors import LinkError, UsageError

PER_BATCH = 100
"""Recordings a task: minutes of work beside milliseconds of scheduling [cost]."""
MOST_PER_BATCH = 1_000
"""More would be hours that a lost worker loses [cost]."""
CONNECT_S = 10.0
"""s to wait for a scheduler, one that answers at all does so at once [cost]."""


def batch(jobs: Sequence[Job]) -> list[Outcome]:
    """One task: jobs, one after the other, in a process of their own."""
    found = dict(outcomes(jobs, 1))
    return [found[i] for i in range(len(jobs))]


def on_cluster(
    address: str, jobs: Sequence[Job], per_batch: int = PER_BATCH
) -> Iterator[tuple[int, Outcome]]:
    """Do jobs on a cluster; number and outcome of each, as batches are done.

    Args:
        address: of the scheduler, ``tcp://HOST:8786``.
        jobs: what to do; each names the version that is to do it.
        per_batch: jobs a task.

    Raises:
        UsageError: dask.distributed is not installed, or a worker runs another version or none.
        LinkError: no scheduler answers, or it has no workers.
    """
    distributed = imported()
    try:
        client = distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError) as error:
        said = " ".join(str(error).split())
        raise LinkError(f"--scheduler {address}: no scheduler answers ({said})") from None
    with client:
        _same_version(client, address)
        numbered = list(enumerate(jobs))
        parts = [numbered[i : i + per_batch] for i in range(0, len(numbered), per_batch)]
        lost: list[list[tuple[int, Job]]] = []
        for part, found in _done(distributed, client, parts):
            if isinstance(found, str):
                lost.append(part)
            else:
                yield from zip((i for i, _ in part), found, strict=True)
        single = [[item] for part in lost for item in part]
        for part, found in _done(distributed, client, single):
            number, job = part[0]
            yield (
                number,
                (Outcome(error=f"{job.file}: {found}") if isinstance(found, str) else found[0]),
            )


def imported() -> Any:  # noqa: ANN401 - a library without types
    """``distributed``.

    Raises:
        UsageError: it is not installed.
    """
    try:
        import distributed  # noqa: PLC0415 - an extra
    except ImportError:
        raise UsageError(
            "--scheduler: needs dask.distributed: pip install 'onboard-calibration[dask]'"
        ) from None
    return distributed


def _same_version(client: Any, address: str) -> None:  # noqa: ANN401
    """See that the workers give the same numbers as this machine."""
    try:
        theirs = client.run(version)
    except (ImportError, OSError) as error:
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise UsageError(f"--scheduler {address}: its workers lack onboard ({said})") from None
    if not theirs:
        raise LinkError(f"--scheduler {address}: it has no workers")
    other = {name: its for name, its in theirs.items() if its != version()}
    if other:
        worker, its = next(iter(sorted(other.items())))
        raise UsageError(
            f"--scheduler {address}: {worker} runs another version ({its}, here {version()})"
        )


def _done(
    distributed: Any,  # noqa: ANN401
    client: Any,  # noqa: ANN401
    parts: Sequence[list[tuple[int, Job]]],
) -> Iterator[tuple[list[tuple[int, Job]], list[Outcome] | str]]:
    """Batches and what came of them, as they are done; a reason where workers were lost."""
    if not parts:
        return
    futures = {client.submit(batch, [job for _, job in part], pure=False): part for part in parts}
    for future in distributed.as_completed(list(futures)):
        part = futures.pop(future)
        error = future.exception()
        if error is None:
            yield part, future.result()
        elif isinstance(error, distributed.scheduler.KilledWorker):
            yield part, "every worker that replayed it was lost"
        else:
            yield part, f"the cluster gave it up ({type(error).__name__}: {error})"
        future.release()
