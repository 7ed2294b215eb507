"""Quadrature nodes: signals and relative attitude between GPS epochs.

Everything that is integrated between two GPS epochs is needed at a few equidistant nodes, in the
body axes *of the interval's start*: ``P(tau) = R_nb(start)^T R_nb(tau)`` follows from the
gyroscope alone, so the integrals are done for a whole segment of flight at once and turned into
NED when the filter, going through the epochs, knows ``R_nb(start)``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from onboard.core.inputs.segments import Segment
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain
from onboard.core.maths.frames import cross, interpolate_rotation, rotation_from_vector
from onboard.core.maths.interpolation import Hermite

NODES_PER_SAMPLE = 1.5
"""Of the samples' rate, at least: what vibrates at up to half of it is then resolved and cancels,
as it does in the sum of the samples.  Nodes as far apart as the samples would take it for slow
[physics; 2, 3 and 4 give the same answers to a hundredth of a sigma]."""
SHORT_ROW = 32
"""Turns that are multiplied one after the other, where numpy does it [cost]."""
TOGETHER = 1024
"""Nodes that are worked out in one go, with dozens of numbers each on the way [cost]."""


@dataclass(frozen=True, slots=True)
class Signals:
    """Measured signals at times ``t`` of any shape S.

    Attributes:
        t: S, s.
        w_b: (*S, 3) angular rate less the bias estimate, rad/s.
        raw_s: (*S, 3) raw specific force, sensor axes, m/s^2.
        f_b: (*S, 3) specific force by the calibration of the linearisation, body axes, m/s^2.
        segment: where slow signals are looked up.
        P: (K, n, 3, 3) body axes at each of n nodes in a row to those at the first of them; None
            where the nodes are in no such rows.
        curve: the samples' interpolant.
    """

    t: Array
    w_b: Array
    raw_s: Array
    f_b: Array
    segment: Segment
    P: Array | None = None
    curve: Hermite | None = None

    def slow(self, name: str) -> Array | None:
        """Slow signal at these times, S or (*S, k); None if the recording lacks it."""
        return self.segment.slow_at(name, self.t)

    @property
    def R_bs(self) -> Array:
        """(3, 3) board orientation."""
        return self.segment.R_bs

    def and_at(self, others: Signals) -> Signals:
        """These and others of the same segment one after the other, S = (n,)."""
        both = ((self.w_b, others.w_b), (self.raw_s, others.raw_s), (self.f_b, others.f_b))
        w_b, raw_s, f_b = (np.concatenate([a.reshape(-1, 3), b.reshape(-1, 3)]) for a, b in both)
        t = np.concatenate([self.t.ravel(), others.t.ravel()])
        return Signals(t, w_b, raw_s, f_b, self.segment, None, self.curve)


@dataclass(frozen=True, slots=True)
class Intervals:
    """Nodes inside K intervals, M + 1 in each, with Gregory's weights.

    Attributes:
        signals: at the nodes, S = (K, M + 1).
        P: (K, M + 1, 3, 3) body axes at the node to body axes at the interval's start.
        duration: (K,) s.
        weight: (K, M + 1) of ``integral x dtau``.
        weight_to_end: (K, M + 1) of ``integral (T - tau) x dtau``.
    """

    signals: Signals
    P: Array
    duration: Array
    weight: Array
    weight_to_end: Array

    def integrals(self, x_b: Array) -> tuple[Array, Array]:
        """``integral P x dtau`` and ``integral (T - tau) P x dtau``.

        Args:
            x_b: (K, M + 1, 3, m) m regressors in body axes at each node.

        Returns:
            Two arrays (K, 3, m) in the body axes of each interval's start.
        """
        K, _, _, m = x_b.shape
        one, two = np.empty((K, 3, m)), np.empty((K, 3, m))
        self.integrate(x_b, one, two)
        return one, two

    def integrate(self, x_b: Array, one: Array, two: Array) -> None:
        """Write :meth:`integrals` into two arrays (K, 3, m), of any layout."""
        loops = compiled_loops()
        if loops is not None:
            loops.integrals(self.P, self.weight, self.weight_to_end, plain(x_b), one, two)
            return
        for some in self._parts():
            self._integrate(some, x_b[some], one[some], two[some])

    def _integrate(self, some: slice, x_b: Array, one: Array, two: Array) -> None:
        """The same of some of the intervals: (k, M + 1, 3, m), into (k, 3, m)."""
        k, nodes, _, m = x_b.shape
        # Nodes and axes as one dimension that is summed over: what is turned is never stored.
        weights = np.stack((self.weight[some], self.weight_to_end[some]), axis=1)
        turn = weights[:, :, None, :, None] * self.P[some].transpose(0, 2, 1, 3)[:, None]
        both = turn.reshape(k, 6, 3 * nodes) @ x_b.reshape(k, 3 * nodes, m)
        one[:], two[:] = both[:, :3], both[:, 3:]

    def _parts(self) -> Iterator[slice]:
        """Intervals that are worked out together: of a segment they would be megabytes."""
        K, nodes = self.weight.shape
        some = max(1, TOGETHER // nodes)
        return (slice(first, first + some) for first in range(0, K, some))

    def of_sensors(self) -> OfSensors:
        """Integrals of what is in every model, at once."""
        loops = compiled_loops()
        s, K = self.signals, len(self.duration)
        if loops is not None:
            out = np.zeros((K, 2, 3, loops.OWN))
            weights = self.weight, self.weight_to_end
            loops.own(self.P, *weights, s.w_b, s.raw_s, s.f_b, plain(s.R_bs), out)
            return OfSensors(out, s.R_bs)
        out = np.empty((K, 2, 3, 11))
        for some in self._parts():
            f_b, raw_s, w_b, P = s.f_b[some], s.raw_s[some], s.w_b[some], self.P[some]
            axes, turned = np.broadcast_to(np.eye(3), P.shape), cross(w_b, f_b)
            raw, rate = s.R_bs * raw_s[..., None, :], np.eye(3) * w_b[..., None, :]
            x = [f_b[..., None], axes, raw, turned[..., None], rate]
            self._integrate(some, np.concatenate(x, axis=-1), out[some, 0], out[some, 1])
        return OfSensors(out, s.R_bs)


class OfSensors(NamedTuple):
    """What :meth:`Intervals.integrals` makes of signals that every model has regressors of.

    Attributes:
        both: (K, 2, 3, 11) once and twice integrated, body axes of each interval's start.
        R_bs: (3, 3) board orientation.
    """

    both: Array
    R_bs: Array

    @property
    def force(self) -> Array:
        """(K, 2, 3) of the specific force."""
        return self.both[..., 0]

    @property
    def axes(self) -> Array:
        """(K, 2, 3, 3) of the body's axes: ``P`` itself."""
        return self.both[..., 1:4]

    @property
    def raw(self) -> Array:
        """(K, 2, 3, 3) of ``R_bs e_j raw_j``, the raw force by the sensor's axes."""
        return self.both[..., 4:7]

    @property
    def turned(self) -> Array:
        """(K, 2, 3, 1) of ``w x f``."""
        return self.both[..., 7:8]

    @property
    def rate(self) -> Array:
        """(K, 2, 3, 3) of ``e_j w_j``, the rate by axes."""
        return self.both[..., 8:]


def gregory_weights(count: int) -> Array:
    """(count + 1,) weights of Gregory's rule on [0, 1], exact for cubics; ``count`` is 4 or more.

    Trapezoids, their ends corrected by differences (Davis and Rabinowitz, Methods of Numerical
    Integration, 2.9).  Between the ends all weights are one, as in a mean of samples, so that what
    alternates cancels; Simpson's 4, 2, 4, 2 would take a third of it for a slow force.
    """
    w = np.ones(count + 1)
    end = np.array([3.0 / 8.0, 7.0 / 6.0, 23.0 / 24.0]) - 1.0
    w[:3] += end
    w[-3:] += end[::-1]
    return w / count


def rotation_increments(w: Array, h: Array) -> Array:
    """Rotation vectors over steps, fourth order.

    Magnus expansion of ``R' = R [w x]``: ``h/6 (w0 + 4 wm + w1) + h^2/12 w0 x w1`` (Iserles et
    al., Acta Numerica 9, 2000; in strapdown terms Simpson plus coning).

    Args:
        w: (..., 2 M + 1, 3) rates at the ends and the middles of M steps, rad/s.
        h: (...,) length of one step, s.

    Returns:
        (..., M, 3) rad.
    """
    w0, wm, w1 = w[..., 0:-2:2, :], w[..., 1:-1:2, :], w[..., 2::2, :]
    step = h[..., None, None]
    out: Array = step / 6.0 * (w0 + 4.0 * wm + w1) + step**2 / 12.0 * cross(w0, w1)
    return out


def turns_in_a_row(w_b: Array, h: Array) -> Array:
    """Attitude at nodes against that of the first of them.

    Args:
        w_b: (K, 2 M + 1, 3) rates at the nodes and half-way between them, rad/s.
        h: (K,) from node to node, s.

    Returns:
        (K, M + 1, 3, 3) body axes at the node to those at the first.
    """
    return _chain(_turns(w_b, h))


def _turns(w_b: Array, h: Array) -> Array:
    """(K, M, 3, 3) from node to node."""
    K, M = len(w_b), w_b.shape[1] // 2
    if K * M <= TOGETHER:
        return rotation_from_vector(rotation_increments(w_b, h))
    out, some = np.empty((K, M, 3, 3)), max(1, TOGETHER // K)
    for first in range(0, M, some):
        rates = w_b[:, 2 * first : 2 * (first + some) + 1]
        out[:, first : first + some] = rotation_from_vector(rotation_increments(rates, h))
    return out


def _chain(turns: Array) -> Array:
    """Running products (K, M + 1, 3, 3) of ``turns`` (K, M, 3, 3), the identity first."""
    K, M = turns.shape[:2]
    if M > SHORT_ROW and K * K < M:
        # A long row in pieces that are as many as they are long, side by side.
        long = math.isqrt(M - 1) + 1
        count = -(-M // long)
        pieces = np.empty((K, count * long, 3, 3))
        pieces[:, :M], pieces[:, M:] = turns, np.eye(3)
        del turns  # of a segment there are thousands: two of these are there at a time
        own = _chain(pieces.reshape(-1, long, 3, 3)).reshape(K, count, long + 1, 3, 3)
        del pieces
        begun = _chain(own[:, :, -1])
        made = np.empty((K, count + 1, long, 3, 3))
        np.matmul(begun[:, :-1, None], own[:, :, :-1], out=made[:, :-1])
        made[:, -1, 0] = begun[:, -1]
        return made.reshape(K, -1, 3, 3)[:, : M + 1]
    P = np.empty((K, M + 1, 3, 3))
    P[:, 0] = np.eye(3)
    for i in range(M):
        P[:, i + 1] = P[:, i] @ turns[:, i]
    return P


class NodeMaker:
    """Makes nodes from one segment, for one gyroscope bias and one calibration."""

    def __init__(
        self, segment: Segment, bias_b: Array, six: Array, *, recorded_attitude: bool = False
    ) -> None:
        """Take the segment and the linearisation.

        Args:
            segment: the samples.
            bias_b: (3,) gyroscope bias to subtract, rad/s.
            six: (6,) scale and ``beta = -scale * offset`` of the linearisation.
            recorded_attitude: relative attitude from the recorded one instead of the gyroscope.
        """
        self.segment = segment
        self._bias = bias_b
        self._six = six
        self.recorded = recorded_attitude
        self.curve = segment.interpolant()
        self._felt = plain(bias_b), plain(six), plain(segment.R_bs)
        self.rate = float((len(segment.t) - 1) / (segment.t[-1] - segment.t[0]))

    @property
    def _samples(self) -> tuple[Array, Array]:
        """What compiled loops interpolate: times of the samples and cubics between them."""
        return self.curve.t, self.curve.cubics

    def signals(self, t: Array) -> Signals:
        """Signals at times ``t`` of any shape."""
        loops = compiled_loops()
        if loops is not None:
            w, raw, f_b = np.empty((3, *t.shape, 3))
            flat = w.reshape(-1, 3), raw.reshape(-1, 3), f_b.reshape(-1, 3)
            loops.signals(*self._samples, plain(t).ravel(), *self._felt, *flat)
            return Signals(t, w, raw, f_b, self.segment, None, self.curve)
        x = self.curve(t)
        raw = x[..., 3:]
        f_b = (raw * self._six[:3] + self._six[3:]) @ self.segment.R_bs.T
        return Signals(t, x[..., :3] - self._bias, raw, f_b, self.segment, None, self.curve)

    def intervals(self, start: Array, end: Array) -> Intervals:
        """Nodes in the intervals ``start`` ... ``end`` (K,), as dense as the samples or denser."""
        T = end - start
        density = NODES_PER_SAMPLE * self.rate
        M = max(4, int(np.ceil(density * float(T.max()))))
        share = np.arange(M + 1) / M
        t = start[:, None] + T[:, None] * share
        signals, P = self._inside(t, T / M)
        weight = gregory_weights(M) * T[:, None]
        to_end = weight * (1.0 - share) * T[:, None]
        return Intervals(signals, P, T, weight, to_end)

    def _inside(self, t: Array, step: Array) -> tuple[Signals, Array]:
        """Signals at nodes in a row ``t`` (K, M + 1), a ``step`` (K,) apart, s, and their ``P``."""
        loops = compiled_loops()
        if self.recorded:
            R, nodes = self.recorded_attitude(t), self.signals(t)
            P: Array = np.swapaxes(R[:, :1], -1, -2) @ R
            return replace(nodes, P=P), P
        if loops is not None:
            (w, raw, f_b), P = np.empty((3, *t.shape, 3)), np.empty((*t.shape, 3, 3))
            loops.inside(*self._samples, t, step, *self._felt, w, raw, f_b, P)
            return Signals(t, w, raw, f_b, self.segment, P, self.curve), P
        nodes = self.signals(t)
        rates = np.empty((len(t), 2 * t.shape[1] - 1, 3))
        rates[:, ::2] = nodes.w_b
        rates[:, 1::2] = self.curve(t[:, :-1] + 0.5 * step[:, None])[..., :3] - self._bias
        P = turns_in_a_row(rates, step)
        return replace(nodes, P=P), P

    def followed(
        self, start: float, step: float, count: int, lever: Array
    ) -> tuple[Array, Array, Array]:
        """Attitude and force at even nodes, in the axes of the first of them.

        Args:
            start: time of the first node, s.
            step: s.
            count: n, of nodes, at least three.
            lever: (3,) to another place, body axes, m.

        Returns:
            Body axes at the nodes to those at the first (n, 3, 3); the force (n, 3), m/s^2; the
            same at the other place: second differences.
        """
        loops = compiled_loops()
        if loops is not None and not self.recorded:
            made = np.empty((count, 3, 3)), np.empty((count, 3)), np.empty((count, 3))
            loops.followed(*self._samples, start, step, *self._felt, plain(lever), *made)
            return made
        t: Array = start + step * np.arange(count, dtype=np.float64)
        if self.recorded:
            f_b, R = self.signals(t).f_b, self.recorded_attitude(t)
        else:
            nodes, P = self._inside(t[None], np.full(1, step))
            f_b, R = nodes.f_b[0], P[0]
        force: Array = (R @ f_b[..., None])[..., 0]
        place = (R.reshape(-1, 3) @ lever).reshape(-1, 3)
        swung = np.empty_like(place)
        swung[1:-1] = (place[2:] - 2.0 * place[1:-1] + place[:-2]) / step**2
        swung[0], swung[-1] = swung[1], swung[-2]
        return R, force, force + swung

    def turned_on(self, start: float, step: float, R: Array, t: Array) -> Array:
        """(k, 3, 3) attitude at times ``t`` (k,): of the node before, turned at the rate half-way.

        Args:
            start: time of the first node, s.
            step: s.
            R: (n, 3, 3) as of :meth:`followed`.
            t: (k,) s.
        """
        if self.recorded:
            return self.recorded_attitude(t)
        loops = compiled_loops()
        if loops is not None:
            out = np.empty((len(t), 3, 3))
            loops.turned_on(*self._samples, start, step, self._felt[0], R, plain(t), out)
            return out
        i = ((t - start) / step).astype(int)
        node = start + i * step
        w = self.signals(0.5 * (t + node)).w_b
        turned: Array = R[i] @ rotation_from_vector(w * (t - node)[:, None])
        return turned

    def recorded_attitude(self, t: Array) -> Array:
        """(*S, 3, 3) at times ``t`` of shape S, straight arcs between its samples."""
        samples = self.segment.t_attitude, self.segment.R_attitude[:]
        flat = interpolate_rotation(t.ravel(), *samples)
        return flat.reshape(*t.shape, 3, 3)
