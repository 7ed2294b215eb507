"""One pass of the filter bank over segments of flight: samples in, block sums out."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epoch, WhitenedInnovations
from onboard.core.filter.limits import HEADING_START_RAD, TILT_START_RAD
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.ordinary_flight import Gone, ordinary_flight
from onboard.core.filter.preparations import Kept, Preparations, Source
from onboard.core.filter.prepared import Prepared, prepare
from onboard.core.filter.regressor_noise import share_of_walk
from onboard.core.filter.running_estimate import RunningEstimate
from onboard.core.filter.shaken import walk_s
from onboard.core.filter.traces import EpochState, PassResult, Traces, state_row
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.sums import BankSums, NormalSums
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Model


class Pass:
    """Runs a filter bank through consecutive segments; keeps its state between them."""

    carries_walk: ClassVar[bool] = True
    """Whether noise in the scale's regressors is worked out, where there is one member."""

    def __init__(
        self,
        model: Model,
        point: Linearisation,
        bank: tuple[NoiseLevels, ...],
        *,
        uses: Uses | None = None,
        traces: bool = False,
        theta: Array | None = None,
        covariance: Array | None = None,
        preparations: Preparations | None = None,
    ) -> None:
        """Take the model, the linearisation and the noise.

        Args:
            model: families of regressors, m unknowns.
            point: linearisation.
            bank: noise levels of the filter bank; the sums of member 0 are the ones that count.
            uses: measurements to use.
            traces: keep what each epoch measured.
            theta: (m,) estimate held for gates and attitude feedback until :meth:`release`; None:
                estimate as it goes.
            covariance: (m, m) of it.
            preparations: what passes with the same model and linearisation have made ready; this
                one adds to it.  None: everything is made anew.
        """
        self.model = model
        self.point = point
        self.uses = uses or Uses()
        self.filter = WhiteningFilter(model.size, bank, self.uses, walk=self.carries_walk)
        self.keep_traces = traces
        self.keep_rows = False
        """Whether traces have all that was whitened."""
        self.keep_states = True
        """Whether the filter's state is kept after each epoch."""
        self.estimate = RunningEstimate(model)
        """That gates and attitude follow."""
        if theta is not None:
            prior = np.diag(model.prior_sigma**2)
            self.estimate.hold(theta, prior if covariance is None else covariance)
        self.sums = BankSums(len(bank), model.size)
        """Of all segments that are finished."""
        self.of_fixes = BankSums(1, model.size)
        """Those of velocities and heights alone, of member 0."""
        self.trades = np.zeros((len(bank), len(bank)))
        """(B, B) products of what each member changes the whitened innovations, and half of the
        logarithm of their variance, by from member 0's: Fisher's information of small changes."""
        self.bias_b = np.zeros(3)
        self._preparations = preparations
        self._running = False
        self._before: Segment | None = None
        self._last_velocity_t = -np.inf

    @property
    def theta(self) -> Array:
        """(m,) estimate that gates and attitude follow."""
        return self.estimate.theta

    @property
    def running(self) -> bool:
        """True while the filter holds a state that the next segment continues."""
        return self._running

    @property
    def dead_reckoning_since(self) -> float:
        """Time of the last epoch whose velocity was accepted, s."""
        return self._last_velocity_t

    def restart(self) -> None:
        """Forget the filter's state (a gap): the next segment begins a new one.  Sums stay."""
        self._running = False
        self._before = None

    def hold(self, theta: Array, covariance: Array) -> None:
        """Gates and feedback follow this estimate (m,), (m, m) until :meth:`release`."""
        self.estimate.hold(theta, covariance)

    def release(self) -> None:
        """From now on gates and feedback follow the pass's own sums."""
        self.estimate.follow(self.sums.products(0))

    def log_likelihoods(self) -> list[float]:
        """Log-likelihood of each member, the unknowns integrated out with their prior."""
        return self.sums.log_likelihoods(self.model.prior, self.model.prior_sigma)

    def log_likelihood_of_fixes(self) -> float:
        """Log-likelihood of velocities and heights, each beside all that was measured before it.

        About another latency the recorded attitude is read at other instants, which makes it other
        data: at 10 Hz its rounding is halved midway between two samples, and what is measured there
        is likelier whatever is true.  The receiver's own numbers are the same about every
        linearisation.  The unknowns are integrated out around their estimate from everything
        (Laplace), so that models with other unknowns may be compared.
        """
        information = 1.0 / self.model.prior_sigma**2
        known = self.sums.N[0] + np.diag(information)
        prior = self.model.prior
        theta = np.linalg.solve(known, self.sums.b[0] + information * prior)
        off = theta - prior
        misfit = self.of_fixes.member(0).residual(theta) + float(off @ (information * off))
        volume = float(np.linalg.slogdet(known)[1] - np.log(information).sum())
        return -0.5 * (float(self.of_fixes.log_det[0]) + misfit + volume)

    def process(self, segment: Segment, fixes: Fixes, trusted: NDArray[np.bool_]) -> PassResult:
        """Go through the epochs ``fixes``; when running, the first is the last one of before.

        Args:
            segment: samples that cover the epochs and 0.63 s to either side.
            fixes: n GPS epochs on the boot clock as stamped (latency not removed).
            trusted: (n,) whether the receiver is to be believed there.
        """
        skipped = 0
        if not self._running:
            skipped = _first_believed(fixes, trusted)
            if len(fixes) - skipped < 2:
                at = float(fixes.t[-1])
                return PassResult(Block(at, at, self.counted(NormalSums.zeros(self.model.size))))
        made = self._made_ready(Source(segment, fixes, trusted, self._before, skipped))
        self._before, ready = made.segment, made.ready
        if not self._running:
            self._start(made.segment, ready)
        self._subtract(made.bias_b - self.bias_b)
        self.filter.begin_block()
        result = PassResult(Block(ready.start, ready.end, NormalSums.zeros(0)))
        if self.keep_traces:
            result.traces = Traces(len(ready.epochs), self.model.size)
        sums = self._go_through(made.segment, ready, result)
        self._take_bias_out()
        self.sums += sums
        block = sums.member(0)
        if self.filter.noise_gram is not None:
            self._noise_in_regressors(block, segment, self.filter.noise_gram)
        result.block = Block(ready.start, ready.end, self.counted(block))
        return result

    def counted(self, sums: NormalSums) -> NormalSums:
        """What of the sums of a segment its block has."""
        return sums

    def _made_ready(self, source: Source) -> Kept:
        """The segment with its regressors, from another pass or made now."""
        kept = self._preparations
        found = None if kept is None else kept.of(source)
        if found is not None and found.serves(self.bias_b):
            return found
        segment = None if kept is None else kept.remembered(source)
        if segment is None:
            before = source.before.slow if source.before else {}
            segment = self.model.remembering(source.segment, before)
        made = self.made_anew(source, segment)
        if kept is not None:
            kept.keep(made)
        return made

    def made_anew(self, source: Source, segment: Segment) -> Kept:
        """A segment, with what effects remember in it, with its regressors."""
        ready = prepare(
            segment,
            source.fixes.between(source.skipped, len(source.fixes)),
            source.trusted[source.skipped :],
            self.model,
            self.point,
            self.bias_b,
            recorded_attitude=self.uses.recorded_attitude,
        )
        return Kept(source, segment, ready, self.bias_b)

    def _start(self, segment: Segment, ready: Prepared) -> None:
        first = ready.epochs[0]
        R_nb = self.point.attitude(segment, np.array([first.t]))[0][0]
        self.filter.start(first, R_nb, TILT_START_RAD, HEADING_START_RAD)
        self._running = True
        self._last_velocity_t = first.t

    def _go_through(self, segment: Segment, ready: Prepared, result: PassResult) -> BankSums:
        """Predict and update step by step; sums of this segment alone."""
        sums = BankSums(len(self.filter.bank), self.model.size)
        ordinary = ordinary_flight(self.filter, ready)
        k, ends = 0, ready.measured.tolist()
        while k < len(ends):
            begun = False
            if ordinary is not None and self.filter.calm:
                gone = ordinary.go(k, self.estimate)
                self._note_all(gone, ready, result, sums)
                k, begun = gone.step, gone.pending
                if not begun:
                    continue
            if not begun:
                # Between fixes the latitude of the first does: 1e-6 rad.
                latitude = float(ready.epochs.latitude[max(ends[k], 0)])
                self.filter.predict(ready.steps[k], self.theta, latitude)
            if ends[k] >= 0:
                self._at_epoch(ready.epochs[ends[k]], segment, result, sums)
            k += 1
        return sums

    def _at_epoch(self, epoch: Epoch, segment: Segment, result: PassResult, sums: BankSums) -> None:
        """Take what an epoch measured, whatever it is."""
        if self.uses.recorded_attitude:
            self.filter.R_nb = self.point.attitude(segment, np.array([epoch.t]))[0][0]
        made = self.filter.update(epoch, self.theta, self.estimate.uncertainty)
        result.epochs += 1
        if made is None:
            return
        sums.add(made.y, made.h, made.log_det)
        self._compare(made.y - made.h @ self.theta, made.log_var)
        k = made.velocities + made.height
        self.of_fixes.add(made.y[:1, :k], made.h[:1, :k], made.log_var[:1, :k].sum(axis=1))
        self._note(made, result)
        if made.velocities and self.keep_states:
            result.states.append(state_row(self._state(made)))
        self.estimate.add(made.y[0], made.h[0])

    def _note_all(self, gone: Gone, ready: Prepared, result: PassResult, sums: BankSums) -> None:
        """What :meth:`_at_epoch` does, for all epochs that were gone through at once."""
        if not len(gone.epochs):
            return
        result.epochs += len(gone.epochs)
        sums.add_rows(gone.rows, gone.log_var.sum(axis=1))
        self._compare(gone.left, gone.log_var)
        of_fixes = gone.of_fixes
        self.of_fixes.add_rows(gone.rows[:1, of_fixes], gone.log_var[:1, of_fixes].sum(axis=1))
        with_velocity = gone.epochs[gone.velocities > 0]
        if len(with_velocity):
            self._last_velocity_t = float(ready.epochs.t[with_velocity[-1]])
        if self.keep_traces:
            gone.traced(ready.epochs, result.traces, whole=self.keep_rows)
        if self.keep_states:
            result.states.append(gone.noted(ready.epochs, self.bias_b))

    def _compare(self, left: Array, log_var: Array) -> None:
        """Add to :attr:`trades` what is ``left`` of innovations (B, r), with log variances."""
        if len(left) == 1:
            return
        e, s = left - left[0], (log_var - log_var[0]) / 2.0
        self.trades += e @ e.T + s @ s.T

    def _note(self, made: WhitenedInnovations, result: PassResult) -> None:
        """Count what was refused, keep the trace if traces are kept."""
        for name in made.refused:
            result.refused[name] = result.refused.get(name, 0) + 1
        if made.velocities:
            self._last_velocity_t = made.t
        if self.keep_traces:
            shown = np.column_stack([made.raw_innovation, made.raw_columns])
            result.traces.add(np.array([made.t]), np.array([made.velocities]), shown)
            result.traces.add_refused(made.refused, made.refused_by)
            if self.keep_rows:
                rows = np.column_stack([made.y[0], made.h[0]])
                result.traces.add_rows(rows, height=made.height)

    def _state(self, made: WhitenedInnovations) -> EpochState:
        innovation = np.full(3, np.nan)
        innovation[: len(made.innovation)] = made.innovation
        return EpochState(
            made.t,
            innovation,
            self.filter.R_nb,
            self.filter.velocity(self.theta),
            self.bias_b,
        )

    def _take_bias_out(self) -> None:
        """Subtract the estimated gyroscope bias from the next segment's rates."""
        if self.uses.recorded_attitude:
            return
        self._subtract(self.filter.bias(self.theta))

    def _subtract(self, shift: Array) -> None:
        """Subtract ``shift`` (3,), rad/s, more from the rates; the filter's bias counts from it."""
        self.bias_b = self.bias_b + shift
        self.filter.shift_bias(shift)

    def _noise_in_regressors(self, sums: NormalSums, segment: Segment, gram: Array) -> None:
        """Expected part of ``N`` that is accelerometer noise in the scale's regressors."""
        if "six" not in self.model.slices:
            return
        share = share_of_walk(segment, walk_s(self.filter.bank[0], segment))
        at = self.model.slices["six"].start
        # The Gram is by body axes; the sensor's are permuted or mixed by R_bs.
        sensor = (segment.R_bs**2).T @ gram
        for j in range(3):
            sums.G[at + j, at + j] = share[j] * sensor[j]


def _first_believed(fixes: Fixes, trusted: NDArray[np.bool_]) -> int:
    """Index of the first fix that a filter may start from; their number if there is none."""
    good = np.flatnonzero(trusted & np.all(np.isfinite(fixes.v_n[:, :2]), axis=1))
    return int(good[0]) if len(good) else len(fixes)
