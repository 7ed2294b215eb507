"""A flight gone through once more with other physics in the model: the engine of a diagnosis.

Every pass over a flight costs; a diagnosis makes few.  Noise levels are found on a sample of the
flight, one pass gives sums and rows with everything that is suspected, another those of the model
that was chosen, linearised about what the first one has found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from onboard.core.diagnosis.effort import NEIGHBOURS, SAMPLE_S, WORTH_A_PASS
from onboard.core.estimate.approach import worth
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.going_through import through
from onboard.core.estimate.solution import Solution, limited, noise_matters, solve
from onboard.core.filter.accompanied import AccompaniedPass
from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.noisy_pass import NoisyPass
from onboard.core.filter.passes import Pass
from onboard.core.filter.preparations import Preparations
from onboard.core.filter.refused import Refused
from onboard.core.filter.traces import EpochTrace, PassResult, Traces
from onboard.core.filter.whitening import Uses
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.sums import NormalSums
from onboard.core.model.ekf_misled import EkfJumped
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Family, Model
from onboard.core.physics.effect import Effect
from onboard.core.physics.effects.bias_step import BiasStep

VELOCITY = ("velocity", "recovery")
"""Gates that refuse a velocity."""


class Examination(Engine):
    """An engine over a flight that another one has kept, with more physics."""

    def __init__(
        self,
        like: Engine,
        families: Sequence[Family],
        *,
        t0: float,
        batches: Sequence[Batch] | None = None,
        start: Engine | None = None,
        point: Linearisation | None = None,
        refused: Refused | None = None,
        carried: Sequence[Family] = (),
        traced: bool = True,
    ) -> None:
        """Take the flight of ``like``, more families, and where to start.

        Args:
            like: has the flight and the prior.
            families: physics to add to the calibration's own.
            batches: another flight than that of ``like``.
            t0: when a clock that runs off was right, s.
            start: an examination whose linearisation and noise are taken over.
            point: another linearisation than that.
            refused: velocities that are refused, and no others; None: what the gates judge.
            carried: nuisances that every examination of a flight like this one has too.
            traced: whether epochs are kept; else there are only sums.
        """
        inherited = like.carried if isinstance(like, Examination) else ()
        self.carried: tuple[Family, ...] = (*inherited, *carried)
        self.families = tuple(families)
        origin = start or like
        self.noisy: bool = isinstance(origin, Examination) and (origin.noisy or origin.found_noisy)
        """Whether noise in the samples is carried through all that is made of them."""
        point = replace(point or origin.point, skew_from=t0)
        if not any(getattr(f, "effect", "") == "clock_skew" for f in families):
            point = replace(point, skew=0.0)
        self.traced = traced
        self.traces = Traces()
        self._refused: Refused | None = None
        self._beside: Family | None = None
        answers = _answers((*families, *self.carried), like.settings.needs.prior_offset)
        super().__init__(
            replace(like.settings, refine=True),
            like.prior,
            point,
            origin.noise,
            uses=Uses(refused=refused),
            more=(*families, *self.carried, *answers),
        )
        self._refused_by: Engine | None = like
        if batches is None:
            batches = like.as_read if isinstance(like, Examination) else like.batches
        self.as_read: list[Batch] = list(batches)
        for answer in answers:
            self.as_read = answer.along(self.as_read)
        self.batches = self._without_jumps()
        self.trusted_s = sum(c.trusted_s for c in self.batches)
        self.left_brisk_s = like.left_brisk_s
        self.sample = _sampled(self.batches)
        self._seed = self._known_to(origin)

    def _without_jumps(self) -> list[Batch]:
        """The flight as it was read, less what is known of jumps of the offset."""
        out, scale = self.as_read, np.array(self.point.scale)
        for jump in _jumps((*self.families, *self.carried)):
            if jump.taken_off is not None:
                out = [replace(b, segment=jump.off_samples(b.segment, scale)) for b in out]
        return out

    def _known_to(self, origin: Engine) -> Solution | None:
        """What another engine knows, as a solution of this one's model: gates begin with it.

        Gates that know nothing let in what the first seconds happen to bring.  With noise as small
        as the flight's own, hundreds of good epochs are then refused, and the sums are of the rest.
        """
        solution = origin.known
        if solution is None:
            return None
        known = self.model.taken_over(origin.model, solution.theta, solution.covariance)
        return replace(solution, theta=known[0], covariance=known[1])

    def begin_as(self, other: Engine) -> None:
        """Look for noise and timing from where another accelerometer of the flight has come to.

        What is known of the other one's scale and offset is nothing to the gates of this one.
        """
        own = self.point
        timing = replace(other.point, skew=own.skew, skew_from=own.skew_from)
        self._move(replace(timing, scale=own.scale, beta=own.beta), other.noise)

    def with_noise(self) -> Examination:
        """Find noise and timing, then go through the whole flight."""
        self.refine()
        return self

    def tuned(self) -> Examination:
        """Find noise and timing; no sums."""
        self.tune()
        return self

    def nuisances(self, found: Solution) -> Array:
        """(m,) those of the flight if no effect is in it that trades with one of them.

        The linearisation would follow such a trade to and fro from pass to pass.
        """
        where = self.model.slices
        rivals = [
            i
            for f in self.families
            if isinstance(f, Effect) and f.trades
            for i in range(self.model.size)[where[f.name]]
        ]
        if not rivals:
            return found.theta
        C, theta = found.covariance, found.theta
        absent: Array = theta - C[:, rivals] @ np.linalg.solve(
            C[np.ix_(rivals, rivals)], theta[rivals]
        )
        return absent

    def _new_pass(
        self,
        members: tuple[NoiseLevels, ...] | None = None,
        ready: Preparations | None = None,
    ) -> Pass:
        """As there; noise is carried through all that is made of samples where it matters."""
        if members is not None or not (self.noisy or self._beside):
            return super()._new_pass(members, ready)
        made = self._accompanied_pass()
        if self._seed is not None:
            made.hold(self.about_point(self._seed.theta), self._seed.covariance)
        return made

    def _accompanied_pass(self) -> AccompaniedPass:
        """A pass with columns beside the model's own."""
        of = self.model, self.point, self.noise, self.uses
        if self._beside is None:
            return NoisyPass(*of)
        return AccompaniedPass(self.model, Model((*self.model.families, self._beside)), *of[1:])

    def accompanied(self, by: Family, batches: Sequence[Batch]) -> NormalSums:
        """Go through the whole flight with columns beside the model's own that take no part in it.

        Args:
            by: the columns, of unknowns of sigma :data:`~onboard.core.filter.accompanied.NO_PART`.
            batches: the same flight, with the signals that these are made of.

        Returns:
            Sums of all of it, in which these columns are behind the model's own.
        """
        own, self.batches, self._beside = self.batches, list(batches), by
        self.once()
        self.batches, self._beside = own, None
        self._pass.restart()  # it has a segment, whose signals are parts of those of all of it
        return self._pass.sums.member(0)

    def once(self, held: tuple[Array, Array] | None = None) -> None:
        """As there."""
        super().once(held)
        if self.noisy:
            self.blocks = limited(self.blocks, self.model)

    @property
    def found_noisy(self) -> bool:
        """Whether noise in the regressors matters to the six, by the last pass."""
        effects = {i for f in self.families for i in self.indices(f)}
        index = [i for i in range(self.model.size) if i not in effects]
        return len(self.blocks) > 0 and noise_matters(self.blocks, self.model, index)

    def begin(self) -> None:
        """A pass begins: its epochs are kept, those of the one before are not."""
        if not self.traced:
            return
        room = sum(len(batch.fixes) for batch in self.batches)
        self.traces, self._refused = Traces(room, self.model.size), None
        self._refused_by = None

    def take(self, result: PassResult) -> None:
        """Keep the epochs of a batch that has gone through."""
        if self.traced:
            self.traces.extend(result.traces)

    def with_rows(self, theta: Array | None = None, covariance: Array | None = None) -> Examination:
        """Go through the whole flight, keep every row; again if timing was off or gates were blind.

        Args:
            theta: (m,) estimate for the gates, of the same linearisation.
            covariance: (m, m) of it.
        """
        held = None if theta is None or covariance is None else (theta, covariance)
        blind = held is None and self._seed is None
        for left in (2, 1, 0):
            self.once(held)
            self._seed = found = solve(self.blocks, self.model)
            point = self.asked(self.nuisances(found), found.covariance)
            settled = point.near(self.point, worth(found, self.model, WORTH_A_PASS))
            if not left or (settled and not blind):
                break
            self._move(point, self.noise)
            held, blind = None, False
        return self

    def beside(self, more: Sequence[Family]) -> Examination:
        """The same flight and columns with more of them, from where this one has come to."""
        return Examination(self, (*self.families, *more), t0=self.point.skew_from, start=self)

    def carrying(self, nuisance: Family, *, tuned: bool = True) -> Examination:
        """The same flight and columns with a nuisance that whatever follows has to live with.

        Args:
            nuisance: columns.
            tuned: whether noise and timing are found anew beside it.
        """
        t0 = self.point.skew_from
        made = Examination(self, self.families, t0=t0, start=self, carried=(nuisance,))
        return made.with_noise() if tuned else made.with_rows()

    def doubting(self) -> Examination:
        """The same flight and columns with an attitude that is believed as little as may be.

        An EKF levels with the accelerometer that is examined: what changes the accelerometer's
        offset in flight tilts the recorded attitude too, for as long as the EKF needs to learn it.
        """
        made = Examination(self, self.families, t0=self.point.skew_from, start=self, traced=False)
        made.noise = replace(self.noise, attitude=LIMITS["attitude"][1])
        made.once()
        return made

    def as_seen(self) -> Examination:
        """The same flight and columns beside slow errors of which no more lasts than was seen.

        What is one number for a flight cannot be told from an error that is another one after
        minutes, and the time after which it is another one is no such thing at a floor.
        """
        made = Examination(self, self.families, t0=self.point.skew_from, start=self)
        made.noise = self.noise.as_seen
        made.once()
        return made

    @property
    def log_likelihood(self) -> float:
        """Of what the receiver measured in the whole flight, in the last pass.

        Of that alone, for it is the same whatever timing another examination was made about.
        """
        return self._pass.log_likelihood_of_fixes()

    def whitened(self) -> list[EpochTrace]:
        """Every epoch with all that was whitened: much, and so found in one more pass."""
        found = self.found()
        made = self._new_pass()
        made.hold(found.theta, found.covariance)
        made.keep_traces = made.keep_rows = True
        coast_s = self.settings.coast_s
        return [x for batch in self.batches for x in through(made, batch, coast_s).traces]

    def refused_velocities(self) -> Refused:
        """Those that the gates have refused in the last pass, or in that of the one it is like."""
        if self._refused is not None:
            return self._refused
        if isinstance(self._refused_by, Examination):
            return self._refused_by.refused_velocities()
        named = [(i, n) for i, x in self.traces.refused.items() for n in x if n in VELOCITY]
        stamps = self.point.stamp(self.traces.t[[i for i, _ in named]])
        return Refused(zip(stamps.tolist(), (n for _, n in named), strict=True))

    def let_epochs_go(self) -> None:
        """Keep of them only which velocities were refused: of a day's flight they are much."""
        self._refused = self.refused_velocities()
        self.traces = Traces()

    def let_sums_go(self) -> None:
        """Keep nothing of the last pass but what was refused: another one's sums are asked."""
        self.blocks = []
        self.states.clear()

    @property
    def absent(self) -> Array:
        """Values of the unknowns that mean that an effect is not in the model, (m,)."""
        at = -self.model.taken_off
        if "clock_rate" in self.model.index:
            at[self.model.index["clock_rate"]] = -self.point.skew
        return at

    def found(self) -> Solution:
        """The solution.

        Raises:
            KeyError: no flight was processed.
        """
        solution = self.solution()
        if solution is None:
            raise KeyError("no flight was processed")
        return solution

    def claim(self, solution: Solution) -> None:
        """Answer with this solution until there are other sums."""
        self._solution = solution

    def indices(self, family: Family) -> list[int]:
        """Columns of one family."""
        return list(range(*self.model.slices[family.name].indices(self.model.size)))

    def indices_of(self, families: Sequence[Effect]) -> list[int]:
        """Columns of some families."""
        return [i for f in families for i in self.indices(f)]


def _answers(families: Sequence[Family], most: float) -> tuple[EkfJumped, ...]:
    """What the EKF makes of each jump of the offset among some families.

    Its accelerometer has jumped by no more than is known of the jump, or offsets are, m/s^2.
    """
    sizes = {}
    for f in _jumps(families):
        seen, sigma = np.array([(u.prior, u.prior_sigma) for u in f.unknowns]).T
        taken = 0.0 if f.taken_off is None else f.taken_off
        sizes[f.moment] = np.hypot(seen + taken, sigma)
    return tuple(EkfJumped(at, np.minimum(sizes[at], most)) for at in sorted(sizes))


def _jumps(families: Sequence[Family]) -> list[BiasStep]:
    """Jumps of the offset whose moments are known."""
    return [f for f in families if isinstance(f, BiasStep) and f.onset is not None]


def _sampled(batches: Sequence[Batch]) -> list[list[Batch]]:
    """The whole flight, or parts of it spread evenly."""
    whole = sum(c.duration for c in batches)
    parts = [list(batches[i : i + NEIGHBOURS]) for i in range(0, len(batches), NEIGHBOURS)]
    if whole <= 1.5 * SAMPLE_S:
        return [list(batches)]
    count = max(1, round(len(parts) * SAMPLE_S / whole))
    return [parts[i] for i in np.linspace(0, len(parts) - 1, count).round().astype(int)]
