"""A segment of flight: the samples of one accelerometer between two moments, as arrays."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TypeAlias, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.limits import DENSE_S, LONGEST_FIX_GAP_S, NEAR_S
from onboard.core.inputs.reported_attitude import Attitudes
from onboard.core.maths.arrays import Array
from onboard.core.maths.compiling import compiled_loops, plain
from onboard.core.maths.frames import (
    interpolate_rotation,
    rotation_from_vector,
    vector_from_rotation,
)
from onboard.core.maths.interpolation import Hermite, curved, straight

PARTS = 6
"""Into which the time from one attitude sample to the next is cut: 0.1 s at the longest, within
which no vehicle cones by a milliradian [physics]."""
Told = TypeVar("Told")
Signal: TypeAlias = tuple[Array, Array]
"""A slow signal: times (j,), s, and values (j,) or (j, k)."""
SLOW_SIGNALS = {
    "temperature": "of the accelerometer, degC",
    "throttle": "0 to 1",
    "vibration": "(j, 3) level by axis, m/s^2",
    "clipping": "samples at the rail since boot",
    "airspeed": "m/s",
}
"""Names of the slow signals that a recording may have, and what they are."""
STEADY_THROTTLE = "steady_throttle"
"""Name of the slow signal of a throttle that something was taken out of (steady_heading)."""
QUICK = frozenset({"throttle", STEADY_THROTTLE})
"""Of these, what swings within a few of its samples."""


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Fixes:
    """GPS epochs with even times.

    Attributes:
        t: (n,) s, boot clock, latency not removed.
        v_n: (n, 3) velocity, NED, m/s; NaN down where the receiver has no vertical speed.
        height: (n,) above mean sea level, m.
        latitude: (n,) rad.
        late: (n,) how much later they are stamped than the time from which the autopilot counts the
            receiver's latency, s; empty where that is not known to differ.
        accuracy: (n,) of the velocity by the receiver's own word, m/s; NaN where it says nothing,
            empty where it never does.
        own: (n,) the receiver's own time of each, s, from any origin; NaN where it is not known,
            empty where it never is.
    """

    t: Array
    v_n: Array
    height: Array
    latitude: Array
    late: Array = field(default_factory=lambda: np.zeros(0))
    accuracy: Array = field(default_factory=lambda: np.zeros(0))
    own: Array = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return len(self.t)

    def between(self, start: int, stop: int) -> Fixes:
        """Epochs ``start:stop``."""
        cut = slice(start, stop)
        return Fixes(
            self.t[cut],
            self.v_n[cut],
            self.height[cut],
            self.latitude[cut],
            self.late[cut],
            self.accuracy[cut],
            self.own[cut],
        )


@dataclass(frozen=True, slots=True, weakref_slot=True)
class Segment:
    """Inertial samples, attitude and slow signals, all on the boot clock, delays removed.

    Attributes:
        t: (n,) sample times of the accelerometer, corrected for its declared low-pass, s.
        w_b: (n, 3) rad/s.
        raw_s: (n, 3) raw specific force, sensor axes, m/s^2.
        t_attitude: (k,) s.
        R_attitude: (k, 3, 3) recorded attitude of the accelerometer's body axes.
        R_bs: (3, 3) board orientation.
        slow: other signals by name: times (j,) and values (j,) or (j, k).
        lever_arm_b: (3,) configured lever arm, accelerometer to GPS antenna, body axes, m.
        gyro_followed: whether the recorded attitude is integrated from this very gyroscope.
    """

    t: Array
    w_b: Array
    raw_s: Array
    t_attitude: Array
    R_attitude: Attitudes
    R_bs: Array
    slow: dict[str, Signal] = field(default_factory=dict)
    lever_arm_b: Array = field(default_factory=lambda: np.zeros(3))
    gyro_followed: bool = False
    _told: dict[object, object] = field(default_factory=dict, init=False, repr=False, compare=False)

    def once(self, of: Callable[[Segment], Told]) -> Told:
        """What a function says of the samples, worked out once: every pass asks again.

        Of the samples only, not of slow signals: :meth:`with_slow`.
        """
        if of not in self._told:
            self._told[of] = of(self)
        return cast("Told", self._told[of])

    def with_slow(self, slow: dict[str, Signal]) -> Segment:
        """The same samples with other slow signals; what is told of either's is of both."""
        made = replace(self, slow=slow)
        object.__setattr__(made, "_told", self._told)
        return made

    def interpolant(self) -> Hermite:
        """Interpolant of (rate, raw) stacked to (n, 6)."""
        return Hermite(self.t, np.hstack([self.w_b, self.raw_s]))

    def _between_samples(self, at: Array, delay: float, curve: Hermite | None) -> Array:
        t_k = self.t_attitude
        if len(t_k) < 2:
            return interpolate_rotation(at, t_k, self.R_attitude[:])
        at = np.minimum(np.maximum(at, t_k[0]), t_k[-1])
        # Few of the samples are next to a time that is asked for.
        k, asked = self._before(at), np.zeros(len(t_k), dtype=bool)
        asked[k] = asked[k + 1] = True
        t_k, R_k = t_k[asked], self.R_attitude[asked]
        loops = compiled_loops()
        if loops is not None:
            between = np.empty((len(at), 3, 3))
            rates = curve or Hermite(self.t, self.w_b)
            samples = plain(t_k), plain(R_k)
            loops.attitudes(rates.t, rates.cubics, *samples, plain(at), delay, PARTS, between)
            return between
        k = (np.cumsum(asked) - 1)[k]
        used, which = np.unique(k, return_inverse=True)
        start, end = t_k[used], t_k[used + 1]
        rate = Hermite(self.t, self.w_b)

        def turned(since: Array, until: Array) -> Array:
            """Rotation (m, 3, 3) by the gyroscope between two times: PARTS turns in a row."""
            h = (until - since) / PARTS
            middle = (since - delay)[:, None] + h[:, None] * (np.arange(PARTS) + 0.5)
            parts = rotation_from_vector(rate(middle.T) * h[:, None])
            turn: Array = parts[0]
            for part in parts[1:]:
                turn = turn @ part
            return turn

        share = ((at - start[which]) / (end - start)[which])[:, None]
        recorded = np.swapaxes(R_k[used], -1, -2) @ R_k[used + 1]
        missed = vector_from_rotation(np.swapaxes(turned(start, end), -1, -2) @ recorded)
        between = turned(start[which], at) @ rotation_from_vector(share * missed[which])
        out: Array = R_k[k] @ between
        return out

    def _before(self, at: Array) -> NDArray[np.intp]:
        """(m,) the attitude sample before each of the times ``at`` (m,) that has one after it."""
        t_k = self.t_attitude
        k = t_k.searchsorted(at, side="right") - 1
        return np.minimum(np.maximum(k, 0), len(t_k) - 2)

    def slow_at(self, name: str, at: Array) -> Array | None:
        """A slow signal at times ``at``, the ends held; None if the recording lacks it.

        By straight lines, but for a throttle, which swings as quickly as it is told.
        """
        if name not in self.slow:
            return None
        t, x = self.slow[name]
        if name in QUICK:
            return curved(t, x, at)
        if x.ndim == 1:
            return np.interp(at, t, x)
        return straight(t, x, at)

    def attitude_at(
        self, at: Array, delay: float = 0.0, curve: Hermite | None = None
    ) -> tuple[Array, NDArray[np.bool_]]:
        """Recorded attitude at ``at`` (m,), and where samples are near enough to vouch for it.

        Between samples it turns as the gyroscope says, and what that misses of the next sample is
        spread evenly: at 10 Hz a constant rate would be 6 mrad off in a roll of 5 rad/s^2.

        Args:
            at: (m,) on the clock of the attitude, s.
            delay: by how much that clock is ahead of the gyroscope's, s.
            curve: :meth:`interpolant`, where there is one already.
        """
        R = self._between_samples(at, delay, curve)
        if len(self.t_attitude) < 2:
            return R, np.zeros(len(at), dtype=bool)
        i = np.minimum(
            np.maximum(self.t_attitude.searchsorted(at) - 1, 0), len(self.t_attitude) - 2
        )
        t0, t1 = self.t_attitude[i], self.t_attitude[i + 1]
        near = (t1 - t0 < DENSE_S) | (np.minimum(at - t0, t1 - at) < NEAR_S)
        return R, near & (at >= t0) & (at <= t1)


@dataclass(frozen=True, slots=True)
class Batch:
    """Some seconds of flight.

    Attributes:
        segment: samples that cover the fixes and what is needed around them.
        fixes: n epochs; the first is the last of the batch before, unless ``fresh``.
        trusted: (n,) whether the receiver is to be believed there.
        fresh: the filter must not continue from the batch before.
    """

    segment: Segment
    fixes: Fixes
    trusted: NDArray[np.bool_]
    fresh: bool

    @property
    def duration(self) -> float:
        """Length between first and last epoch, s."""
        return float(self.fixes.t[-1] - self.fixes.t[0])

    @property
    def trusted_s(self) -> float:
        """Time between neighbouring fixes that are both to be believed, s."""
        step = np.diff(self.fixes.t)
        return float(step[self._between(step)].sum())

    def __deepcopy__(self, memo: object) -> Batch:
        return self  # it never changes, and is most of what an engine keeps

    def seconds_above(self, speed: float) -> float:
        """Of :attr:`trusted_s`, the time that begins with a speed over ground above ``speed``."""
        step = np.diff(self.fixes.t)
        over = np.hypot(self.fixes.v_n[:-1, 0], self.fixes.v_n[:-1, 1]) > speed
        return float(step[self._between(step) & over].sum())

    def _between(self, step: Array) -> NDArray[np.bool_]:
        """(n - 1,) steps between fixes that are both to be believed and no outage apart."""
        out: NDArray[np.bool_] = self.trusted[1:] & self.trusted[:-1] & (step < LONGEST_FIX_GAP_S)
        return out
