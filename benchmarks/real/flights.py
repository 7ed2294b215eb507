"""One real flight through the diagnosis, once for each accelerometer: what every part asks."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.beside import NOTHING, Beside, beside
from benchmarks.real.offer import Offer, offer_of
from benchmarks.real.split import RealFlight
from benchmarks.real.whiteness import Whiteness, whiteness
from onboard.answers.answer import Answer
from onboard.answers.answer import judged as answered
from onboard.answers.recorded import KEEPING_ALL, Recorded
from onboard.answers.together import together
from onboard.core.diagnosis.evidence import Judge
from onboard.core.diagnosis.procedure import examine
from onboard.core.estimate.comparison import compare
from onboard.core.estimate.dead_reckoning import Chain, intervals
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.mean_force import in_the_mean
from onboard.core.estimate.result import Calibration
from onboard.core.estimate.solution import Solution
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import STATED
from onboard.core.filter.traces import EpochState
from onboard.core.inputs.reach import NEAR
from onboard.core.inputs.samples import FIX_3D, GpsFix, ImuSample, Sample
from onboard.core.inputs.segments import Batch
from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.blocks import total
from onboard.core.model.linearisation import Linearisation
from onboard.recordings.opening import open_recording

Array = NDArray[np.float64]

MOVING_M_S = 0.5
"""Faster than this a vehicle is in the air: a receiver at rest wanders slower."""
AT_LIMIT = 0.01
"""A level is at an end within this share of it."""
FLOORLESS = frozenset({"vertical", "heading_time"})
"""Levels whose lower end is a lowest value, not what no flight is without."""
NO_ENDS = frozenset({*STATED, "usually_stated"})
"""Powers, of which none at all is an answer, and what they are of."""


STANDS_S = 2.0
"""Stretches in which it is asked whether a vehicle stands, s."""
FEWEST_STANDS, FEWEST_STANDING = 3, 10
"""Of such stretches, and of samples in each."""
STANDING_M_S2, STANDING_RAD_S = 0.06, 0.01
"""Scatter of force and rates of a sensor at rest: a few times a data sheet's; of one whose motors
run, or that somebody carries, it is ten times as much."""
NO_CHAIN = intervals((), Linearisation())


@dataclass(frozen=True, slots=True)
class Fit:
    """One accelerometer of one flight, estimated by itself.

    Attributes:
        flight: its name.
        vehicle: whose.
        imu: accelerometer.
        status: of the answer, ``failed`` if there is none; then all below is empty.
        moved: whether the flight went anywhere: a hover excites nothing.
        verdict: of the diagnosis.
        effects: names that were said.
        in_force: (6,) scale and offset with which it was recorded.
        estimate: (6,) scale and offset.
        covariance: (6, 6) of it.
        gyro_sigma: (6,) what of their sigmas comes from the gyroscope's axes.
        linear: (6,) the same as scale and beta, with the prior in it.
        linear_covariance: (6, 6) of that.
        prior: (6,) centre of the prior, scale and beta.
        prior_sigma: (6,) of it.
        force: (3,) mean of the force in the air with the parameters in force, sensor axes.
        beside: what the effects that were said add to it.
        levels: noise levels by name.
        inflation: of the variance, in the direction in which it is largest.
        numbers_inflation: of the variances of the six numbers, in the mean.
        window: averaging span of the receiver, s; ``window_asked`` without its limit.
        epochs: how many, ``believed`` how many were to be used.
        refused: epochs that each gate refused, by name.
        white: of the whitened residuals, by kind.
        batches: the flight itself.
        chain: integrals between epochs.
        states: filter states at epochs.
        beside: what the effects that were said add to the force.
        whole: the calibration in the mean of the flight, as accelerometers are compared; None if
            there is none.
        rest: (3,) the force on the ground with the parameters in force, sensor axes, m/s^2; NaN
            where the vehicle was not seen standing.
        given: its answer by itself, with the ``parameters`` of its recording.
        offer: what a person is told to set; None if there is no estimate.
    """

    flight: str
    vehicle: str
    imu: int
    status: str
    moved: bool
    verdict: str
    effects: tuple[str, ...]
    in_force: Array
    estimate: Array
    covariance: Array
    gyro_sigma: Array
    linear: Array
    linear_covariance: Array
    prior: Array
    prior_sigma: Array
    force: Array
    levels: dict[str, float]
    inflation: float
    numbers_inflation: float
    window: float
    window_asked: float
    epochs: int
    believed: int
    refused: dict[str, int]
    white: tuple[Whiteness, ...]
    batches: tuple[Batch, ...] = ()
    chain: Chain = NO_CHAIN
    states: tuple[EpochState, ...] = ()
    beside: Beside = NOTHING
    whole: Calibration | None = None
    rest: Array = field(default_factory=lambda: np.full(3, np.nan))
    given: Answer | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    offer: Offer | None = None

    @property
    def failed(self) -> bool:
        """Whether there is no estimate."""
        return self.status == "failed"

    @property
    def at_limit(self) -> tuple[str, ...]:
        """Names of the levels at a limit, with ``-`` at the lower and ``+`` at the upper end."""
        return tuple(
            f"{name}{'+' if high else '-'}"
            for name, high in self._at_ends()
            if high or name in FLOORLESS
        )

    @property
    def at_floor(self) -> tuple[str, ...]:
        """Names of the levels that are their floor: the flight asks for no more."""
        return tuple(n for n, high in self._at_ends() if not high and n not in FLOORLESS)

    def _at_ends(self) -> Iterator[tuple[str, bool]]:
        for name, level in self.levels.items():
            if name in NO_ENDS:
                continue
            low, high = LIMITS[name]
            if level <= low * (1.0 + AT_LIMIT) or level >= high * (1.0 - AT_LIMIT):
                yield name, level >= high * (1.0 - AT_LIMIT)

    @property
    def clipped(self) -> bool:
        """Whether the averaging span is at its limit."""
        return self.window >= NEAR.longest_window * (1.0 - AT_LIMIT)


def fit(flight: RealFlight, imu: int) -> Fit:
    """One accelerometer of one flight."""
    told(f"{flight.name}, accelerometer {imu}")
    return fitted(flight, imu, list(open_recording(flight.path).samples()))


def told(what: str) -> None:
    """Progress, for whoever waits; results go to standard output."""
    print(f"  {what}", file=sys.stderr, flush=True)


def fitted(flight: RealFlight, imu: int, samples: Sequence[Sample]) -> Fit:
    """The same of samples that were read before."""
    recorded = heard(samples, imu)
    try:
        judge = examine(recorded.calibrator, imu)
        diagnosis = judge.diagnosis()
    except (ArithmeticError, LookupError, ValueError) as error:
        return _failed(flight, imu, str(error))
    given = answered(diagnosis)
    engine, c = judge.engine, given.calibration
    solution = engine.found()
    square = engine.model.index["window_squared"]
    asked = engine.point.window**2 + float(solution.theta[square])
    six = SixParameters(c.in_force_scale, c.in_force_offset)
    return Fit(
        flight=flight.name,
        vehicle=flight.vehicle,
        imu=imu,
        status=c.status.value,
        moved=engine.moving,
        verdict=diagnosis.verdict.value,
        effects=tuple(e.name for e in diagnosis.effects),
        in_force=six.as_vector(),
        estimate=np.array(c.scale + c.offset),
        covariance=np.array(c.covariance),
        gyro_sigma=np.array(c.gyro_sigma),
        linear=solution.theta[:6].copy(),
        linear_covariance=solution.covariance[:6, :6].copy(),
        prior=engine.model.prior[:6].copy(),
        prior_sigma=engine.model.prior_sigma[:6].copy(),
        force=recorded.calibrator.parameters.R_bs.T @ moving_force(samples, imu, flight.ends_s),
        levels=asdict(engine.noise),
        inflation=solution.variance_inflation,
        numbers_inflation=_numbers_inflation(engine, solution),
        window=engine.point.window,
        window_asked=float(np.sqrt(max(asked, 0.0))),
        epochs=len(engine.traces),
        believed=judge.evidence.believed,
        refused=dict(engine.refused),
        white=whiteness(engine.whitened(), solution.theta),
        batches=tuple(engine.batches),
        chain=intervals([(b.segment, b.fixes) for b in engine.batches], engine.point),
        states=tuple(engine.states),
        beside=beside(engine, MOVING_M_S, flight.ends_s),
        whole=in_the_mean(c, engine),
        rest=recorded.calibrator.parameters.R_bs.T @ resting_force(samples, imu),
        given=given,
        parameters=dict(recorded.calibrator.parameters.values),
        offer=offer_of(given, recorded.calibrator.parameters.values),
    )


def _numbers_inflation(engine: Engine, solution: Solution) -> float:
    """Claimed variances of the six over those that the sums and the prior alone would have."""
    sums, prior = total(engine.all_blocks), np.diag(engine.model.prior_sigma**-2.0)
    plain = np.diag(np.linalg.inv(sums.signal + prior))[:6]
    return float(np.mean(np.diag(solution.covariance)[:6] / plain))


def heard(samples: Iterable[Sample], imu: int) -> Recorded:
    """The samples as ``replay`` and ``explain`` read them, for one accelerometer."""
    made = Recorded((imu,))
    for sample in samples:
        made.feed(sample)
    made.finish()
    return made


def judged(samples: Iterable[Sample], imu: int) -> Judge:
    """The diagnosis of samples.

    Raises:
        ArithmeticError, LookupError, ValueError: numbers that no model fits.
    """
    return examine(heard(samples, imu).calibrator, imu)


def moving_force(samples: Sequence[Sample], imu: int, until: float = np.inf) -> Array:
    """(3,) mean of the reported force while the vehicle moves, body axes, m/s^2."""
    fixes = [s for s in samples if isinstance(s, GpsFix) and s.fix_type >= FIX_3D]
    rows = [s for s in samples if isinstance(s, ImuSample) and s.imu == imu]
    if len(fixes) < 2 or not rows:
        return np.full(3, np.nan)
    t = np.array([s.t for s in rows])
    at = np.array([s.t for s in fixes])
    order = np.argsort(at, kind="stable")
    speed = np.hypot([s.v_n for s in fixes], [s.v_e for s in fixes])
    moving = np.interp(t, at[order], speed[order], left=0.0, right=0.0) > MOVING_M_S
    moving &= t < until
    if not np.any(moving):
        return np.full(3, np.nan)
    mean: Array = np.array([s.f_b for s in rows])[moving].mean(axis=0)
    return mean


def resting_force(samples: Sequence[Sample], imu: int) -> Array:
    """(3,) median of the reported force where nothing moves, body axes, m/s^2; NaN: nowhere."""
    rows = [s for s in samples if isinstance(s, ImuSample) and s.imu == imu]
    t = np.array([s.t for s in rows])
    f, w = np.array([s.f_b for s in rows]), np.array([s.w_b for s in rows])
    still = [
        f[part].mean(axis=0)
        for part in np.split(np.arange(len(t)), np.flatnonzero(np.diff(t // STANDS_S)) + 1)
        if len(part) > FEWEST_STANDING
        and np.ptp(t[part]) > 0.8 * STANDS_S
        and f[part].std(axis=0).max() < STANDING_M_S2
        and w[part].std(axis=0).max() < STANDING_RAD_S
    ]
    if len(still) < FEWEST_STANDS:
        return np.full(3, np.nan)
    out: Array = np.median(still, axis=0)
    return out


def fits(flights: Sequence[RealFlight], jobs: int = 1) -> list[Fit]:
    """Every accelerometer of every flight, in order; ``jobs`` processes.

    What is offered of each is by all of its flight.
    """
    wanted = [(f, imu) for f in flights for imu in f.imus]
    if jobs <= 1:
        made = [fit(f, imu) for f, imu in wanted]
    else:
        with ProcessPoolExecutor(max_workers=jobs) as pool:
            made = list(pool.map(fit, *zip(*wanted, strict=True)))
    by_flight = groupby(made, key=lambda f: f.flight)
    return [f for _, some in by_flight for f in with_each_other(list(some))]


def with_each_other(made: list[Fit]) -> list[Fit]:
    """The accelerometers of a flight, with what is offered of each by all of them."""
    whole = [f.whole for f in made if f.whole is not None]
    if len(whole) < 2:
        return made
    comparison = compare(whole, ({f.imu: f.batches for f in made},))
    answers = together(
        [f.given for f in made if f.given is not None], comparison, KEEPING_ALL.needs
    )
    told = {a.imu: a for a in answers}
    return [
        f
        if f.imu not in told
        else replace(
            f,
            status=told[f.imu].calibration.status.value,
            offer=offer_of(told[f.imu], f.parameters),
        )
        for f in made
    ]


def _failed(flight: RealFlight, imu: int, why: str) -> Fit:
    three, six, square = np.full(3, np.nan), np.full(6, np.nan), np.full((6, 6), np.nan)
    nan = float("nan")
    return Fit(
        flight.name,
        flight.vehicle,
        imu,
        "failed",
        False,  # noqa: FBT003 - a field
        why,
        (),
        six,
        six,
        square,
        six,
        six,
        square,
        six,
        six,
        three,
        {},
        nan,
        nan,
        nan,
        nan,
        0,
        0,
        {},
        (),
    )
