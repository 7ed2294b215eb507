"""What of a flight was not used, and why: a part of it that is not seen.

That is what the trust window refused; where the accelerometer repeated one reading; and where gates
refused nearly every fix for a while, for whatever the fit has there is of the flight before.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.limits import SAME_FIX_S
from onboard.core.diagnosis.records import REPEATED, Unused
from onboard.core.filter.refused import PER_SECOND
from onboard.core.filter.refused import Refused as RefusedVelocities
from onboard.core.gps.distrust import Distrust, RefusedFixes
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.physics.finding import Finding

LONG_S: Final = 5.0
"""s: a gate refuses no two dozen good fixes in a row [probability]."""
OPINIONS: Final = frozenset(
    {
        Distrust.SPOOFED,
        Distrust.JAMMED,
        Distrust.FEW_SATELLITES,
        Distrust.HDOP,
        Distrust.SPEED_ACCURACY,
        Distrust.GPS_GLITCH,
        Distrust.EKF_GPS_GLITCH,
        Distrust.EKF_UNHEALTHY,
    }
)
"""Reasons to refuse a receiver that has a fix and goes on reporting: the inertia can be asked."""


@dataclass(frozen=True, slots=True)
class Refused:
    """Flight without a fix that was used: from and to, s on the boot clock, and why."""

    start: float
    end: float
    reason: Distrust


def within(t: Array, intervals: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """(n,) whether times are in one of the intervals, whose ends are those of fixes."""
    to_the_fix = 1.0 / PER_SECOND
    inside = np.zeros(len(t), dtype=bool)
    for a, b in intervals:
        inside |= (t >= a - to_the_fix) & (t <= b + to_the_fix)
    return inside


def overlaps(start: float, end: float, intervals: Sequence[tuple[float, float]]) -> bool:
    """Whether a stretch has some time in common with one of the intervals."""
    return any(a < end and b > start for a, b in intervals)


def refused(batches: Sequence[Batch], refusals: Sequence[RefusedFixes]) -> list[Refused]:
    """Flight that was not used, in order of time, each segment with one reason.

    A segment goes from the first fix that was refused to the next one that was believed.

    Args:
        batches: the flight.
        refusals: of the trust window; where they do not reach (an earlier run), nothing is said.
    """
    out: list[Refused] = []
    opened, last = False, float("-inf")
    for batch in batches:
        for t, believed in zip(batch.fixes.t.tolist(), batch.trusted.tolist(), strict=True):
            if t == last:
                continue  # batches share a fix
            again = t > last and not batch.fresh
            if opened and again:
                out[-1] = replace(out[-1], end=t)
            elif again and t - last > LONGEST_FIX_GAP_S:
                out.append(Refused(last, t, Distrust.GPS_GAP))
            reason = None if believed else _reason(t, refusals)
            if reason is not None and not (opened and again and out[-1].reason is reason):
                out.append(Refused(t, t, reason))
            opened, last = reason is not None, t
    return out


def believed(batches: Sequence[Batch], refusals: Sequence[RefusedFixes]) -> int:
    """How many fixes of a flight were to be used; batches share their ends.

    Those that contradict each other are among them: which of two is false the trust window does
    not know, and has refused both.  What the receiver or the autopilot complained of is not.

    Args:
        batches: the flight.
        refusals: of the trust window.
    """
    glitches = [r for r in refusals if r.reason is Distrust.GPS_GLITCH]
    count, last = 0, float("-inf")
    for batch in batches:
        for t, trusted in zip(batch.fixes.t.tolist(), batch.trusted.tolist(), strict=True):
            if t != last:
                count += trusted or _reason(t, glitches) is not None
            last = t
    return count


def unused_flight(
    batches: Sequence[Batch],
    refusals: Sequence[RefusedFixes],
    far: Sequence[tuple[float, float]],
    t0: float,
    *,
    asked: bool,
) -> tuple[Unused, ...]:
    """What was not used, s since ``t0``, and what the inertia says of it, if it was ``asked``.

    Args:
        batches: the flight.
        refusals: of the trust window.
        far: where velocities are far from what the inertia says, s since ``t0``.
        t0: s on the boot clock.
        asked: whether it was.
    """
    out = []
    for r in refused(batches, refusals):
        start, end = r.start - t0, r.end - t0
        contradicted = overlaps(start, end, far) if asked and r.reason in OPINIONS else None
        out.append(Unused(start, end, r.reason.value, contradicted))
    return tuple(out)


def contradicted(
    batches: Sequence[Batch], gates: RefusedVelocities, fault: Finding | None, t0: float
) -> tuple[Unused, ...]:
    """Where gates refused most fixes for :data:`LONG_S` and more, s since ``t0``.

    Args:
        batches: the flight, as it was gone through.
        gates: what they refused.
        fault: of the receiver, which is told of by itself.
        t0: s on the boot clock.
    """
    known = fault.intervals if fault is not None else ()
    asked = np.array([(t, far) for t, far in _asked(batches, gates)]).reshape(-1, 2)
    t, far = asked[:, 0], asked[:, 1] > 0.0
    out = []
    for spell in np.split(t[far], np.flatnonzero(np.diff(t[far]) > LONGEST_FIX_GAP_S) + 1):
        if not len(spell):
            continue
        first, last = float(spell[0]), float(spell[-1])
        whole = int(np.sum((t >= first) & (t <= last)))
        start, end = first - t0, last - t0
        told = overlaps(start, end, known)
        if last - first >= LONG_S and len(spell) > whole / 2 and not told:
            out.append(Unused(start, end, "refused"))
    return tuple(out)


def repeated(stretches: Sequence[tuple[float, float]], t0: float) -> tuple[Unused, ...]:
    """Where the accelerometer repeated one reading, s since ``t0``."""
    return tuple(Unused(start - t0, end - t0, REPEATED) for start, end in stretches)


def _asked(batches: Sequence[Batch], gates: RefusedVelocities) -> Iterator[tuple[float, bool]]:
    """Stamps of the fixes that were to be used, and whether a gate refused the velocity."""
    last = float("-inf")
    for batch in batches:
        for t, believed in zip(batch.fixes.t.tolist(), batch.trusted.tolist(), strict=True):
            if t != last and believed:
                yield t, bool(gates.by(t))
            last = t


def _reason(t: float, refusals: Sequence[RefusedFixes]) -> Distrust | None:
    """Why the fix at ``t`` was refused: by the refusal that is nearest; None if none is near."""
    off = [(max(r.start - t, t - r.end, 0.0), k) for k, r in enumerate(refusals)]
    nearest, k = min(off, default=(float("inf"), 0))
    return refusals[k].reason if nearest <= SAME_FIX_S else None
