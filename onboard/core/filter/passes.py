"""One pass of the whitening filter over segments of flight: columns in, sums out."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epoch, Rows, Step
from onboard.core.filter.noise import NoiseLevels
from onboard.core.filter.regressor_noise import sample_noise_density
from onboard.core.filter.traces import EpochState, EpochTrace
from onboard.core.filter.whitening import Uses, WhiteningFilter
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.blocks import Block
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.quadrature import Around, Intervals, NodeMaker
from onboard.core.model.regressors import Model, SegmentColumns
from onboard.core.model.smoothing import mean_weights

LONGEST_STEP_S = 0.26
"""Longer intervals (GPS at 1 Hz) are predicted in steps: attitude errors must stay first order."""
TILT_START = 0.06
HEADING_START = 0.2


@dataclass(slots=True)
class PassResult:
    """What :meth:`Pass.process` adds for one segment."""

    block: Block
    states: list[EpochState] = field(default_factory=list)
    traces: list[EpochTrace] = field(default_factory=list)
    refused: dict[str, int] = field(default_factory=dict)
    epochs: int = 0


class Pass:
    """Runs a filter through consecutive segments; keeps its state between them."""

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
    ) -> None:
        """Take the model, the linearisation and the noise.

        Args:
            model: families of columns.
            point: linearisation.
            bank: noise levels; member 0 is the one whose sums count.
            uses: measurements to use.
            traces: keep the rows of each epoch (offline).
            theta: (m,) estimate held for gates and attitude feedback until :meth:`release`; None:
                estimate as it goes.
            covariance: (m, m) of it.
        """
        self.model = model
        self.point = point
        self.uses = uses or Uses()
        self.filter = WhiteningFilter(model.size, bank, self.uses)
        self.keep_traces = traces
        self._held = theta is not None
        self._information = np.diag(1.0 / model.prior_sigma**2)
        self._prior_b = self._information @ model.prior
        self.theta = model.prior.copy() if theta is None else theta
        self.covariance = np.diag(model.prior_sigma**2) if covariance is None else covariance
        B, m = len(bank), model.size
        self.N = np.zeros((B, m, m))
        self.b = np.zeros((B, m))
        self.s = np.zeros(B)
        self.log_det = np.zeros(B)
        self.rows = 0
        self.bias_b = np.zeros(3)
        self._running = False
        self._since_solve = 0
        self._epochs = 0
        self._last_velocity_t = -np.inf

    @property
    def running(self) -> bool:
        """True while the filter holds a state that the next segment continues."""
        return self._running

    @property
    def coasting_since(self) -> float:
        """Time of the last epoch whose velocity was accepted."""
        return self._last_velocity_t

    def restart(self) -> None:
        """Forget the filter's state (a gap): the next segment begins a new one.  Sums stay."""
        self._running = False

    def hold(self, theta: Array, covariance: Array) -> None:
        """Gates and feedback follow this estimate until :meth:`release`."""
        self.theta, self.covariance, self._held = theta, covariance, True

    def release(self) -> None:
        """From now on gates and feedback follow the pass's own sums."""
        self._held = False

    def log_likelihoods(self) -> list[float]:
        """Log-likelihood of each member, the unknowns integrated out with their prior."""
        out = []
        prior = float(self.model.prior @ self._prior_b)
        for i in range(len(self.s)):
            A = self.N[i] + self._information
            c = self.b[i] + self._prior_b
            theta = np.linalg.solve(A, c)
            chi2 = float(self.s[i] + prior - c @ theta)
            out.append(-0.5 * (self.log_det[i] + chi2 + float(np.linalg.slogdet(A)[1])))
        return out

    def process(self, segment: Segment, fixes: Fixes, trusted: NDArray[np.bool_]) -> PassResult:
        """Go through the epochs ``fixes``; when running, the first is the last one of before.

        Args:
            segment: samples that cover the epochs and 0.3 s to either side.
            fixes: GPS epochs on the boot clock as stamped (delay not removed).
            trusted: (n,) whether the receiver is to be believed there.
        """
        if not self._running:
            first_good = _first_believed(fixes, trusted)
            if len(fixes) - first_good < 2:
                at = float(fixes.t[-1])
                return PassResult(Block(at, at, NormalSums.zeros(self.model.size)))
            fixes, trusted = fixes.between(first_good, len(fixes)), trusted[first_good:]
        epoch_t = self.point.true_time(fixes.t)
        maker = NodeMaker(
            segment, self.bias_b, self.point.six, recorded_attitude=self.uses.recorded_attitude
        )
        start, end, measured = _subdivide(epoch_t)
        intervals = maker.intervals(start, end)
        around = maker.around(epoch_t, self.point.window)
        columns = self.model.columns(intervals, around)
        epochs = self._epoch_list(segment, fixes, trusted, around, columns)
        result = PassResult(Block(float(epoch_t[0]), float(epoch_t[-1]), NormalSums.zeros(0)))
        before = (self.N[0].copy(), self.b[0].copy(), self.s[0], self.log_det[0], self.rows)
        noise = self.filter.column_noise
        gram = None if noise is None else noise.gram.copy()
        if not self._running:
            first = epochs[0]
            R0 = self.point.attitude(segment, epoch_t[:1])[0][0]
            self.filter.start(first, R0, TILT_START, HEADING_START)
            self._running = True
            self._last_velocity_t = first.t
        f1, f2, A = _force_integrals(intervals)
        for k in range(len(start)):
            step = Step(
                float(intervals.duration[k]),
                intervals.P[k, -1],
                f1[k],
                f2[k],
                A[k],
                columns.force1[k],
                columns.force2[k],
                columns.turn[k],
            )
            e = int(measured[k])
            self.filter.predict(step, self.theta, float(fixes.latitude[max(e, 0)]))
            if e < 0:
                continue
            if self.uses.recorded_attitude:
                self.filter.R_nb = self.point.attitude(segment, epoch_t[e : e + 1])[0][0]
            rows = self.filter.update(epochs[e], self.theta, self.covariance)
            result.epochs += 1
            if rows is not None:
                self._take(rows, result)
                if rows.velocities:
                    result.states.append(self._state(rows))
        bias0, bias_columns = self.filter.bias_estimate
        if not self.uses.recorded_attitude:
            shift = bias0 + bias_columns @ self.theta
            self.bias_b = self.bias_b + shift
            self.filter.shift_bias(shift)
        sums = NormalSums.zeros(self.model.size)
        sums.N = self.N[0] - before[0]
        sums.b = self.b[0] - before[1]
        sums.s = float(self.s[0] - before[2])
        sums.log_det = float(self.log_det[0] - before[3])
        sums.rows = float(self.rows - before[4])
        if noise is not None and gram is not None:
            self._noise_in_columns(sums, segment, noise.gram - gram)
        result.block.sums = sums
        return result

    def _state(self, rows: Rows) -> EpochState:
        innovation = np.full(3, np.nan)
        innovation[: len(rows.innovation)] = rows.innovation
        return EpochState(
            rows.t,
            innovation,
            self.filter.R_nb,
            self.filter.velocity(self.theta),
            self.bias_b,
        )

    def _take(self, rows: Rows, result: PassResult) -> None:
        for name in rows.refused:
            result.refused[name] = result.refused.get(name, 0) + 1
        if rows.velocities:
            self._last_velocity_t = rows.t
        y, h = rows.y, rows.h
        ht = np.swapaxes(h, -1, -2)
        self.N += ht @ h
        self.b += (ht @ y[:, :, None])[:, :, 0]
        self.s += np.einsum("br,br->b", y, y)
        self.log_det += rows.log_det
        self.rows += y.shape[1]
        if self.keep_traces:
            # Copies: views would keep the whole bank's rows of every epoch alive.
            result.traces.append(
                EpochTrace(
                    rows.t,
                    rows.raw_innovation.copy(),
                    rows.raw_columns.copy(),
                    y[0].copy(),
                    h[0].copy(),
                    rows.velocities,
                    rows.height,
                    rows.refused,
                    rows.refused_by,
                )
            )
        self._epochs += 1
        self._since_solve += 1
        if not self._held and self._since_solve >= (1 if self._epochs < 60 else 5):
            self._since_solve = 0
            self.covariance = np.linalg.inv(self.N[0] + self._information)
            self.theta = self.covariance @ (self.b[0] + self._prior_b)

    def _noise_in_columns(self, sums: NormalSums, segment: Segment, gram: Array) -> None:
        """Expected Gram of accelerometer noise in the scale columns (errors in variables)."""
        if "six" not in self.model.slices:
            return
        # What looks like noise sample by sample may be a tone that integrates to nothing; the
        # velocity's random walk, found from the residuals, is all that it can amount to.
        density = np.minimum(
            sample_noise_density(segment.t, segment.raw_s), self.filter.bank[0].force_walk ** 2
        )
        at = self.model.slices["six"].start
        # Axis columns of the Gram are body axes; the sensor's are permuted or mixed by R_bs.
        sensor = (segment.R_bs**2).T @ gram
        for j in range(3):
            sums.G[at + j, at + j] = density[j] * sensor[j]

    def _epoch_list(
        self,
        segment: Segment,
        fixes: Fixes,
        trusted: NDArray[np.bool_],
        around: Around,
        c: SegmentColumns,
    ) -> list[Epoch]:
        R_att, near = self.point.attitude(segment, around.now.t)
        kappa = mean_weights(around.offset, self.point.window)
        known = np.einsum("j,kja->ka", kappa, around.f_epoch)
        known += around.swing @ segment.lever_arm_b
        a_down = np.einsum("ka,ka->k", R_att[:, 2], around.now.f_b) + STANDARD_GRAVITY
        known_height = -a_down * self.point.window**2 / 24.0 - R_att[:, 2] @ segment.lever_arm_b
        return [
            Epoch(
                float(around.now.t[e]),
                fixes.v_n[e],
                float(fixes.height[e]),
                float(fixes.latitude[e]),
                R_att[e] if near[e] else None,
                known[e],
                float(known_height[e]),
                c.velocity_body[e],
                c.velocity_ned[e],
                c.position_body[e],
                c.position_ned[e],
                c.along_velocity[e],
                c.attitude_body[e],
                c.attitude_ned[e],
                bool(trusted[e]),
            )
            for e in range(len(fixes))
        ]


def _first_believed(fixes: Fixes, trusted: NDArray[np.bool_]) -> int:
    """Index of the first fix that a filter may start from; their number if there is none."""
    good = np.flatnonzero(trusted & np.all(np.isfinite(fixes.v_n[:, :2]), axis=1))
    return int(good[0]) if len(good) else len(fixes)


def _subdivide(epoch_t: Array) -> tuple[Array, Array, NDArray[np.int_]]:
    """Starts, ends and measured epoch (or -1) of prediction steps between epochs."""
    start: list[float] = []
    end: list[float] = []
    measured: list[int] = []
    for k in range(len(epoch_t) - 1):
        parts = max(1, int(np.ceil((epoch_t[k + 1] - epoch_t[k]) / LONGEST_STEP_S)))
        edges = np.linspace(epoch_t[k], epoch_t[k + 1], parts + 1)
        start.extend(edges[:-1])
        end.extend(edges[1:])
        measured.extend([-1] * (parts - 1) + [k + 1])
    return np.array(start), np.array(end), np.array(measured)


def _force_integrals(intervals: Intervals) -> tuple[Array, Array, Array]:
    """``integral f``, ``integral (T - tau) f`` (K, 3) and ``integral P`` (K, 3, 3)."""
    f1, f2 = intervals.integrals(intervals.signals.f_b[..., None])
    A = np.einsum("ki,kiab->kab", intervals.weight, intervals.P)
    return f1[..., 0], f2[..., 0], A
