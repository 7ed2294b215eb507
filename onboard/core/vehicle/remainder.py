"""What no effect describes: blocks of flight whose remainder is beyond chance, and matters.

A fit leaves out steps that are far from its model, and one number over a whole flight hides what
lasts ten seconds.  So the finished model is asked about every block, those that it left out too.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from onboard.core.inputs.limits import GROUND_M, STILL_M_S
from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.chi_square import survival
from onboard.core.maths.spans import following, joined
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import (
    FALSE_ALARM,
    MARGIN_S,
    OUTLYING,
    TOLD_S,
)
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import rms, whitened
from onboard.core.vehicle.places import AXES
from onboard.core.vehicle.windows import windows_of

FORCES = (0, 1, 2)
MOST_TOLD = 3
"""Spans that a sentence names [use]."""


@dataclass(frozen=True, slots=True)
class Remainder:
    """A span with more than chance: s since the start, body axis, and RMS of it, m/s^2.

    ``part`` is the number of the recording, of several.
    """

    start_s: float
    end_s: float
    axis: str
    force: float
    part: int = 0


def remainders(whole: ForceModel, fit: Fit) -> tuple[Remainder, ...]:
    """Spans of the whole flight that the fit describes worse than chance and gusts would have it.

    In a span the whitened squares of a block are rarer than :data:`FALSE_ALARM` among all blocks,
    by the scatter that blocks usually have, and what is left is more than errors of the velocity
    and the heading would make.

    Args:
        whole: the model with the whole flight, also what the fit left out.
        fit: of it.
    """
    flight = whole.flight
    windows = windows_of(flight)
    residual = windows.mean(whole.measured() - whole.predicted(fit.theta))
    sensitivity = windows.mean(whole.sensitivity(fit.theta))
    unclear = windows.mean(whole.unclear(fit.theta))
    t, part = flight.since_start[windows.first], flight.part[windows.first]
    block = flight.blocks_of(flight.t[windows.first])
    numbers = np.unique(block)
    flying = ~near_ground(flight)[windows.first]
    residual = residual * flying[:, None]
    found: list[Remainder] = []
    for k, axis in enumerate(whole.axes):
        if axis not in FORCES:
            continue
        # Contact with the ground is no effect that was overlooked.
        e = (
            flying
            * whitened(
                residual[:, k, None],
                fit.noise[k],
                sensitivity[:, k],
                windows.piece,
                windows.length_s,
            )[:, 0]
        )
        rows = np.array([np.count_nonzero(block == b) for b in numbers])
        energy = np.array([float(np.sum(e[block == b] ** 2)) for b in numbers])
        usual, share = _scatter(energy / rows, rows)
        level = FALSE_ALARM / (len(numbers) * len(whole.axes))
        for b, count, its in zip(numbers.tolist(), rows.tolist(), energy.tolist(), strict=True):
            mine = block == b
            force = rms(residual[mine, k])
            matters = force > rms(unclear[mine, k])
            dof = max(round(share * count), 1)
            if matters and survival(dof * its / (usual * count), dof) < level:
                start, end = float(t[mine][0]), float(t[mine][-1]) + windows.length_s
                found.append(Remainder(start, end, AXES[axis], force, int(part[mine][0])))
    return _joined(found)


def not_used(whole: ForceModel, fit: Fit, kept: Mask, gusts: float) -> tuple[Remainder, ...]:
    """Spans that the fit left out, and that neither errors of the motion nor gusts make.

    A fit leaves out what is far from it by the scatter of the whole flight.  Gusts are felt more
    where a vehicle is fast, so that a span is only of the air if gusts as large as those of the
    flight would be as rarely so far off there as a step that is left out: past :data:`OUTLYING`.

    Args:
        whole: the model with the whole flight.
        fit: of what was not left out.
        kept: (n,) steps that it used.
        gusts: RMS that they may have, m/s.
    """
    flight = whole.flight
    out = ~kept & ~near_ground(flight)
    residual = whole.measured() - whole.predicted(fit.theta)
    bound = np.hypot(whole.unclear(fit.theta), OUTLYING * gusts * whole.sensitivity(fit.theta))
    t, found = flight.since_start, []
    edges = (np.diff(t[out]) > TOLD_S) | (np.diff(flight.part[out]) != 0)
    for span in np.split(np.flatnonzero(out), np.flatnonzero(edges) + 1):
        if len(span) * flight.step_s < TOLD_S:
            continue
        ends = float(t[span[0]]), float(t[span[-1]]) + flight.step_s
        for k, axis in enumerate(whole.axes):
            force = rms(residual[span, k])
            if axis in FORCES and force > rms(bound[span, k]):
                found.append(Remainder(*ends, AXES[axis], force, int(flight.part[span[0]])))
    return tuple(found)


def share_of(found: Sequence[Remainder], flight: Flight) -> float:
    """Share of a flight that is in one of these spans at least."""
    t, inside = flight.since_start, np.zeros(len(flight), dtype=bool)
    for r in found:
        inside |= (flight.part == r.part) & (t >= r.start_s) & (t <= r.end_s)
    return float(np.mean(inside))


def near_ground(flight: Flight) -> Mask:
    """(n,) steps within :data:`MARGIN_S` of where the vehicle may have touched the ground.

    Where it was as low as that, or neither climbed nor sank before it first did and after it last
    did: such a stretch cannot be told from one that stands or rolls.
    """
    touching = (flight.height < flight.ground + GROUND_M) & flight.ground_seen
    moving = np.flatnonzero(np.abs(flight.v_n[:, 2]) > STILL_M_S)
    if len(moving):
        touching[: moving[0]] = True
        touching[moving[-1] + 1 :] = True
    low = flight.t[touching]
    if not len(low):
        return np.zeros(len(flight), dtype=bool)
    at = np.searchsorted(low, flight.t)
    before = np.abs(flight.t - low[np.maximum(at - 1, 0)])
    after = np.abs(flight.t - low[np.minimum(at, len(low) - 1)])
    out: Mask = np.minimum(before, after) <= MARGIN_S
    return out


def left_out(flight: Flight, kept: Mask) -> tuple[tuple[float, float], ...]:
    """Spans (s since the start) of steps that are not kept (n,), as long as is worth telling.

    Of several recordings, the first is told of.
    """
    lost = (flight.t[~kept & (flight.part == 0)] - flight.t[0]).tolist()
    return tuple((a, b) for a, b in joined([(t, t) for t in lost], TOLD_S) if b - a >= TOLD_S)


def remainder_sentence(found: tuple[Remainder, ...], share: float) -> str:
    """What a person is told of them, which are such a share of it; empty where there are none."""
    if not found:
        return ""
    worst = sorted(found, key=lambda r: -r.force * (r.end_s - r.start_s))
    said = [
        f"{r.start_s:.0f}-{r.end_s:.0f} s{_of(r)} ({r.axis}, {r.force:.2f} m/s^2)"
        for r in sorted(worst[:MOST_TOLD], key=lambda r: (r.part, r.start_s))
    ]
    more = f" and {len(worst) - MOST_TOLD} more" if len(worst) > MOST_TOLD else ""
    percent = f"{100.0 * share:.0f} %" if share >= 0.01 else "less than 1 %"
    return (
        f"no effect describes the force at {', '.join(said)}{more}: {percent} of the flight is not "
        "explained"
    )


def _of(r: Remainder) -> str:
    return f" of flight {r.part + 1}" if r.part else ""


def left_out_sentence(spans: tuple[tuple[float, float], ...]) -> str:
    """What a person is told of spans that no fit used; empty where there are none."""
    if not spans:
        return ""
    longest = sorted(sorted(spans, key=lambda s: s[0] - s[1])[:MOST_TOLD])
    said = ", ".join(f"{a:.0f}-{b:.0f} s" for a, b in longest)
    more = f" and {len(spans) - MOST_TOLD} shorter spans" if len(spans) > MOST_TOLD else ""
    return f"not used, too far from the model: {said}{more}"


def _joined(found: Sequence[Remainder]) -> tuple[Remainder, ...]:
    """Neighbouring blocks of one axis as one span."""
    out: list[Remainder] = []
    for axis, part in dict.fromkeys((r.axis, r.part) for r in found):
        its = [r for r in found if (r.axis, r.part) == (axis, part)]
        for run in following([(r.start_s, r.end_s) for r in its], TOLD_S):
            blocks = [its[k] for k in run]
            seconds = [r.end_s - r.start_s for r in blocks]
            square = np.average([r.force**2 for r in blocks], weights=seconds)
            force = math.sqrt(float(square))
            out.append(Remainder(blocks[0].start_s, blocks[-1].end_s, axis, force, part))
    return tuple(out)


def _scatter(ratio: Array, rows: Array) -> tuple[float, float]:
    """What blocks' mean squares (b,) usually are, and which share of their rows is independent.

    Means of independent squares scatter by ``sqrt(2 / rows)``; those of gusty air by more.
    """
    usual = max(float(np.median(ratio)), 1.0)
    logarithm = np.log(np.maximum(ratio, 1e-9))
    spread = 1.4826 * float(np.median(np.abs(logarithm - np.median(logarithm))))
    expected = math.sqrt(2.0 / float(np.median(rows)))
    return usual, min(1.0, (expected / max(spread, 1e-9)) ** 2)
