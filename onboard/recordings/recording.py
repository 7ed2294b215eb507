"""What every reader returns: a recording that can be read as samples, once or again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import Piece
from onboard.core.inputs.samples import Sample

LONGEST_GAP_S = 3600.0
"""A step of the clock longer than this is a damaged time stamp, not a pause."""


@dataclass(frozen=True, slots=True)
class Recording:
    """One opened file.

    ``kind`` is ``tlog``, ``dataflash``, ``ulog`` or ``table``; ``autopilot`` is ``ardupilot``,
    ``px4`` or ``unknown``; ``duration_s`` counts the autopilot's clock over the inertial samples,
    restarts excluded; ``counts`` has the number of messages that are read, by their name in the
    file; ``damage`` says in plain words what was skipped and ``notes`` what was chosen;
    ``airborne``: whether all of it is flight, so that no ground is to be looked for; ``derived``:
    whether its force is the slope of its velocity, so that it has no accelerometer to calibrate.
    ``read`` gives samples one by one; ``gather`` the same ones with as many together as can be,
    where the reader can do that, in a fraction of the time.
    """

    path: Path
    kind: str
    autopilot: str
    duration_s: float
    counts: dict[str, int]
    read: Callable[[], Iterator[Sample]] = field(repr=False)
    damage: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    airborne: bool = False
    derived: bool = False
    gather: Callable[[], Iterator[Piece]] | None = field(default=None, repr=False)

    def samples(self) -> Iterator[Sample]:
        """Every sample in the order of the file; each call starts from the beginning."""
        return self.read()

    def pieces(self) -> Iterator[Piece]:
        """The same, with samples together between those that they must not reach over."""
        return self.read() if self.gather is None else self.gather()

    def closed(self) -> Recording:
        """The same without its samples, and without what it takes to find them."""
        return replace(self, read=_nothing, gather=None)


def _nothing() -> Iterator[Sample]:
    return iter(())


def elapsed_s(t: NDArray[np.float64]) -> float:
    """Time that a clock ``t`` (n,) counted, s: restarts and impossible steps add nothing."""
    steps = np.diff(t)
    return float(steps[(steps > 0.0) & (steps < LONGEST_GAP_S)].sum())


def damage_by_file(recordings: Sequence[Recording]) -> list[str]:
    """What was skipped of each recording, with the name of its file before it."""
    return [f"{r.path.name}: {note}" for r in recordings for note in r.damage]


def because_of(damage: Iterable[str]) -> str:
    """What to add to the reason why a file cannot be used; empty of one that is whole."""
    return "".join(f"; {note}" for note in damage)


def damage_notes(places: int, skipped: int, cut_off: int) -> tuple[str, ...]:
    """What was skipped in plain words: bytes at damaged places, and at an end that is cut off."""
    notes = []
    if places:
        named = "place" if places == 1 else "places"
        notes.append(f"{places} damaged {named}, {_bytes(skipped)} skipped")
    if cut_off:
        notes.append(f"cut off: the end of the log is missing ({_bytes(cut_off)} skipped)")
    return tuple(notes)


def _bytes(count: int) -> str:
    return "1 byte" if count == 1 else f"{count} bytes"
