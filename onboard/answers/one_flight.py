"""What is said of recordings that were to be explained as one flight and are none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from onboard.answers.answer import Answer
from onboard.answers.recorded import unanswered
from onboard.core.diagnosis.one_flight import Contradiction, Difference
from onboard.core.estimate.merged_record import unknown_six
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.physics.wording import fixed, listed, places


def no_answer(given: Answer, found: Contradiction, names: Sequence[str]) -> Answer:
    """The answer in the place of one that was made of recordings which contradict each other.

    Args:
        given: of all of them as one flight.
        found: which contradict each other, and in what.
        names: of the recordings.
    """
    c = given.calibration
    why = contradicting(found, names)
    in_force = SixParameters(c.in_force_scale, c.in_force_offset)
    made = unanswered(replace(unknown_six(c, in_force), note=why), why)
    return replace(made, diagnosis=replace(made.diagnosis, split=why))


def contradicting(found: Contradiction, names: Sequence[str]) -> str:
    """Which recordings differ in what, in a sentence without its full stop."""
    said = listed([_said(d) for d in found.differences])
    chance = f"chi-square {found.apart.chi_square:.0f} of {found.apart.dof}"
    now, before = names[found.recording], names[found.before]
    return f"{now} and {before} are no one flight, they differ in {said} ({chance})"


def _said(d: Difference) -> str:
    # About a point between the two, which is far from either: to the sigma's first digit no more.
    digits = max(1, min(places(sigma) for _, sigma in (d.now, d.before)) - 1)
    now, before = (fixed(value, digits) for value, _ in (d.now, d.before))
    return f"{d.what} ({now} against {before} {d.unit})"
