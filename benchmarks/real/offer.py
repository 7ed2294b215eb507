"""What ``onboard replay`` offers to set after one real flight of one accelerometer."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.answers.advice import advise
from onboard.answers.answer import Answer

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Offer:
    """The six as they would be set, and what that is worth by the flight's own account.

    Attributes:
        six: (6,) scale and offset after setting what is offered, in force elsewhere; as in force
            if nothing is.
        numbers: of the six, how many would be set.
        change: of the force over the flight, root mean square, m/s^2.
        before: expected error of that force, m/s^2.
        after: with the six of the plan.
        probability: that it becomes less.
        gain: log-likelihood of flight not used in the fit.
        objections: names of what speaks against it; offered if nothing does.
    """

    six: Array
    numbers: int
    change: float
    before: float
    after: float
    probability: float
    gain: float
    objections: tuple[str, ...]

    @property
    def offered(self) -> bool:
        """Whether a person is told to set it."""
        return not self.objections


def offer_of(given: Answer, parameters: Mapping[str, float]) -> Offer:
    """What is offered of one answer, by the policy's defaults."""
    (advice,) = advise([given], parameters)
    c, nan = given.calibration, float("nan")
    in_force = np.array(c.in_force_scale + c.in_force_offset)
    objections = tuple(dict.fromkeys(r.objection.value for r in advice.refusals))
    if advice.plan is None or advice.plan.worth is None:
        return Offer(in_force, 0, nan, nan, nan, nan, nan, objections or ("no plan",))
    plan, worth = advice.plan, advice.plan.worth
    set_to = plan.six_wanted().as_vector() if not objections else in_force
    return Offer(
        six=set_to,
        numbers=sum(not change.kept for change in plan.changes),
        change=worth.change,
        before=worth.error_before,
        after=worth.error_after,
        probability=worth.probability,
        gain=c.predictive_gain,
        objections=objections,
    )
