"""The numbers that concealed effects leave: errors of scale and offset in their claimed sigmas.

Naming an effect is one thing, six numbers that are right another: wrong ones with small sigmas are
the worst that a calibration can give out.  True is what they mean
(:mod:`benchmarks.true_numbers`).

Simulated gyroscopes have the axes of their accelerometers, so that sigmas are those without what
the stated ones of x and y offset have for a gyroscope that is askew: they would hide all else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from benchmarks.true_numbers import true_six
from onboard.answers.advice import advise
from onboard.answers.answer import Answer, judged
from onboard.core.diagnosis.evidence import Judge
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.determined import force_moments
from onboard.core.estimate.result import SIX_NAMES, Status
from onboard.core.maths.accelerometer import linear_of, parameters_jacobian
from onboard.core.maths.arrays import Array
from onboard.push.plan import PushPlan
from sitl.builtin.effects import BiasStep
from sitl.recording import Flight

FAR: Final = 3.0
"""Sigmas that chance exceeds once in 370 numbers [probability]."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """Six numbers that were given out, against the true ones.

    Attributes:
        imu: which accelerometer.
        error: (6,) scale (1) and offset (m/s^2), in the order of SIX_NAMES.
        covariance: (6, 6) that is claimed for it.
        calibrated: whether it is called a calibration.
        offered: whether it would be set, by itself or by a person's leave.
        modelled: the effects that the model has, by name.
        after: whether these are the numbers after a jump.
        force: error of the force over the flight, RMS, m/s^2: with what was in force, as it would
            be set, and expected of that.
        refused: why it is not set, by the names of the objections.
    """

    imu: int
    error: Array
    covariance: Array
    calibrated: bool
    offered: bool
    modelled: tuple[str, ...]
    after: bool = False
    force: tuple[float, float, float] = (math.nan,) * 3
    refused: tuple[str, ...] = ()

    @property
    def sigmas(self) -> Array:
        """(6,) errors in units of the claimed sigmas."""
        out: Array = self.error / np.sqrt(np.diag(self.covariance))
        return out

    @property
    def far(self) -> int:
        """How many numbers are past three sigma."""
        return int(np.sum(~(np.abs(self.sigmas) <= FAR)))

    @property
    def chi_square(self) -> float:
        """Of all six."""
        return float(self.error @ np.linalg.solve(self.covariance, self.error))


def numbers(judge: Judge, said: Diagnosis, calibrator: Calibrator, flight: Flight) -> list[Numbers]:
    """All numbers of one accelerometer's answer, scored.

    Args:
        judge: who has made the diagnosis.
        said: the diagnosis.
        calibrator: has heard the flight.
        flight: what was flown.
    """
    given = judged(said, calibrator.parameters.values)
    names = tuple(r.name.removeprefix("+ ") for r in said.ladder)
    true = true_six(judge, flight, said.imu, names)
    c = given.calibration
    value = np.array((*c.scale, *c.offset))
    advice = advise((given,), calibrator.parameters.values)[0]
    first = Numbers(
        imu=c.imu,
        error=value - true,
        covariance=c.with_its_gyroscope,
        calibrated=c.status is Status.CALIBRATED,
        offered=advice.settable or given.modelled,
        modelled=names,
        force=_force(given, true, advice.plan),
        refused=tuple(r.objection.value for r in advice.refusals),
    )
    return [first, *_after(judge, first, value, flight)]


def _after(judge: Judge, first: Numbers, value: Array, flight: Flight) -> Iterator[Numbers]:
    """The six after a jump of the offset that was found and is there, from the same sums."""
    jumps = [e for e in flight.spec.effects if isinstance(e, BiasStep)]
    families = [f for f in judge.final.families if f.effect == BiasStep.name]
    if len(jumps) != 1 or len(families) != 1:
        return
    solution = judge.final.solution
    at = judge.engine.indices(families[0])
    size, places = judge.engine.model.whole(solution.theta)[at], [*range(6), *at]
    # What is read too much is taken off, as beta is added.
    later = linear_of(value) - np.concatenate([np.zeros(3), size])
    G = parameters_jacobian(later) @ np.hstack([np.eye(6), -np.eye(6)[:, 3:]])
    J = parameters_jacobian(linear_of(value))
    own = J @ solution.covariance[:6, :6] @ J.T
    C = G @ solution.covariance[np.ix_(places, places)] @ G.T
    error = first.error.copy()
    error[3:] += (size - jumps[0].sizes) / value[:3]
    # Of neither are the floor and what the gyroscope leaves open, which the first has.
    yield replace(first, error=error, covariance=C + first.covariance - own, after=True)


def _force(given: Answer, true: Array, plan: PushPlan | None) -> tuple[float, float, float]:
    """Error of the force over the flight, RMS, m/s^2: in force, as set, and expected of that."""
    if plan is None or plan.worth is None:
        return (float("nan"),) * 3
    c, before = given.calibration, np.array(list(plan.before.values()))
    M = force_moments(c.load_mean, c.load_square, before)

    def error(six: Array) -> float:
        return float(np.sqrt((six - true) @ M @ (six - true)))

    return error(before), error(np.array(list(plan.wanted.values()))), plan.worth.error_after


NUMBERS_HEAD = (
    f"| {'concealed':26} | numbers | past 3 | largest | chi-square | calibrated | past 3 "
    "| offered | past 3 | force | worse |"
)
NUMBERS_LEGEND = """\
numbers: of a jump those before it and those after it.  past 3: further off than three of their
claimed sigmas.  chi-square: mean of that of six, over six.  calibrated, offered: answers that are,
and how many of their numbers are past three sigma; what is offered would be set, by itself or by a
person's leave.  force: largest error of the force with what is offered, over what is expected of
it.  worse: offers that make the force worse than what was in force."""


def numbers_row(label: str, every: Sequence[Numbers]) -> str:
    """One line of the table."""
    offered, calibrated = ([n for n in every if n.offered], [n for n in every if n.calibrated])
    forces = np.array([n.force for n in offered]).reshape(-1, 3)
    cells = [
        f"{label:26}",
        f"{6 * len(every):7}",
        f"{sum(n.far for n in every):6}",
        f"{max(float(np.max(np.abs(n.sigmas))) for n in every):7.1f}",
        f"{np.mean([n.chi_square for n in every]) / 6.0:10.2f}",
        f"{len(calibrated):10}",
        f"{sum(n.far for n in calibrated):6}",
        f"{len(offered):7}",
        f"{sum(n.far for n in offered):6}",
        f"{np.max(forces[:, 1] / forces[:, 2]):5.1f}" if offered else " " * 5,
        f"{np.sum(forces[:, 1] > forces[:, 0]):5}",
    ]
    return f"| {' | '.join(cells)} |"


def far_in_words(n: Numbers) -> str:
    """Which numbers of an answer are off, for whoever looks for the cause."""
    off = ", ".join(f"{k} {s:+.1f}" for k, s in zip(SIX_NAMES, n.sigmas, strict=True))
    what = "offered" if n.offered else "calibrated" if n.calibrated else "not calibrated"
    return f"{'after the jump, ' if n.after else ''}{what}: {off}; chi-square {n.chi_square:.1f}"
