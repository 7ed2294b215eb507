"""Answers for the accelerometers of one vehicle, each with what the others add to it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from onboard.answers.answer import Answer
from onboard.core.estimate.calibration_status import good_enough
from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.observability import Needs
from onboard.core.estimate.result import Calibration, Status
from onboard.core.estimate.with_others import with_others
from onboard.core.physics.catalogue import adds_to_force, bearing_of
from onboard.core.physics.effect import Bearing
from onboard.core.physics.wording import listed


def together(
    answers: Sequence[Answer], comparison: Comparison | None, needs: Needs
) -> tuple[Answer, ...]:
    """The answers, their status by all that the vehicle's accelerometers know.

    Args:
        answers: of each by itself.
        comparison: of all of them; None if there is none.
        needs: how well a force has to be known.
    """
    if comparison is None:
        return tuple(answers)
    known = with_others([a.calibration for a in answers if takes_part(a)], comparison)
    return tuple(
        replace(a, diagnosis=replace(a.diagnosis, calibration=judged(known[a.imu], needs)))
        if a.imu in known
        else a
        for a in answers
    )


def takes_part(a: Answer) -> bool:
    """Whether the six of an accelerometer are all that is wrong with what it reads."""
    counted = (f.given for f in a.flights if f.counted and f.given is not None)
    effects = [e.name for given in (a, *counted) for e in given.diagnosis.effects]
    return six_are_all(a.calibration, a.missing, effects)


def six_are_all(c: Calibration, missing: str, effects: Collection[str]) -> bool:
    """The same of what is kept of an answer.

    What is in every calibration, an offset that wanders about its mean, changes no six.

    Args:
        c: its calibration.
        missing: why it must not be written, in words; empty if nothing forbids it.
        effects: names of what was found.
    """
    apart = [e for e in effects if adds_to_force(e) and bearing_of(e) is not Bearing.HARMLESS]
    return c.believed and not missing and not apart


def judged(c: Calibration, needs: Needs) -> Calibration:
    """A calibration with the status that it deserves by what all accelerometers know."""
    done = good_enough(c, needs)
    if c.together is None or done is (c.status is Status.CALIBRATED):
        return c
    who = named([imu for imu in c.together.imus if imu != c.imu])
    if not done:
        note = f"beside what {who} knew, what this one asks for is not sure to be better"
        return replace(c, status=Status.INSUFFICIENT, note=f"{note}. {c.note}".rstrip())
    note = f"by itself it is not sure enough, with what {who} felt in the same flight it is"
    return replace(c, status=Status.CALIBRATED, note=f"{note}. {c.note}".rstrip())


def named(imus: Sequence[int]) -> str:
    """``accelerometer 2``; ``accelerometers 2 and 3``."""
    return f"accelerometer{'s' if len(imus) > 1 else ''} {listed([str(n) for n in imus])}"
