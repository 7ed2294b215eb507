"""Velocities that contradict dead reckoning: the receiver's fault, or the accelerometer's jump.

After a jump of its offset, dead reckoning runs away from a receiver that is right, and a gate
refuses one velocity after the other.  So both are tried on the same measurements: each refused one
may be anything at all, which has its price in likelihood; a jump has three unknowns.  If it was a
jump, velocities that others have refused in flight are true: what is refused of them counts, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.block_jumps import settled_from
from onboard.core.diagnosis.examination import VELOCITY, Examination
from onboard.core.diagnosis.jumps import jump_near, reach_of_blocks
from onboard.core.diagnosis.limits import CLEARLY, JUMP_SHARE
from onboard.core.diagnosis.refusals import Refused as Doubted
from onboard.core.filter.refused import Refused
from onboard.core.inputs.segments import Batch
from onboard.core.physics.finding import Finding


def refused_beside_a_jump(
    full: Examination, fault: Finding, t0: float, doubted: Sequence[Doubted] = ()
) -> Refused | None:
    """What is still refused if the accelerometer has jumped where a fault seems to begin.

    Args:
        full: the flight with every column, its sums made.
        fault: velocities that seem to be false.
        t0: s on the boot clock, from which its intervals count.
        doubted: where others doubted a receiver that had a fix.

    Returns:
        None if it is rather a fault: beside a jump most of it is refused as before, or all in all
        the flight is not clearly likelier.
    """
    start = fault.intervals[0][0] + t0
    if start < settled_from(full.blocks):
        return None
    inside = _stamps(full, full.batches, fault, t0)
    faulty = Refused([*((t, VELOCITY[0]) for t in inside), *full.refused_velocities().items()])
    as_fault = full.beside((), faulty).with_rows()
    as_fault.let_epochs_go()
    jump = jump_near(full, (), start, reach_of_blocks(full))
    as_jump = full.beside((jump,)).with_rows()
    as_jump.let_epochs_go()
    if as_jump.log_likelihood - as_fault.log_likelihood <= CLEARLY / 2.0:
        return None
    still, were = _refused(as_jump), _refused(as_fault)
    batches = heard(full.batches, doubted)
    if doubted:
        all_of_it = _stamps(full, batches, fault, t0)
        still = _refused(full.beside((jump,), batches=batches).with_rows())
        were += len(all_of_it) - len(inside)
    return as_jump.refused_velocities() if still < JUMP_SHARE * were else None


def _refused(made: Examination) -> int:
    return sum(made.refused[name] for name in VELOCITY)


def heard(batches: Sequence[Batch], doubted: Sequence[Doubted]) -> list[Batch]:
    """The flight with the velocities believed that others doubted (stamps, s on the boot clock)."""
    out = []
    for batch in batches:
        t = batch.fixes.t
        within = np.zeros(len(t), dtype=bool)
        for span in doubted:
            within |= (t >= span.start) & (t <= span.end)
        within &= np.all(np.isfinite(batch.fixes.v_n[:, :2]), axis=1)
        out.append(replace(batch, trusted=batch.trusted | within))
    return out


def _stamps(full: Examination, batches: Sequence[Batch], fault: Finding, t0: float) -> list[float]:
    """Those of velocities in the fault's intervals."""
    stamps: list[float] = []
    for batch in batches:
        t = full.point.true_time(batch.fixes.t) - t0
        inside = np.any([(t >= a) & (t <= b) for a, b in fault.intervals], axis=0)
        stamps += batch.fixes.t[inside & batch.trusted].tolist()
    return stamps
