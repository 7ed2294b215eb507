"""The order in which recordings of one vehicle were flown: their dates say it, no command line.

The later flights count where a sensor has changed, and what was set last is in force: an order that
is wrong gives the numbers of a sensor that is gone.  Two recordings follow each other if one ends
before the other begins, by GPS or by what the autopilot took from it
(:mod:`onboard.recordings.dates`).  The clock of a boot says nothing of another boot.

* Where every recording has a date, recordings that follow each other are in that order.  Those that
  overlap (simulators fly many flights at once) are in the order given, beside it.
* One without a date could be anywhere: the order given stands.  If the dates that there are
  contradict it, it is known to be wrong, and nobody can say where the others belong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, TypeVar

from onboard.core.physics.wording import listed
from onboard.errors import RecordingError, UsageError
from onboard.recordings.provenance import Provenance, provenance
from onboard.recordings.recording import Recording

Given = TypeVar("Given", bound=str | Path | Recording)


@dataclass(frozen=True, slots=True)
class InOrder(Generic[Given]):
    """Recordings in the order in which they were flown; ``notes`` say how that is known."""

    recordings: tuple[Given, ...]
    notes: tuple[str, ...] = ()


def in_order(given: Sequence[Given]) -> InOrder[Given]:
    """Put recordings of one vehicle in the order in which they were flown.

    Raises:
        UsageError: dates contradict the order given, and not all recordings have one.
    """
    if len(given) < 2:
        return InOrder(tuple(given))
    paths = [g.path if isinstance(g, Recording) else Path(g) for g in given]
    told = [_told(path) for path in paths]
    undated = [path for path, one in zip(paths, told, strict=True) if not one.dated]
    if undated:
        _refuse_contradiction(paths, told, undated[0])
        return InOrder(tuple(given), (_undated(undated),))
    order = _sorted(told)
    notes = []
    if order != sorted(order):
        names = listed([paths[i].name for i in order])
        notes.append(f"Flown in another order than given, by their dates, and taken so: {names}")
    together = [
        i for i in sorted(order) if any(_at_once(told[i], told[k]) for k in order if k != i)
    ]
    if together:
        names = listed([paths[i].name for i in together])
        notes.append(f"The dates of {names} overlap: between those, the order given counts")
    return InOrder(tuple(given[i] for i in order), tuple(notes))


def _told(path: Path) -> Provenance:
    try:
        return provenance(path)
    except (OSError, RecordingError):  # arrays of a program, a table; a file that nobody can read
        return Provenance()


def _refuse_contradiction(paths: Sequence[Path], told: Sequence[Provenance], undated: Path) -> None:
    for k, later in enumerate(told):
        for i in range(k):
            if later.before(told[i]):
                raise UsageError(
                    f"{paths[k]}: flown before {paths[i]} and given after it, and {undated} does "
                    "not say when it was flown; give them in the order in which they were flown"
                )


def _at_once(a: Provenance, b: Provenance) -> bool:
    return not (a.before(b) or b.before(a))


def _undated(undated: Sequence[Path]) -> str:
    names, verb = listed([path.name for path in undated]), "does" if len(undated) == 1 else "do"
    return f"{names} {verb} not say when it was flown: the order given counts"


def _sorted(told: Sequence[Provenance]) -> list[int]:
    """Indices, each after those that were flown before it, else as given."""
    left, out = list(range(len(told))), list[int]()
    while left:
        first = next(i for i in left if not any(told[k].before(told[i]) for k in left))
        left.remove(first)
        out.append(first)
    return out
