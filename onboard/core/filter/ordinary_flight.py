"""Flight in which nothing is out of the ordinary: many epochs in one call of compiled loops.

Most epochs are like that: no gate refuses anything.  They go through
:mod:`onboard.core.filter.runs`; what is left goes through
:class:`~onboard.core.filter.whitening.WhiteningFilter` one by one, whose arithmetic it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epochs
from onboard.core.filter.kernel import Run
from onboard.core.filter.limits import (
    ATTITUDE_TIME_S,
    COLOUR_TIME_S,
    SYMMETRY_UPDATES,
    TAIL,
)
from onboard.core.filter.prepared import Prepared
from onboard.core.filter.readings import Index
from onboard.core.filter.running_estimate import RunningEstimate
from onboard.core.filter.traces import Traces
from onboard.core.filter.uncertainty import Covariance, Information
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY

_TIMES = np.array([COLOUR_TIME_S, ATTITUDE_TIME_S])
_TAILS = np.array([np.inf, TAIL[1], TAIL[2], TAIL[3]])
_BELIEVED, _REFUSED = 1, 2
"""What may be known of a velocity before it is looked at; 0: nothing."""
_NO_COVARIANCE = 2
"""What :func:`onboard.core.filter.runs.run` answers where one is not positive."""


class Gone(NamedTuple):
    """What has been gone through; arrays hold until the next call.

    Attributes:
        step: number of the first step that was not finished.
        pending: whether that step was made, and only the epoch at its end is not taken.
        epochs: (n,) numbers of the epochs that were taken.
        velocities: (n,) how many components of velocity each has.
        heights: (n,) how many heights.
        first_row: (n + 1,) where the whitened innovations of each begin, and where the last end.
        rows: (B, r, m + 1) the innovations: ``y``, then ``h``.
        raw: (r, m + 1) those of member 0 before whitening.
        log_var: (B, r) log variances of each before whitening.
        left: (B, r) what the estimate leaves of ``rows``.
        states: (n, 15) velocity innovation (3, NaN where there is none), attitude (9) and velocity
            (3) after each epoch.
    """

    step: int
    pending: bool
    epochs: Index
    velocities: Index
    heights: Index
    first_row: Index
    rows: Array
    raw: Array
    log_var: Array
    left: Array
    states: Array

    @property
    def of_fixes(self) -> NDArray[np.bool_]:
        """(r,) which innovations are of velocities and heights, which come first in each epoch."""
        many = np.diff(self.first_row)
        place = np.arange(len(self.raw)) - np.repeat(self.first_row[:-1], many)
        out: NDArray[np.bool_] = place < np.repeat(self.velocities + self.heights, many)
        return out

    def noted(self, ready: Epochs, bias_b: Array) -> Array:
        """The filter's state after each of the epochs ``ready`` that had a velocity.

        As :func:`~onboard.core.filter.traces.state_row` has it, (k, STATE_NUMBERS).

        Args:
            ready: of the segment.
            bias_b: (3,) gyroscope bias, body axes, rad/s.
        """
        some = self.velocities > 0
        bias = np.broadcast_to(bias_b, (int(some.sum()), 3))
        t = ready.t[self.epochs[some], None]
        out: Array = np.concatenate((t, self.states[some], bias), axis=1)
        return out

    def traced(self, ready: Epochs, traces: Traces, *, whole: bool) -> None:
        """Add what each of the epochs ``ready`` measured; ``whole`` with all that was whitened."""
        # Velocity comes first in each epoch; the rows of height and attitude are not shown.
        many = np.diff(self.first_row)
        place = np.arange(len(self.raw)) - np.repeat(self.first_row[:-1], many)
        shown = self.raw[place < np.repeat(self.velocities, many)]
        traces.add(ready.t[self.epochs], self.velocities, shown)
        if whole:
            rows = np.split(self.rows[0].copy(), self.first_row[1:-1])
            for of_one, height in zip(rows, self.heights.tolist(), strict=True):
                traces.add_rows(of_one, height=bool(height))


class OrdinaryFlight:
    """Takes a filter through a segment as far as nothing is out of the ordinary."""

    def __init__(self, run: Run, made: WhiteningFilter, ready: Prepared) -> None:
        """Take the loops, the filter and what it goes through."""
        self._run, self._filter, self._ready = run, made, ready
        self._offered = _offered(ready, made.uses)
        numbers = self._offered[:, 0] + self._offered[:, 1] + 3 * self._offered[:, 2]
        self._numbers = numbers
        n, most, m1 = len(numbers), int(numbers.sum()), made.m + 1
        self._rows = np.empty((len(made.bank), most, m1))
        self._raw = np.empty((most, m1))
        self._log_var = np.empty((len(made.bank), most))
        self._left = np.empty((len(made.bank), most))
        self._taken = np.empty(n, dtype=np.int64)
        self._states = np.empty((n, 15))
        self._ends = np.ascontiguousarray(ready.measured, dtype=np.int64)
        written = self._rows, self._raw, self._log_var, self._left
        self._noted = (*written, self._taken, self._states)

    def go(self, step: int, estimate: RunningEstimate) -> Gone:
        """Go on from a step until one is not ordinary.

        Args:
            step: its number.
            estimate: that gates and attitude follow; written to.

        Raises:
            numpy.linalg.LinAlgError: a covariance is not positive.
        """
        made, steps, epochs = self._filter, self._ready.steps, self._ready.epochs
        progress = np.array([step, 0, 0, made.updates])
        made.R_nb = np.array(made.R_nb)
        levels, gram = made.variances, made.noise_gram
        known = estimate.uncertainty.matrix
        known = np.ascontiguousarray(known) if estimate.held else known.copy()
        form = np.array([int(not isinstance(estimate.uncertainty, Covariance))])
        pending = self._run(
            made.carried,
            made.R_nb,
            progress,
            SYMMETRY_UPDATES,
            np.ascontiguousarray(estimate.theta),
            int(estimate.held),
            known,
            form,
            estimate.summed,
            estimate.prior,
            estimate.counted,
            steps.duration,
            steps.turn,
            steps.moved,
            steps.columns,
            steps.missed,
            steps.shaken,
            steps.stated,
            epochs.latitude,
            self._ends,
            self._offered,
            epochs.R_attitude,
            epochs.body,
            epochs.ned,
            epochs.acting,
            epochs.along_velocity,
            epochs.noise,
            epochs.moving,
            epochs.stated,
            levels.walk,
            levels.settled,
            levels.reading,
            levels.jitter,
            _TIMES,
            levels.heading_time,
            levels.stated,
            levels.shaken,
            _TAILS,
            np.array([made.t - made.taken_t]),
            STANDARD_GRAVITY,
            int(made.uses.earth),
            int(gram is not None),
            np.zeros(3) if gram is None else gram,
            *self._noted,
        )
        if estimate.held:
            estimate.count(int(progress[2]))
        elif form[0]:
            estimate.uncertainty = Information(known)
        if pending == _NO_COVARIANCE:
            raise np.linalg.LinAlgError("the covariance of the innovations is not positive")
        return self._gone(step, progress, pending=bool(pending))

    def _gone(self, step: int, progress: Index, *, pending: bool) -> Gone:
        """What a call has done, from step number ``step`` on; the filter's time follows."""
        made = self._filter
        after, rows, count, made.updates = progress.tolist()
        done = slice(step, after + pending)
        made.t += float(self._ready.steps.duration[done].sum())
        taken = self._taken[:count]
        if count:
            made.taken_t = float(self._ready.epochs.t[taken[-1]])
        first = np.concatenate([[0], np.cumsum(self._numbers[taken])])
        velocities, heights = self._offered[taken, 0], self._offered[taken, 1]
        if made.gates is not None and heights.any():
            made.gates.height_is_inside()
        return Gone(
            after,
            pending,
            taken,
            velocities,
            heights,
            first,
            self._rows[:, :rows],
            self._raw[:rows],
            self._log_var[:, :rows],
            self._left[:, :rows],
            self._states[:count],
        )


def ordinary_flight(made: WhiteningFilter, ready: Prepared) -> OrdinaryFlight | None:
    """For a filter whose arithmetic is compiled, and whose gates judge; else None."""
    run, gates = made.kernel.run, made.gates
    if run is None or gates is None or made.uses.recorded_attitude:
        return None
    return OrdinaryFlight(run, made, ready)


def _offered(ready: Prepared, uses: Uses) -> Index:
    """(n, 4) components of velocity, of height, of attitude over three; what is known."""
    epochs = ready.epochs
    out = np.zeros((len(epochs), 4), dtype=np.int64)
    finite = np.isfinite(epochs.velocity)
    level = finite[:, 0] & finite[:, 1] & epochs.trusted
    out[:, 0] = np.where(level, 2 + finite[:, 2], 0)
    if uses.height:
        out[:, 1] = np.isfinite(epochs.height) & epochs.trusted
    if uses.attitude:
        out[:, 2] = epochs.near
    if uses.refused is not None:
        named = [bool(uses.refused.by(stamp)) for stamp in epochs.stamp.tolist()]
        out[:, 3] = np.where(named, _REFUSED, _BELIEVED)
    return out
