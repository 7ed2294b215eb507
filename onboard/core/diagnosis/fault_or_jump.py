"""Velocities that contradict dead reckoning: the receiver's fault, or the accelerometer's jump.

After a jump of its offset, dead reckoning runs away from a receiver that is right, and a gate
refuses one velocity after the other.  So both are tried on the same measurements, and both at once:
each refused one may be anything at all, or all of them are off by one error; a jump has three
unknowns.  If it was a jump, velocities that others have refused in flight are true: whether there
is a fault beside it is asked of them, too.
"""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.diagnosis.block_jumps import settled_from
from onboard.core.diagnosis.examination import Examination
from onboard.core.diagnosis.false_velocity import AsFault, as_fault, heard, sized
from onboard.core.diagnosis.jumps import jump_near, reach_of_blocks
from onboard.core.diagnosis.limits import CLEARLY
from onboard.core.diagnosis.refusals import Refused as Doubted
from onboard.core.filter.refused import Refused
from onboard.core.inputs.segments import Batch
from onboard.core.physics.effects.bias_step import BiasStep
from onboard.core.physics.finding import Finding


def fault_or_jump(
    full: Examination,
    fault: Finding,
    t0: float,
    doubted: Sequence[Doubted] = (),
    *,
    sure: bool,
) -> Finding | Refused | None:
    """A fault, or what is still refused if the accelerometer has jumped where it seems to begin.

    Args:
        full: the flight with every column, its sums made.
        fault: velocities that seem to be false.
        t0: s on the boot clock, from which its intervals count.
        doubted: where others doubted a receiver that had a fix.
        sure: whether there is something that gates alone do not keep out; else the flight must be
            clearly likelier with the fault.

    Returns:
        The fault with its size; refused velocities, if a jump instead of it is clearly likelier,
        and a fault beside the jump is not; None if there need be neither.
    """
    made = as_fault(full, fault.intervals, t0, full.batches)
    if not sure and not _needed(full, made):
        return None
    every = heard(full.batches, doubted)
    start = fault.intervals[0][0] + t0
    if start >= settled_from(full.blocks):
        jump = jump_near(full, (), start, reach_of_blocks(full))
        alone = _jumped(full, jump, full.batches)
        if _clearly(alone.log_likelihood, made.log_likelihood):
            asked = _jumped(full, jump, every) if doubted else alone
            made = as_fault(asked, fault.intervals, t0, every)
            if not _clearly(made.log_likelihood, asked.log_likelihood):
                return alone.refused_velocities() if sure else None
            return sized(fault, made, t0)
    return sized(fault, as_fault(full, fault.intervals, t0, every) if doubted else made, t0)


def _jumped(full: Examination, jump: BiasStep, batches: Sequence[Batch]) -> Examination:
    """The flight with a jump."""
    made = full.beside((jump,), batches=batches).with_rows()
    made.let_epochs_go()
    return made


def _needed(full: Examination, made: AsFault) -> bool:
    """Whether errors of the receiver explain what gates alone do not, and are no chance."""
    without = full.beside(()).with_rows()
    without.let_epochs_go()
    return bool(made.errors()) and _clearly(made.one.log_likelihood, without.log_likelihood)


def _clearly(more: float, less: float) -> bool:
    """Whether a log-likelihood is clearly larger than another one."""
    return more - less > CLEARLY / 2.0
