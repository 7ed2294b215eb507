"""False GPS velocities: spells that the innovation gate refused, and whose failure they were."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from onboard.core.diagnosis.coasting import Contradiction
from onboard.core.diagnosis.limits import (
    FEWEST_FIXES,
    LONGEST_FAULT_S,
    MEAN_S,
    OFF,
    SAME,
)
from onboard.core.diagnosis.refusals import within
from onboard.core.diagnosis.regimes import spans
from onboard.core.filter.traces import Traces
from onboard.core.inputs.limits import LONGEST_FIX_GAP_S
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.physics.effects.gps_fault import GpsFault
from onboard.core.physics.finding import Finding, Quantity

ONSET = FEWEST_FIXES // 2 + 1
"""Fixes that show how a fault began: most of those that it has at least."""


def fault_effect(
    traces: Traces,
    batches: Sequence[Batch],
    t0: float,
    least: float,
    coast_s: float,
    distrusted: Sequence[tuple[float, float]] = (),
    contradicted: Sequence[Contradiction] = (),
) -> Finding | None:
    """GPS velocities that cannot be true: refused by the innovation gate for a while.

    Args:
        traces: of every epoch, with innovations as the flight was found to be.
        batches: the flight.
        t0: s on the boot clock.
        least: m/s by which no honest receiver is off.
        coast_s: how long the filter goes on without a velocity, s.
        distrusted: s since ``t0`` in which the receiver contradicted itself; they stand for a
            fault where the inertia, lost itself, cannot tell.
        contradicted: fixes refused in flight that the inertia has contradicted; not in ``traces``.
    """
    refused, seen = _innovations(traces)
    every = [_spell(run, seen, t0, least, coast_s) for run in _runs(traces, refused)]
    spells = [s for s in _paired(every, _jumps(seen, refused, t0)) if not s.lost]
    spells = _with_contradicted(spells, contradicted, t0)
    spells = spells or [_Spell(a, b, None, 0.0) for a, b in distrusted]
    intervals = [(s.start, s.end) for s in spells]
    worst = max(spells, key=lambda s: s.size, default=None)
    if worst is None:
        return None
    # A receiver that contradicts itself while the inertia is lost does not show its error.
    spread = float(np.hypot(least / OFF, worst.spread))
    off = Quantity(worst.size, spread, "m/s") if worst.size > 0.0 else None
    return fault_of(batches, t0, intervals, off, _earth_axis(s.off for s in spells))


def suspected(traces: Traces, t0: float) -> list[tuple[float, float]]:
    """From where to where a receiver may have been off by what is no fault by itself, s.

    A filter is used to a small error after a few fixes.  What speaks for one is that it is taken
    back: refused velocities at both ends that are off to opposite sides.

    Args:
        traces: of every epoch, with innovations as the flight was found to be.
        t0: s on the boot clock.
    """
    refused, seen = _innovations(traces)
    left = [_spell(run, seen, t0, 0.0, np.inf) for run in _runs(traces, refused)]
    out: list[tuple[float, float]] = []
    while left:
        first = left.pop(0)
        back = next((k for k, s in enumerate(left) if _undoes(s.onset, first.off)), None)
        if back is not None and left[back].start - first.end < LONGEST_FAULT_S:
            out.append((first.start, left[back].start))
            left = left[back + 1 :]
    return out


def fault_of(
    batches: Sequence[Batch],
    t0: float,
    intervals: Sequence[tuple[float, float]],
    off: Quantity | None,
    axis: str,
) -> Finding:
    """A fault that lasts for some intervals (s since ``t0``), with what velocities are off by."""
    sizes = {"duration": Quantity(float(sum(b - a for a, b in intervals)), 0.5, "s")}
    t = np.unique(np.concatenate([c.fixes.t for c in batches])) - t0
    return Finding(
        name=GpsFault.effect,
        unknowns=sizes if off is None else {"offset": off, **sizes},
        share_of_mismatch=float(np.mean(within(t, intervals))),
        delta_bic=0.0,
        held_out_before=float("nan"),
        held_out_after=float("nan"),
        parameters={},
        cure=GpsFault.cure,
        where=spans(batches, t0, intervals, axis),
        intervals=tuple(intervals),
    )


def _with_contradicted(
    spells: Sequence[_Spell], contradicted: Sequence[Contradiction], t0: float
) -> list[_Spell]:
    """Both kinds in order of time; what the gate refused right beside one is of the same fault.

    Unless it is off by something else; what undoes the error is a filter that had taken it.
    """
    out = list(spells)
    for c in _until_undone(contradicted):
        start, end = c.start - t0, c.end - t0
        beside = [
            s
            for s in out
            if s.start <= end + LONGEST_FIX_GAP_S and s.end >= start - LONGEST_FIX_GAP_S
        ]
        same = [s for s in beside if not _another(s.off, c.off)]
        gone = [*same, *(s for s in beside if _undoes(s.off, c.off))]
        start = min([start, *(s.start for s in same)])
        end = max([end, *(s.end for s in same)])
        out = [s for s in out if not any(s is x for x in gone)]
        out.append(_Spell(start, end, c.off, c.size, c.off, c.sigma))
    return sorted(out, key=lambda s: s.start)


def _until_undone(contradicted: Sequence[Contradiction]) -> Iterator[Contradiction]:
    """Each; of two of which the second takes the first back, one until the second begins.

    Where a constant error was believed meanwhile, it is the receiver's being right again that
    contradicts what the filter has taken for its velocity.
    """
    left = list(contradicted)
    while left:
        first = left.pop(0)
        if left and left[0].start - first.end < LONGEST_FAULT_S and _undoes(left[0].off, first.off):
            first = replace(first, end=left.pop(0).start)
        yield first


@dataclass(frozen=True, slots=True)
class _Spell:
    """Refused velocities in a row.

    ``off`` (2,) is their median innovation, None where untrusted, ``size`` its median length,
    ``onset`` (2,) the first of it and ``spread`` its scatter, m/s; ``failure`` if it looks like a
    receiver's, ``outlasted`` if the velocities were as far off right after it, ``lost`` if the
    filter began anew before they were right.
    """

    start: float
    end: float
    off: Array | None
    size: float
    onset: Array | None = None
    spread: float = 0.0
    failure: bool = True
    outlasted: bool = False
    lost: bool = False


def _bad(traces: Traces) -> NDArray[np.bool_]:
    """(n,) whether the velocity of each epoch was refused."""
    bad = np.zeros(len(traces), dtype=bool)
    bad[[i for i, names in traces.refused.items() if "velocity" in names]] = True
    return bad


def _innovations(traces: Traces) -> tuple[dict[float, Array], dict[float, Array]]:
    """Those (2,) of refused velocities by their times; and with those taken right beside one."""
    refused = {float(traces.t[i]): by[:2] for i, by in traces.refused_by.items()}
    return refused, {**_heard_beside(traces), **refused}


def _heard_beside(traces: Traces) -> dict[float, Array]:
    """Innovations (2,) of velocities that were taken next to one that was not, by their times.

    The others, which are nearly all, nobody asks for.
    """
    bad = _bad(traces)
    bad[list(traces.refused_by)] = True
    judged = np.flatnonzero((traces.velocities > 0) | bad)
    judged = judged[np.argsort(traces.t[judged], kind="stable")]
    # Two to either side: times of two flights may be the same.
    beside = np.flatnonzero(bad[judged])[:, None] + np.arange(-2, 3)
    near = judged[np.unique(np.clip(beside, 0, len(judged) - 1))]
    near = near[traces.velocities[near] > 0]
    return dict(zip(traces.t[near].tolist(), traces.innovation[near, :2], strict=True))


def _runs(traces: Traces, refused: Mapping[float, Array]) -> Iterator[list[float]]:
    """Times of refused velocities, those together that no gap's length of good ones parts.

    Nor does a run go on when the filter has taken the error for a velocity and is off by another.
    """
    bad_ones = _bad(traces)
    judged = (traces.velocities > 0) | bad_ones
    times = zip(traces.t[judged].tolist(), bad_ones[judged].tolist(), strict=True)
    run: list[float] = []
    taken = False
    for t, bad in [*times, (np.inf, False)]:
        if bad:
            if taken and _another(refused.get(t), refused.get(run[-1])):
                yield run
                run = []
            run.append(t)
            taken = False
        elif run and t - run[-1] > LONGEST_FIX_GAP_S:
            yield run
            run = []
            taken = False
        else:
            taken = bool(run)


def _another(now: Array | None, before: Array | None) -> bool:
    """Whether an error is far from what it was."""
    if now is None or before is None or len(now) != len(before):
        return False
    return float(np.linalg.norm(now - before)) > SAME * float(np.linalg.norm(before))


def _spell(
    run: Sequence[float], seen: Mapping[float, Array], t0: float, least: float, coast_s: float
) -> _Spell:
    """What one run of refused velocities looks like, and what came next."""
    off = [seen[u] for u in run if u in seen]
    mean = np.median(np.array(off), axis=0) if off else None
    after = min((u for u in seen if u > run[-1]), default=None)
    still = after is not None and mean is not None and _along(seen[after], mean) > SAME
    # A noisy receiver errs to all sides: the mean of its errors says nothing.
    sizes = np.linalg.norm(off, axis=1) if off else np.zeros(1)
    size = float(np.median(sizes))
    long = len(run) >= FEWEST_FIXES and run[-1] - run[0] >= MEAN_S
    # A receiver fails at once; what grows from the gate on is a filter that drifts.
    at_once = float(np.median(sizes[:ONSET])) > max(least, SAME * size)
    return _Spell(
        run[0] - t0,
        run[-1] - t0,
        mean,
        size,
        np.median(np.array(off[:ONSET]), axis=0) if off else None,
        float(np.std(sizes)),
        failure=long and size > least and at_once and _steady(off, size),
        outlasted=still,
        # A filter that had to begin anew does not tell its own failure from the receiver's.
        lost=run[-1] - run[0] >= 0.95 * coast_s and mean is not None,
    )


def _earth_axis(offs: Iterable[Array | None]) -> str:
    """The horizontal axis on which the velocity was off most."""
    known = [off for off in offs if off is not None and len(off) > 1]
    return earth_axis(max(known, key=lambda x: float(np.linalg.norm(x)), default=np.zeros(2)))


def earth_axis(off: Array) -> str:
    """The axis on which a horizontal velocity (2,) is larger."""
    return "earth_north" if abs(off[0]) >= abs(off[1]) else "earth_east"


def _steady(off: Sequence[Array], size: float) -> bool:
    """Whether errors are about one error: what turns with the vehicle is the inertia's own."""
    if not off:
        return True
    scatter = np.sqrt(np.mean(np.sum((np.array(off) - np.mean(off, axis=0)) ** 2, axis=1)))
    return bool(scatter < SAME * size)


def _jumps(
    seen: Mapping[float, Array], refused: Mapping[float, Array], t0: float
) -> list[tuple[float, Array]]:
    """Changes (2,) of the innovation from one refused velocity to the next, and when, s.

    After one that was taken the innovation has jumped because the filter has.
    """
    return [
        (b - t0, refused[b] - refused[a])
        for a, b in pairwise(sorted(seen))
        if a in refused and b in refused
        if b - a < LONGEST_FIX_GAP_S and len(refused[a]) == len(refused[b]) == 2
    ]


def _paired(spells: Sequence[_Spell], jumps: Sequence[tuple[float, Array]]) -> list[_Spell]:
    """Failures; one that outlasted the filter's patience is joined with the jump back at its end.

    A constant error that was taken for a new velocity in the middle shows again, with the other
    sign, when the receiver recovers: the fault ends where the second spell starts, or where the
    innovation jumps inside it, and whose failure it was is no question any more.
    """
    out: list[_Spell] = []
    for spell in spells:
        if not spell.failure or (out and spell.start <= out[-1].end):
            continue
        back = [t for t, jump in jumps if t > spell.end and _undoes(jump, spell.off)]
        back += [s.start for s in spells if s.start > spell.end and _undoes(s.onset, spell.off)]
        end = min(back, default=np.inf)
        if spell.outlasted and end - spell.end < LONGEST_FAULT_S:
            out.append(replace(spell, end=end, lost=False))
        else:
            out.append(spell)
    return out


def _along(a: Array, b: Array) -> float:
    """The share of ``b`` that is in ``a``."""
    return float(a @ b) / max(float(b @ b), 1e-12) if len(a) == len(b) else 0.0


def _undoes(jump: Array | None, off: Array | None) -> bool:
    """Whether a jump is about an error taken back."""
    if jump is None or off is None or len(jump) != len(off):
        return False
    size, along = float(off @ off), -float(jump @ off)
    return (
        SAME * size < along < size / SAME and along > SAME * float(np.linalg.norm(jump)) * size**0.5
    )
