"""The numbers that concealed effects leave: errors of scale and offset in their claimed sigmas.

Naming an effect is one thing, six numbers that are right another: wrong ones with small sigmas are
the worst that a calibration can give out.  What is *true* is what the tool's numbers mean:

* an effect on the accelerometer that the model has is counted from where the tool counts it: a
  drift from 35 degC, a ramp from the first sample, what throttle, vibration or load make from
  none of it; of a jump the six are those before it, and those after it are asked as well;
* one that the model has not got is in the six, and in whatever the model has in its place: true
  are the six that bring the force nearest to the real one, over the samples of this flight;
* effects of attitude and receiver change no number.

Simulated gyroscopes have the axes of their accelerometers, so that sigmas are those without what
the stated ones of x and y offset have for a gyroscope that is askew: they would hide all else.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from onboard.answers.advice import advise
from onboard.answers.answer import Answer, judged
from onboard.core.diagnosis.evidence import Judge
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.determined import force_moments
from onboard.core.estimate.result import SIX_NAMES, Status
from onboard.core.maths.accelerometer import linear_of, parameters_jacobian, parameters_of
from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import NodeMaker
from onboard.core.physics.effect import Effect
from onboard.push.plan import PushPlan
from sitl.builtin.effects import BiasRamp, BiasStep, Scene
from sitl.builtin.effects import Effect as Concealed
from sitl.builtin.smoothing import DT
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
    size, places = solution.theta[at], [*range(6), *at]
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


def true_six(judge: Judge, flight: Flight, imu: int, modelled: Collection[str]) -> Array:
    """(6,) what scale and offset of accelerometer ``imu`` should be in the judge's model.

    Args:
        judge: whose model it is, of a flight with a board that lies as the vehicle does.
        flight: what was flown.
        imu: which accelerometer.
        modelled: effects that the model has, by name.
    """
    sensor, spec = flight.spec.imus[imu - 1], flight.spec
    scale, offset = np.array(sensor.scale), np.array(sensor.offset)
    mine = [e for e in spec.effects if getattr(e, "imu", 0) in (0, imu)]
    for ramp in (e for e in mine if isinstance(e, BiasRamp) and e.name in modelled):
        offset = offset + ramp.sizes * judge.final.origin.t0 / scale
    left = [e for e in mine if e.name not in modelled]
    t, f_b, extra = _felt(flight, imu - 1, left)
    if not np.any(extra):
        return np.concatenate([scale, offset])
    there = {e.name for e in mine}
    at, columns = _columns(
        judge, [f for f in judge.final.families if f.is_read and f.effect not in there]
    )
    f_b, extra = (np.column_stack([np.interp(at, t, x) for x in a.T]) for a in (f_b, extra))
    raw = (f_b + extra) / scale + offset
    six = np.concatenate([raw[:, :, None] * np.eye(3), np.tile(np.eye(3), (len(raw), 1, 1))], 2)
    A = np.concatenate([six, columns], axis=2).reshape(3 * len(raw), -1)
    # In another's model what is false may stand for nothing: the least of it then.
    found = np.linalg.lstsq(A, f_b.reshape(-1), rcond=None)[0]
    return parameters_of(found[:6])


def _columns(judge: Judge, families: Sequence[Effect]) -> tuple[Array, Array]:
    """Times (n,) of the samples that were fitted, and regressors (n, 3, k) of families."""
    model, before = judge.engine.model, None
    six = judge.final.solution.theta[:6]
    times, columns = [], []
    for batch in judge.engine.batches:
        before = model.remembering(batch.segment, {} if before is None else before.slow)
        nodes = NodeMaker(before, np.zeros(3), six).signals(before.t[None])
        read = [f.acceleration(nodes) for f in families if f.available(nodes)]
        own = [a[0] for a in read if a is not None]
        times.append(before.t)
        columns.append(np.concatenate([np.zeros((len(before.t), 3, 0)), *own], axis=2))
    return np.concatenate(times), np.concatenate(columns)


def _felt(flight: Flight, index: int, effects: Sequence[Concealed]) -> tuple[Array, Array, Array]:
    """Times (n,) in flight, (n, 3) the true force, and what effects make of it."""
    times, forces, extras = [], [], []
    for piece in flight.pieces:
        if piece.flight is None:
            continue
        imu, n = piece.imus[index], piece.trajectory.n
        t: Array = piece.start + DT * np.arange(n, dtype=np.float64)
        scene = Scene(
            f_b=piece.trajectory.f_b,
            elapsed=t,
            temperature=imu.temperature,
            level=imu.vibration,
            trajectory=piece.trajectory,
        )
        added = [e.reads_too_much(scene) for e in effects]
        extra = np.sum([a for a in added if a is not None] or [np.zeros((n, 3))], axis=0)
        times.append(t)
        forces.append(scene.f_b)
        extras.append(extra)
    return np.concatenate(times), np.vstack(forces), np.vstack(extras)


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
