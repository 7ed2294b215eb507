"""What every sealed challenge has: secrets that are asked about, and answers that are counted."""

from __future__ import annotations

import argparse
import pickle
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol, TypeVar

import numpy as np

NEAR: Final = 0.1
"""Share of an unknown's size within which its estimate is right [use]."""
SIGMAS: Final = 3.0
"""Sigmas within which it is right: one in 370 is not, by chance [probability]."""
NORMAL_95: Final = 1.96
"""Sigmas of an interval of 95 % [probability]."""


class Answered(Protocol):
    """One recording's answer and what was said."""

    @property
    def seal(self) -> str:
        """Hash of the answer."""

    @property
    def seconds(self) -> tuple[float, float]:
        """Time to make the recording, and to ask about it."""

    @property
    def wanted(self) -> set[str]:
        """Names that should be said."""

    @property
    def identified(self) -> bool:
        """Every concealed effect is named."""


S = TypeVar("S")
A = TypeVar("A", bound=Answered)


@dataclass(frozen=True, slots=True)
class Measured:
    """One unknown: truth, estimate, sigma; ``size`` is what ten per cent are of."""

    name: str
    truth: float
    value: float
    sigma: float
    size: float

    @property
    def right(self) -> bool:
        """Within ten per cent or three sigma."""
        sigma = self.sigma if np.isfinite(self.sigma) else 0.0
        return abs(self.value - self.truth) <= max(NEAR * self.size, SIGMAS * sigma)

    @property
    def covered(self) -> bool:
        """The truth is in the interval of 95 %."""
        return abs(self.value - self.truth) <= NORMAL_95 * self.sigma


def named(outcomes: Sequence[Answered]) -> str:
    """Of how many all names were said, of those that have any; blank if none has."""
    wanted = [o for o in outcomes if o.wanted]
    return f"{sum(o.identified for o in wanted)} of {len(wanted)}" if wanted else ""


def parser(description: str, *, count: int, first: int) -> argparse.ArgumentParser:
    """The command line of a challenge, with its usual count and first seed."""
    made = argparse.ArgumentParser(description=description)
    made.add_argument("--count", type=int, default=count, help="so many, fairly drawn; 0: all")
    made.add_argument("--first", type=int, default=first, help="first seed")
    made.add_argument("--processes", type=int, default=1)
    made.add_argument("--save", type=Path, help="keep the outcomes here")
    return made


def answers(one: Callable[[S], A], secrets: Sequence[S], processes: int) -> Iterator[A]:
    """What is answered of each secret, in their order."""
    if processes <= 1:
        yield from map(one, secrets)
        return
    with ProcessPoolExecutor(max_workers=processes) as pool:
        yield from pool.map(one, secrets)


def kept(every: Iterator[A], tell: Callable[[A], str], save: Path | None) -> list[A]:
    """All outcomes; what there is to tell of one is printed, and a file is kept of them so far."""
    outcomes: list[A] = []
    for o in every:
        outcomes.append(o)
        told = tell(o)
        if told:
            print(told, flush=True)
        if save:
            save.write_bytes(pickle.dumps(outcomes))
    return outcomes


def summary(outcomes: Sequence[Answered], asked: str) -> str:
    """Times and seals; ``asked`` is what was done with the recordings, as a verb."""
    made_s, asked_s = np.array([o.seconds for o in outcomes]).T
    return (
        f"seconds a recording: {np.mean(made_s):.1f} to make, {np.mean(asked_s):.1f} to {asked}\n"
        f"seals: {' '.join(o.seal[:16] for o in outcomes[:4])} ..."
    )
