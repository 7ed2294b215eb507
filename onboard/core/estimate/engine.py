"""One accelerometer's estimator: buffered batches of flight, passes over them, one solution.

Sums are only as good as the point about which latency, averaging span and noise were taken.  So
the last minutes of flight are kept; after :attr:`CalibratorSettings.refine_at_s` of trusted
flight, if what is known then is not enough, and when the recording ends, timing and noise are
estimated from the buffer and the sums made anew from it.  Flight that has left the buffer stays in
the sums as it was taken.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.estimate.approach import Approach, worth
from onboard.core.estimate.calibration_model import calibration_model, moved, possible
from onboard.core.estimate.dead_reckoning import KnownIntervals
from onboard.core.estimate.going_through import Watched, through
from onboard.core.estimate.limits import (
    MOST_AGED,
    MOST_IDLE,
    MOST_ROUNDS,
    MOST_STATES,
    MOST_VAIN,
    NEW_SHARE,
    STEADY,
    WORTH_A_SEARCH,
)
from onboard.core.estimate.noise_search import NoiseSearch, levels_told
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.estimate.solution import Solution, solve
from onboard.core.estimate.told_antenna import batch_from, point_from, shift_by, shifted
from onboard.core.filter.noise import NoiseLevels, log_prior
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Preparations
from onboard.core.filter.traces import PassResult, StateLog
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.reach import FAR
from onboard.core.inputs.segments import Batch
from onboard.core.inputs.steady_heading import SteadyHeading
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block, Seconds, merged
from onboard.core.maths.medians import middle
from onboard.core.model import autopilot_attitude
from onboard.core.model.linearisation import MOVING, SHAPES, Linearisation
from onboard.core.model.regressors import Family, Model


class Engine(Watched):
    """Sums and solution of one accelerometer."""

    def __init__(
        self,
        settings: CalibratorSettings,
        prior: Array | None = None,
        point: Linearisation | None = None,
        noise: NoiseLevels | None = None,
        uses: Uses | None = None,
        more: tuple[Family, ...] = (),
    ) -> None:
        """Take the settings and where to start.

        Args:
            settings: how it works.
            prior: (6,) scale (1) and beta (m/s^2) before the flight, sensor axes.
            point: first linearisation.
            noise: first noise levels.
            uses: measurements that the filter uses.
            more: physics besides the calibration's own.
        """
        self._more = more
        self.settings = settings
        self.prior = prior
        self.point = point or Linearisation()
        self.noise = noise or NoiseLevels()
        self._uses = uses or Uses()
        self.told: Array | None = None
        """(3,) lever arm that the antenna's place counts from, body axes, m; None: no flight."""
        self.batches: list[Batch] = []
        self._heading = SteadyHeading()
        self.sample: Sequence[Sequence[Batch]] | None = None
        """Runs of batches on which timing and noise are found; None: the whole buffer."""
        self.aged: list[Block] = []
        self.blocks: list[Block] = []
        self.refused: Counter[str] = Counter()
        self.refused_untuned: Counter[str] = Counter()
        """What the gates refused with the levels from which those that hold were found."""
        self.states = StateLog(MOST_STATES)
        self.intervals = KnownIntervals()
        self.trusted_s = 0.0
        self.left_brisk_s = 0.0
        """Of :attr:`brisk_s` what has left the buffer."""
        self._waiting = 0
        """Batches that were added and that no pass has gone through yet, at the end."""
        self._buffered_s = self._refined_s = 0.0
        self._due = self._frozen = False
        self.model = self._model()
        self._seed: Solution | None = None
        self._pass = self._counting_pass()
        self._solution: Solution | None = None

    @property
    def uses(self) -> Uses:
        """What the filter uses: a height that never changes in flight is not measured."""
        heights = (batch.fixes.height for batch in self.batches)
        if not self.batches or any(float(np.ptp(height)) > 0.0 for height in heights):
            return self._uses
        return replace(self._uses, height=False)

    def _model(self) -> Model:
        return calibration_model(self.point, self.prior, self.settings.needs, self._more)

    def _counting_pass(self) -> Pass:
        """A pass whose sums will count."""
        made = self._new_pass()
        made.keep_traces = self.traced
        self.begin()
        return made

    def _new_pass(
        self,
        members: tuple[NoiseLevels, ...] | None = None,
        ready: Preparations | None = None,
    ) -> Pass:
        """A pass whose gates know the last solution: an outlier at the start must not pass.

        Args:
            members: levels of the filter bank; None: those that hold.
            ready: what passes about the present point have made ready; the last solution is then
                about that point, too.
        """
        solution = self._seed
        theta = None if solution is None else solution.theta
        if theta is not None and not ready:
            theta = self.about_point(theta)
        return Pass(
            self.model,
            self.point,
            members or (self.noise,),
            uses=self.uses,
            theta=theta,
            covariance=None if solution is None else solution.covariance,
            preparations=ready,
        )

    def about_point(self, theta: Array) -> Array:
        """``theta`` of an older linearisation as unknowns about the present one."""
        out = theta.copy()
        # Of fixes further apart than is looked around them, shares of what is an epoch apart stand
        # for something else: they are not followed.
        kept = () if FAR.tells(self.apart) else SHAPES
        for name in (*MOVING, "clock_rate"):
            if name in self.model.index and name not in kept:
                out[self.model.index[name]] = 0.0
        return out

    @property
    def latest(self) -> float:
        """Trusted seconds since the last refinement."""
        return self.trusted_s - self._refined_s

    @property
    def due(self) -> bool:
        """Whether it is time for a refinement, and one may still be made."""
        return self._due and not self._frozen

    def add(self, batch: Batch) -> None:
        """Process a batch."""
        self.tell_antenna(batch.segment.lever_arm_b)
        fresh = [i for i, before in enumerate([*self.batches, batch]) if before.fresh]
        run = slice(fresh[-1] if fresh else 0, None)
        known = self.batches[run]
        joined = self._heading.joined(known, batch)
        self.batches[run] = autopilot_attitude.along(known, joined, self.batches[: run.start])
        self._waiting += 1
        self._solution = None
        self._buffered_s += batch.duration
        before, self.trusted_s = self.trusted_s, self.trusted_s + batch.trusted_s
        if self.settings.at_once:
            self._catch_up()
        passed = any(before < s <= self.trusted_s for s in self.settings.refine_at_s)
        self._due |= passed and self.settings.refine
        self._age()

    def tell_antenna(self, lever: Array) -> None:
        """Count the antenna's place from a lever arm (3,), body axes, m, in all flight."""
        before, self.told = self.told, lever
        if before is None or np.array_equal(before, lever):
            return
        seed, by = self.known, shift_by(self.model, lever - before)
        self.batches = [batch_from(batch, lever) for batch in self.batches]
        self.aged, self.blocks = shifted(self.aged, by), shifted(self.blocks, by)
        self.point, self._solution = point_from(self.point, lever - before), None
        if seed is not None:
            self._seed = replace(seed, theta=seed.theta - by)
        # Its gates go on with what is known: its own sums count from the place before.
        self._pass = self._new_pass()

    def _catch_up(self) -> None:
        """Go through what waits."""
        waiting = self.batches[len(self.batches) - self._waiting :]
        self._waiting = 0
        for batch in waiting:
            self._run(batch)

    def _run(self, batch: Batch) -> None:
        result = through(self._pass, batch, self.settings.coast_s)
        self.take(result)
        self.blocks.append(result.block)
        self.refused.update(result.refused)
        if result.states:
            self.states.add(np.concatenate(result.states))
        self._solution = None

    def _age(self) -> None:
        """Let flight leave the buffer; forget slowly what has left it."""
        if self._buffered_s > self.settings.buffer_s:
            self._catch_up()
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

    def refine(self, *, levels: bool = True) -> None:
        """Estimate timing and noise from the buffer and make its sums anew.

        Args:
            levels: whether noise levels are not told.
        """
        if self._frozen:
            return
        self.tune(levels=levels)
        self.once()
        self._pass.release()
        self._refined_s, self._due = self.trusted_s, False

    def once(self, held: tuple[Array, Array] | None = None) -> None:
        """Make the sums of the buffer anew, with timing and noise as they are.

        Args:
            held: estimate (m,) and covariance (m, m) for the gates; None: the last solution.
        """
        self._pass = self._counting_pass()
        if held is not None:
            self._pass.hold(*held)
        self.refused.clear()
        self.states.clear()
        self.blocks = []
        self._waiting = len(self.batches)
        self._catch_up()

    def tune(self, *, levels: bool = True) -> None:
        """Estimate timing and noise; the sums are still those of before, until :meth:`once`.

        Args:
            levels: whether noise levels are not told.
        """
        if not self.batches:
            return
        way, ready = Approach(self.point), Preparations()
        sample = [self.batches] if self.sample is None else self.sample
        begin, names = levels_told(self.noise, (batch for part in sample for batch in part))
        self.noise = begin if levels else self.noise
        search = NoiseSearch(names, settled=not levels, blind=self._seed is None)
        highest, idle, elsewhere = -math.inf, 0, False
        for turn in range(MOST_ROUNDS):
            made = self._new_pass(search.members(self.noise), ready)
            results = self._over(sample, made)
            self._seed = found = solve([result.block for result in results], self.model)
            if turn == 0:
                self.refused_untuned = sum((Counter(r.refused) for r in results), Counter())
            likely = (likelihoods := made.log_likelihoods())[0] + log_prior(self.noise, names)
            idle = idle + 1 if likely < highest + WORTH_A_SEARCH else 0
            highest, held = max(highest, likely), self.noise
            asked = self.asked(self.nuisances(found), found.covariance)
            self.noise = search.better(held, likelihoods, made.trades, elsewhere=elsewhere)
            if search.settled and asked.near(way.at, worth(found, self.model, STEADY)):
                way.at = asked
                break
            if idle >= (MOST_IDLE if search.settled else MOST_VAIN):
                self.noise = held
                break
            elsewhere = not self.point.stands_for(way.go(asked, found, self.model))
            if elsewhere:
                self._move(way.at, self.noise)
                ready = ready.elsewhere()
        self._move(way.at, self.noise)

    def nuisances(self, found: Solution) -> Array:
        """(m,) of a solution, as the linearisation is to follow them."""
        return found.theta

    def asked(self, theta: Array, covariance: Array, model: Model | None = None) -> Linearisation:
        """What linearisation an estimate (m,), (m, m) of a model asks for; None: of its own."""
        model = model or self.model
        wanders = self.noise.mean_heading_variance(self.trusted_s)
        estimate = theta, covariance
        within = possible(self.point, model, estimate, wanders, apart=self.apart)
        return moved(self.point, model, within)

    @property
    def apart(self) -> float:
        """From one fix to the next, s; inf if there are none."""
        steps = [middle(np.diff(b.fixes.t)) for b in self.batches if len(b.fixes) > 1]
        return middle(np.array(steps)) if steps else math.inf

    def _move(self, point: Linearisation, levels: NoiseLevels) -> None:
        self.aged = shifted(self.aged, self.shift(self.point, point))
        self.point, self.noise = point, levels
        self.model = self._model()

    def _over(self, runs: Sequence[Sequence[Batch]], made: Pass) -> list[PassResult]:
        """Some runs of batches through a pass, each from a new beginning."""
        made.keep_states = False
        out = []
        for run in runs:
            made.restart()
            out += [through(made, batch, self.settings.coast_s) for batch in run]
        return out

    @property
    def bias_b(self) -> Array:
        """(3,) bias of the gyroscope at the end of the last pass, body axes, rad/s."""
        return self._pass.bias_b

    @property
    def brisk_s(self) -> float:
        """Trusted flight faster than :attr:`CalibratorSettings.brisk_speed`, s."""
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

    def brought(self, earlier: Sequence[Block], about: Linearisation, told: Array) -> list[Block]:
        """Sums of earlier flights as this engine's: about its point, from its antenna's place.

        Args:
            earlier: with the unknowns of this engine's model.
            about: the linearisation that they were made about.
            told: (3,) lever arm that the antenna's place counted from, m.
        """
        now = told if self.told is None else self.told
        by = self.shift(about, self.point) + shift_by(self.model, now - told)
        return shifted(list(earlier), by)

    def restore(self, earlier: Sequence[Block], seconds: Seconds) -> None:
        """Take the sums of earlier flights, :meth:`brought` here; ``seconds`` are behind them."""
        self.aged = [*earlier, *self.aged]
        self.trusted_s += seconds.trusted
        self._refined_s += seconds.trusted
        self.left_brisk_s += seconds.brisk
        self._seed = self._solution = solve(self.all_blocks, self.model)

    def finish(self) -> None:
        """End of a recording or a flight: refine once more if there is something new."""
        if not self.settings.refine:
            return
        if self.latest > NEW_SHARE * self.trusted_s and not self._frozen:
            self.refine()

    @property
    def all_blocks(self) -> list[Block]:
        """Aged and buffered blocks, in order of time."""
        self._catch_up()
        return [*self.aged, *self.blocks]

    def solution(self) -> Solution | None:
        """Solve the sums; None before the first batch."""
        if self._solution is None and self.all_blocks:
            self._solution = solve(self.all_blocks, self.model)
        return self._solution

    @property
    def known(self) -> Solution | None:
        """What is known without going through anything that waits."""
        return self._seed if self._waiting else self.solution() or self._seed
