"""One accelerometer's estimator: buffered batches of flight, passes over them, one solution.

Sums are only as good as the point about which latency, averaging span and noise were taken.  So
the last minutes of flight are kept; after :attr:`EstimatorSettings.refine_at_s` of trusted
flight, and when the recording ends, timing and noise are estimated from the buffer and the sums
made anew from it.  Flight that has left the buffer stays in the sums as it was taken.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence

import numpy as np

from onboard.core.estimate.settings import EstimatorSettings
from onboard.core.estimate.solution import Solution, solve, total
from onboard.core.filter.noise import NoiseLevels, distance, line_search, stencil, stepped
from onboard.core.filter.passes import Pass
from onboard.core.filter.traces import EpochState, PassResult
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, Seconds, merged
from onboard.core.model.linearisation import MOVING, Linearisation
from onboard.core.model.nuisances import (
    AntennaPlace,
    AttitudeOffset,
    GpsLatency,
    GpsSmoothing,
    GyroScale,
    GyroTiming,
    HeightLatency,
    ImuDelay,
    Six,
)
from onboard.core.model.regressors import Family, Model

ROUNDS = 4
"""Rounds of a refinement: latency is found to a millisecond in two or three."""
NOISE_ROUNDS = 3
"""Rounds that may begin a search for noise levels; each search takes two."""
SETTLED = 0.15
"""Levels closer than this (log ratio) are the same: only their order of magnitude matters."""
MOST_STATES = 12000
"""Epochs whose state is kept for certificates: 20 minutes at 10 Hz."""
MOST_AGED = 24
LONGEST_WINDOW_S = 0.45
DELAY_RANGE_S = (-0.1, 0.45)
ATTITUDE_DELAY_RANGE_S = (-0.15, 0.15)
HEADING_RANGE_RAD = (-0.8, 0.8)
STEADY = (5e-4, 2e-3, 5e-3, 0.02)
"""Moves of :data:`MOVING` that are not worth another pass: s, s^2, s, rad."""


def calibration_model(
    point: Linearisation,
    prior: Array | None = None,
    settings: EstimatorSettings | None = None,
    more: tuple[Family, ...] = (),
) -> Model:
    """The six, timing and nuisances about ``point``; ``prior`` is (6,) scale, beta.

    ``more`` is other physics; a nuisance gives way to what is there instead of it.
    """
    needs = (settings or EstimatorSettings()).needs
    centre = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]) if prior is None else prior
    always: tuple[Family, ...] = (
        Six(centre[:3], centre[3:], needs.prior_scale, needs.prior_offset),
        GpsLatency(point.delay),
        GpsSmoothing(point.window),
        ImuDelay(point.attitude_delay),
        HeightLatency(),
        GyroTiming(),
        GyroScale(),
        AttitudeOffset(),
        AntennaPlace(),
    )
    gone = {f.instead_of for f in more}
    return Model([*(f for f in always if f.name not in gone), *more])


def moved(point: Linearisation, model: Model, theta: Array) -> Linearisation:
    """The linearisation that ``theta`` asks for."""
    i = model.index
    square = point.window**2 + theta[i["window_squared"]]
    return Linearisation(
        scale=tuple(float(x) for x in theta[0:3]),  # type: ignore[arg-type] # three by construction
        beta=tuple(float(x) for x in theta[3:6]),  # type: ignore[arg-type] # three by construction
        delay=float(np.clip(point.delay + theta[i["gps_delay"]], *DELAY_RANGE_S)),
        window=float(np.clip(np.sqrt(max(0.0, square)), 0.0, LONGEST_WINDOW_S)),
        attitude_delay=float(
            np.clip(point.attitude_delay + theta[i["attitude_delay"]], *ATTITUDE_DELAY_RANGE_S)
        ),
        heading=float(np.clip(point.heading + theta[i["heading"]], *HEADING_RANGE_RAD)),
        skew=point.skew + (float(theta[i["clock_rate"]]) if "clock_rate" in i else 0.0),
        skew_from=point.skew_from,
    )


def _next_levels(
    levels: NoiseLevels,
    target: NoiseLevels | None,
    members: tuple[NoiseLevels, ...] | None,
    likelihoods: list[float],
) -> tuple[NoiseLevels, NoiseLevels | None]:
    """Levels from here on, and those to be tried next, from what a star or a line has shown."""
    if members is None:
        return levels, None
    if target is not None:
        return members[int(np.argmax(likelihoods))], None
    found = stepped(levels, likelihoods)
    return levels, None if distance(levels, found) < SETTLED else found


class Engine:
    """Sums and solution of one accelerometer."""

    def __init__(
        self,
        settings: EstimatorSettings,
        prior: Array | None = None,
        point: Linearisation | None = None,
        noise: NoiseLevels | None = None,
        uses: Uses | None = None,
        more: tuple[Family, ...] = (),
    ) -> None:
        """Take the settings, the prior six (scale, beta), where to start, and more physics."""
        self._more = more
        self.settings = settings
        self.prior = prior
        self.point = point or Linearisation()
        self.noise = noise or NoiseLevels()
        self.uses = uses or Uses()
        self.batches: list[Batch] = []
        self.aged: list[Block] = []
        self.blocks: list[Block] = []
        self.refused: Counter[str] = Counter()
        self.states: deque[EpochState] = deque(maxlen=MOST_STATES)
        self.trusted_s = 0.0
        self.left_brisk_s = 0.0
        """Of :attr:`brisk_s` what has left the buffer."""
        self._buffered_s = 0.0
        self._refined_s = 0.0
        self._frozen = False
        self.model = self._model()
        self._seed: Solution | None = None
        self._pass = self._new_pass()
        self._solution: Solution | None = None

    def _model(self) -> Model:
        return calibration_model(self.point, self.prior, self.settings, self._more)

    def _new_pass(self, members: tuple[NoiseLevels, ...] | None = None) -> Pass:
        """A pass whose gates know the last solution: an outlier at the start must not pass."""
        solution = self._seed
        return Pass(
            self.model,
            self.point,
            members or (self.noise,),
            uses=self.uses,
            theta=None if solution is None else self._about_point(solution.theta),
            covariance=None if solution is None else solution.covariance,
        )

    def _about_point(self, theta: Array) -> Array:
        """``theta`` of an older linearisation as unknowns about the present one."""
        out = theta.copy()
        for name in (*MOVING, "clock_rate"):
            if name in self.model.index:
                out[self.model.index[name]] = 0.0
        return out

    @property
    def latest(self) -> float:
        """Trusted seconds since the last refinement."""
        return self.trusted_s - self._refined_s

    def add(self, batch: Batch) -> None:
        """Process a batch; refine when it is time."""
        self.batches.append(batch)
        self._buffered_s += batch.duration
        before, self.trusted_s = self.trusted_s, self.trusted_s + batch.trusted_s
        self._run(batch)
        due = any(before < s <= self.trusted_s for s in self.settings.refine_at_s)
        if due and self.settings.refine:
            self.refine()
        self._age()

    def _run(self, batch: Batch) -> None:
        result = self.through(self._pass, batch)
        self.blocks.append(result.block)
        self.refused.update(result.refused)
        self.states.extend(result.states)
        self._solution = None

    def through(self, made: Pass, batch: Batch) -> PassResult:
        """One batch through a pass; a filter that coasted too long begins anew."""
        if batch.fresh or batch.fixes.t[0] - made.coasting_since > self.settings.coast_s:
            made.restart()
        return made.process(batch.segment, batch.fixes, batch.trusted)

    def _age(self) -> None:
        """Let flight leave the buffer; forget slowly what has left it."""
        while self._buffered_s > self.settings.buffer_s and len(self.batches) > 1:
            if not self._frozen:
                self.refine()
                self._frozen = True
            gone = self.batches.pop(0)
            self._buffered_s -= gone.duration
            self.left_brisk_s += gone.seconds_above(self.settings.brisk_speed)
            self.aged.append(self.blocks.pop(0))
            keep = float(np.exp(-gone.duration / self.settings.memory_s))
            self.aged = [Block(p.start, p.end, p.sums.scaled(keep)) for p in self.aged]
            # A few dozen blocks are enough for folds and clusters.
            if len(self.aged) > MOST_AGED:
                self.aged = merged(self.aged, MOST_AGED)

    def refine(self, rounds: int = ROUNDS, noise_rounds: int = NOISE_ROUNDS) -> None:
        """Estimate timing and noise from the buffer and make its sums anew.

        Args:
            rounds: passes at the most.
            noise_rounds: how many of them try other noise levels too.
        """
        if not self.batches or self._frozen:
            return
        self.tune(rounds, noise_rounds)
        self._pass = self._new_pass()
        self.refused.clear()
        self.states.clear()
        self.blocks = []
        for batch in self.batches:
            self._run(batch)
        self._pass.release()
        self._refined_s = self.trusted_s

    def tune(self, rounds: int, noise_rounds: int) -> None:
        """Estimate timing and noise; what sums there are belong to others from then on."""
        target: NoiseLevels | None = None
        for turn in range(rounds):
            members = None
            if target is not None:
                members = line_search(self.noise, target)
            elif turn < noise_rounds:
                members = stencil(self.noise)
            made = self._new_pass(members)
            self._seed = solve(self._over_buffer(made), self.model)
            point = moved(self.point, self.model, self._seed.theta)
            timed = point.near(self.point, STEADY)
            levels, target = _next_levels(self.noise, target, members, made.log_likelihoods())
            settled = target is None and distance(self.noise, levels) < SETTLED
            self._move(point, levels)
            if timed and settled:
                break

    def _move(self, point: Linearisation, levels: NoiseLevels) -> None:
        shift = self.shift(self.point, point)
        self.aged = [Block(p.start, p.end, p.sums.shifted(shift)) for p in self.aged]
        self.point, self.noise = point, levels
        self.model = self._model()

    def _over_buffer(self, made: Pass) -> list[Block]:
        return [self.through(made, batch).block for batch in self.batches]

    @property
    def brisk_s(self) -> float:
        """Trusted flight faster than :attr:`EstimatorSettings.brisk_speed`, s."""
        fast = self.settings.brisk_speed
        return self.left_brisk_s + sum(c.seconds_above(fast) for c in self.batches)

    @property
    def moving(self) -> bool:
        """True if the flight went anywhere: hovering excites nothing."""
        enough = min(self.settings.brisk_s, self.settings.brisk_share * self.trusted_s)
        return self.brisk_s >= enough and self.brisk_s > 0.0

    def shift(self, before: Linearisation, now: Linearisation) -> Array:
        """(m,) by how much unknowns counted from ``now`` are less than from ``before``."""
        shift = np.zeros(self.model.size)
        for name, to, origin in zip(MOVING, now.moving, before.moving, strict=True):
            shift[self.model.index[name]] = to - origin
        return shift

    def restore(self, earlier: Sequence[Block], about: Linearisation, seconds: Seconds) -> None:
        """Take the sums of earlier flights.

        Args:
            earlier: with the unknowns of this engine's model.
            about: the linearisation that they were made about.
            seconds: how much flight is behind them.
        """
        shift = self.shift(about, self.point)
        self.aged = [Block(p.start, p.end, p.sums.shifted(shift)) for p in earlier] + self.aged
        self.trusted_s += seconds.trusted
        self._refined_s += seconds.trusted
        self.left_brisk_s += seconds.brisk
        self._seed = self._solution = solve(self.all_blocks, self.model)

    def finish(self) -> None:
        """End of a recording or a flight: refine once more if there is something new."""
        if not self.settings.refine:
            return
        if self.latest > 0.05 * self.trusted_s and not self._frozen:
            self.refine()

    @property
    def all_blocks(self) -> list[Block]:
        """Aged and buffered blocks, in order of time."""
        return [*self.aged, *self.blocks]

    def solution(self) -> Solution | None:
        """Solve the sums; None before the first batch."""
        if self._solution is None and self.all_blocks:
            self._solution = solve(self.all_blocks, self.model)
        return self._solution

    def total_rows(self) -> float:
        """Rows behind the solution."""
        return total(self.all_blocks).rows if self.all_blocks else 0.0
