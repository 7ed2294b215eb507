"""A segment of flight made ready for the filter: steps of prediction, and what each fix measures.

Integrals and regressors of a whole segment are evaluated at once, because arrays are cheap and
loops are not; the filter then goes through them one by one.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from onboard.core.filter.innovations import Epochs, Steps, steps
from onboard.core.filter.limits import LONGEST_STEP_S, STAMP_JITTER_S, STATED_M_S
from onboard.core.filter.missed import missed_between
from onboard.core.filter.shaken import shaken_between
from onboard.core.filter.state import MEASURED, PSI, H, V
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.around import Around, around
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.quadrature import Intervals, NodeMaker
from onboard.core.model.regressors import Model, SegmentRegressors


@dataclass(frozen=True, slots=True)
class Prepared:
    """What the filter goes through in one segment.

    Attributes:
        steps: K steps of prediction, in order of time.
        measured: (K,) index into ``epochs`` of the fix at the end of each step; -1: none there.
        epochs: what the n fixes measure; the filter starts at the first, no step ends there.
    """

    steps: Steps
    measured: NDArray[np.int_]
    epochs: Epochs

    @property
    def size(self) -> int:
        """Bytes of all arrays."""
        both = (self.steps, self.epochs)
        return sum(getattr(x, f.name).nbytes for x in both for f in fields(x))

    @property
    def start(self) -> float:
        """Time of the first fix, latency removed, s."""
        return float(self.epochs.t[0])

    @property
    def end(self) -> float:
        """Time of the last fix, latency removed, s."""
        return float(self.epochs.t[-1])


def prepare(
    segment: Segment,
    fixes: Fixes,
    trusted: NDArray[np.bool_],
    model: Model,
    point: Linearisation,
    bias_b: Array,
    *,
    recorded_attitude: bool = False,
) -> Prepared:
    """Evaluate integrals and regressors of one segment.

    Args:
        segment: samples that cover the fixes and what a receiver averages around them.
        fixes: n >= 2 fixes on the boot clock as stamped (latency not removed).
        trusted: (n,) whether the receiver is to be believed there.
        model: families of regressors, m unknowns.
        point: linearisation.
        bias_b: (3,) gyroscope bias to subtract, body axes, rad/s.
        recorded_attitude: relative attitude from the recorded one instead of the gyroscope.
    """
    epoch_t = point.true_time(fixes.t)
    maker = NodeMaker(segment, bias_b, point.six, recorded_attitude=recorded_attitude)
    start, end, measured, leads_to = _subdivide(epoch_t)
    stated = _stated(fixes, trusted)
    intervals = maker.intervals(start, end)
    near = around(maker, epoch_t, point.window, np.array(point.antenna), np.array(point.shapes))
    regressors = model.regressors(intervals, near)
    unsure = missed_between(segment, start, end), shaken_between(segment, start, end)
    return Prepared(
        _steps(intervals, regressors, unsure, stated[leads_to]),
        measured,
        _epochs(segment, fixes, trusted, stated, point, near, regressors),
    )


def _stated(fixes: Fixes, trusted: NDArray[np.bool_]) -> Array:
    """(n,) as in :class:`~onboard.core.filter.innovations.Epoch`.

    A fix that is not believed says nothing: what a receiver without satellites states, hundreds of
    metres a second, is no error that the next good fix would still have.
    """
    out = np.ones(len(fixes))
    if len(fixes.accuracy):
        said = trusted & np.isfinite(fixes.accuracy)
        out[said] = (fixes.accuracy[said] / STATED_M_S) ** 2
    return out


def _subdivide(epoch_t: Array) -> tuple[Array, Array, NDArray[np.int_], NDArray[np.int_]]:
    """Starts (K,), ends (K,), s, of steps between epochs (n,), and the epoch that each leads to.

    The third is the same epoch (K,), but -1 where other steps follow before it is measured.
    """
    gap = np.diff(epoch_t)
    if gap.max() <= LONGEST_STEP_S:  # as nearly all are
        next_ = np.arange(1, len(epoch_t))
        return epoch_t[:-1], epoch_t[1:], next_, next_
    parts = np.maximum(np.ceil(gap / LONGEST_STEP_S), 1.0).astype(int)
    k = np.repeat(np.arange(len(gap)), parts)
    part = np.arange(len(k)) - np.repeat(np.cumsum(parts) - parts, parts)
    last = part + 1 == parts[k]
    width = (gap / parts)[k]
    start = epoch_t[k] + part * width
    end = np.where(last, epoch_t[k + 1], epoch_t[k] + (part + 1) * width)
    return start, end, np.where(last, k + 1, -1), k + 1


def _steps(
    intervals: Intervals,
    regressors: SegmentRegressors,
    unsure: tuple[Array, Array],
    stated: Array,
) -> Steps:
    of = regressors.of_sensors
    return steps(
        intervals.duration,
        intervals.P[:, -1],
        of.force,
        of.axes[:, 0],
        regressors.gained,
        *unsure,
        stated,
    )


def _epochs(
    segment: Segment,
    fixes: Fixes,
    trusted: NDArray[np.bool_],
    stated: Array,
    point: Linearisation,
    nodes: Around,
    c: SegmentRegressors,
) -> Epochs:
    R_att, near = point.attitude(segment, nodes.now.t, nodes.now.curve)
    known = nodes.averaged + nodes.swing @ segment.lever_arm_b
    lower = np.einsum("ka,ka->k", R_att[:, 2], nodes.averaged_place)
    lower += STANDARD_GRAVITY * point.window**2 / 24.0
    known_height = -lower - R_att[:, 2] @ segment.lever_arm_b
    n, body = len(known), c.body
    body[:, 0:3, 0] = -known
    np.negative(body[:, 3:6], out=body[:, 3:6])  # height is up
    ned, there = np.zeros((n, MEASURED, len(c.acting) + 1)), c.ned.take(c.acting, axis=2)
    ned[:, V, 0] = fixes.v_n
    ned[:, H, 0] = fixes.height - known_height
    ned[:, V, 1:], ned[:, H, 1:], ned[:, PSI, 1:] = there[:, 0:3], -there[:, 5], there[:, 6:9]
    noise = np.zeros((n, MEASURED))
    rate2 = (nodes.now.w_b**2).sum(axis=1)
    noise[:, PSI] = STAMP_JITTER_S**2 * rate2[:, None]
    moving = np.zeros((n, MEASURED))
    gained = (R_att @ nodes.f_mean[:, :, None])[..., 0]
    gained[:, 2] += STANDARD_GRAVITY
    moving[:, V] = gained**2
    return Epochs(
        np.ascontiguousarray(nodes.now.t),
        fixes.v_n,
        fixes.height,
        np.ascontiguousarray(fixes.latitude),
        R_att,
        near,
        body,
        ned,
        np.concatenate([[0], c.acting + 1]),
        c.along_velocity,
        trusted,
        noise,
        moving,
        fixes.t,
        stated,
    )
