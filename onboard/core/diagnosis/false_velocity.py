"""Velocities of a receiver that are false: each by anything at all, or for a while by one error.

What goes wrong in a receiver lasts, and mostly it is off by much the same then.  Each false
velocity that may be anything has its price in likelihood; one error has two unknowns for them all,
and tells how large it is, with what else the flight knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.diagnosis.examination import VELOCITY, Examination
from onboard.core.diagnosis.faults import earth_axis, fault_of
from onboard.core.diagnosis.limits import LARGEST_FALSE, MEAN_S
from onboard.core.diagnosis.refusals import Refused as Doubted
from onboard.core.diagnosis.refusals import within
from onboard.core.diagnosis.score import least, surprise
from onboard.core.filter.refused import Refused
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.model.around import Around
from onboard.core.model.regressors import Direct, Family, Unknown
from onboard.core.physics.finding import Finding, Quantity

Interval = tuple[float, float]


class FalseVelocity(Family):
    """Velocities that are all off by the same, north and east, from one moment to another."""

    def __init__(self, start: float, end: float) -> None:
        """Take the first and the last moment, s on the boot clock."""
        self.start, self.end = start, end
        self.name = f"false_velocity_{start:.2f}"
        self.unknowns = tuple(
            Unknown(f"{self.name}_{axis}", "m/s", 0.0, LARGEST_FALSE) for axis in ("north", "east")
        )

    def velocity(self, around: Around) -> Direct:
        """``n_i`` for as long as it lasts."""
        inside = (around.now.t >= self.start) & (around.now.t <= self.end)
        return Direct(ned=inside[:, None, None] * np.eye(3)[:, :2])


@dataclass(frozen=True, slots=True)
class AsFault:
    """A flight whose receiver is at fault for a while, in both ways.

    Attributes:
        full: the flight, with what else is in it.
        batches: it, with the fixes believed that both are asked about.
        anything: each velocity meanwhile is refused.
        one: what they are off by is unknown, and one and the same in each of ``families``.
        families: an error each.
    """

    full: Examination
    batches: Sequence[Batch]
    anything: Examination
    one: Examination
    families: tuple[FalseVelocity, ...]

    @property
    def log_likelihood(self) -> float:
        """Of what is likelier."""
        return max(self.anything.log_likelihood, self.one.log_likelihood)

    @property
    def is_one(self) -> bool:
        """Whether one error each is likelier than anything at all."""
        return self.one.log_likelihood > self.anything.log_likelihood

    def errors(self) -> list[tuple[int, Array, float]]:
        """Those that are no chance: which, north and east (2,), m/s, and sigma of the size.

        One may begin and end at any second of the flight.
        """
        found, out = self.one.found(), []
        places = max(0.5 * (self.full.trusted_s / MEAN_S) ** 2, 1.0)
        for k, family in enumerate(self.families):
            index = self.one.indices(family)
            off, C = found.theta[index], found.covariance[np.ix_(index, index)]
            inverse = np.linalg.inv(C)
            if surprise(float(off @ inverse @ off), len(off), places) >= least():
                along = off / np.linalg.norm(off)
                out.append((k, off, float(np.sqrt(along @ C @ along))))
        return out


def as_fault(
    full: Examination, intervals: Sequence[Interval], t0: float, batches: Sequence[Batch]
) -> AsFault:
    """The flight with false velocities.

    Args:
        full: the flight with every column, its sums made.
        intervals: in which they are false, s since ``t0``.
        t0: s on the boot clock.
        batches: the flight, with the fixes believed that both are asked about.
    """
    inside = _stamps(full, batches, intervals, t0)
    faulty = Refused([*((t, VELOCITY[0]) for t in inside), *full.refused_velocities().items()])
    anything = full.beside((), faulty, batches).with_rows()
    anything.let_epochs_go()
    families = tuple(FalseVelocity(a + t0, b + t0) for a, b in intervals)
    one = full.beside(families, batches=batches).with_rows()
    # Where an error begins and ends tells most of it, and is in the tails of what expects none.
    one.with_rows(one.found().theta, one.found().covariance)
    one.let_epochs_go()
    return AsFault(full, batches, anything, one, families)


def sized(fault: Finding, made: AsFault, t0: float) -> Finding:
    """A fault with what its velocities were off by, and without what is no error at all.

    Where dead reckoning runs away in the middle of a fault, or right after it, it seems to find
    another one; beside those that are true, that is a chance.

    Args:
        fault: with one interval for each error.
        made: it in both ways.
        t0: s on the boot clock.
    """
    intervals, kept = fault.intervals, made.errors()
    if made.is_one and kept and len(kept) < len(intervals):
        intervals = tuple(intervals[k] for k, _, _ in kept)
        made = as_fault(made.full, intervals, t0, made.batches)
        kept = made.errors()
    if not made.is_one or not kept:
        return fault
    _, off, sigma = max(kept, key=lambda error: float(np.linalg.norm(error[1])))
    before = fault.unknowns.get("offset")
    sigma = float(np.hypot(sigma, 0.0 if before is None else before.sigma))
    size = Quantity(float(np.linalg.norm(off)), sigma, "m/s")
    return fault_of(made.batches, t0, _joined(intervals), size, earth_axis(off))


def heard(batches: Sequence[Batch], doubted: Sequence[Doubted]) -> list[Batch]:
    """The flight with the velocities believed that others doubted (stamps, s on the boot clock)."""
    out, spans = [], [(span.start, span.end) for span in doubted]
    for batch in batches:
        inside = within(batch.fixes.t, spans)
        inside &= np.all(np.isfinite(batch.fixes.v_n[:, :2]), axis=1)
        out.append(replace(batch, trusted=batch.trusted | inside))
    return out


def _stamps(
    full: Examination, batches: Sequence[Batch], intervals: Sequence[Interval], t0: float
) -> list[float]:
    """Those of velocities in some intervals, s since ``t0``."""
    out: list[float] = []
    for batch in batches:
        inside = within(full.point.true_time(batch.fixes.t) - t0, intervals)
        out += batch.fixes.t[inside & batch.trusted].tolist()
    return out


def _joined(intervals: Sequence[Interval]) -> list[Interval]:
    """Intervals in order of time; those that follow on each other are one."""
    out: list[Interval] = []
    for a, b in intervals:
        if out and a - out[-1][1] <= LONGEST_FIX_GAP_S:
            out[-1] = (out[-1][0], max(b, out[-1][1]))
        else:
            out.append((a, b))
    return out
