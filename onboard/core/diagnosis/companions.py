"""What the other accelerometers of a vehicle say of a jump: they feel one trajectory.

The difference of two accelerometers needs neither GPS nor attitude
(:mod:`onboard.core.estimate.shared_windows`), so a jump of one of them shows in it many times
better than in the velocity.  Which of the two has jumped it does not show: with three, the pair of
the others does, and with two only the velocity.  What all accelerometers do alike is in no
difference: a jump that GPS asks of each of them is none of theirs.

Of ``n`` accelerometers each pair brings ``2 / n`` of its information
(:mod:`onboard.core.estimate.joint`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import log

import numpy as np

from onboard.core.diagnosis.effort import SEARCHED
from onboard.core.diagnosis.limits import CLEARLY, CONTACT_S
from onboard.core.diagnosis.score import least, needed, surprise, time_sigma
from onboard.core.estimate.limits import (
    FEWEST_WINDOWS,
    MISPLACED_M,
    PAIR_NOISE_FLOOR,
    SHARED_WINDOW_S,
)
from onboard.core.estimate.shared_windows import SharedWindows, shared_windows
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.maths.steps import Steps, steps_in
from onboard.core.physics.effect import Origin
from onboard.core.physics.effects.bias_step import LARGEST, BiasStep, Witness

TINY = 1e-12
"""(m/s^2)^2; a jump of nothing began at no time."""
EDGE = 3
"""Windows at either end of a flight in which no step is looked for: a level before it, the step and
the window in which it begins are three unknowns [bound]."""


@dataclass(frozen=True, slots=True)
class Companion:
    """One accelerometer for the others: flight (batches), scale and beta in force and their prior.

    ``before`` and ``prior_sigma`` are (6,).
    """

    batches: Sequence[Batch]
    before: Array
    prior_sigma: Array


@dataclass(frozen=True, slots=True)
class _Pair:
    """Two accelerometers: when windows begin (n,), steps of each axis in a less b, residuals."""

    t: Array
    axes: tuple[Steps, Steps, Steps]

    def on(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Gain, size, what the window before has, information (n, 3), at other windows."""
        i = np.clip(np.searchsorted(self.t, t), 0, len(self.t) - 1)
        there = np.abs(self.t[i] - t)[:, None] < SHARED_WINDOW_S
        gain, size, before, variance = (
            np.stack([getattr(axis, name)[i] for axis in self.axes], axis=-1)
            for name in ("gain", "size", "before", "variance")
        )
        return np.where(there, gain, 0.0), size, before, np.where(there, 1.0 / variance, 0.0)


@dataclass(frozen=True, slots=True)
class _Told:
    """Of jumps of one accelerometer at n moments: gain (n,), sizes and information (n, 3).

    ``early`` (n,) is the share of the window before in which it has jumped already.
    """

    gain: Array
    size: Array
    information: Array
    early: Array


class Companions:
    """The accelerometers of one vehicle over one flight."""

    def __init__(self, everyone: Mapping[int, Companion]) -> None:
        """Take accelerometers that have flown, by number."""
        self._pairs: dict[tuple[int, int], _Pair] = {}
        self._scale_sigma = {imu: one.prior_sigma[:3] for imu, one in everyone.items()}
        self.imus = tuple(sorted(everyone))
        for a, b in combinations(self.imus, 2):
            one, other = everyone[a], everyone[b]
            windows = shared_windows(one.batches, other.batches)
            if len(windows) >= FEWEST_WINDOWS:
                self._pairs[a, b] = _steady(windows, one, other)

    def jump(self, imu: int, origin: Origin) -> BiasStep | None:
        """The jump of one accelerometer that its differences show best, with what they say of it.

        None if they show none.  Nothing hits a vehicle in the air: the last :data:`CONTACT_S` of
        a flight are not asked.
        """
        t = self._asked(imu)
        if not len(t):
            return None
        told = self._told(imu, t)
        i = int(np.argmax(told.gain))
        if surprise(float(told.gain[i]), 3, len(t)) < -2.0 * log(SEARCHED):
            return None
        moment = float(t[i] - told.early[i] * SHARED_WINDOW_S)
        sigma = time_sigma(t, told.gain, SHARED_WINDOW_S)
        return BiasStep(origin).at(moment, self._witness(imu, t, i), sigma)

    def of(self, jump: BiasStep, imu: int) -> BiasStep:
        """A jump that was found without the others, with what they say of it if they can."""
        t = self._asked(imu)
        if not len(t) or not t[0] <= jump.moment <= t[-1]:
            return jump
        # What jumps within a window is there in part, and has jumped in the next one.
        after = int(np.searchsorted(t, jump.moment))
        about = t[max(after - 1, 0) : after + 1]
        i = max(after - 1, 0) + int(np.argmax(self._told(imu, about).gain))
        return jump.at(jump.moment, self._witness(imu, t, i))

    def shown_from(self, imu: int, known: Array, variance: float) -> Array | None:
        """Sizes (3,) from which half of the jumps of one accelerometer would have been found.

        Args:
            imu: which.
            known: (3,) information of GPS about a jump.
            variance: of GPS over what its sums say.
        """
        t = self._asked(imu)
        if not len(t):
            return None
        information = np.median(self._told(imu, t).information, axis=0)
        n, size = len(t), np.geomspace(1e-3, LARGEST, 200)[:, None]
        by_gps = size**2 * known / max(variance, 1.0)
        by_others = n * np.log1p(information * size**2 / n)
        found = by_gps + by_others >= needed(3, n)
        found &= by_gps + (by_others if len(self.imus) > 2 else 0.0) > CLEARLY
        out: Array = np.where(found.any(axis=0), size[np.argmax(found, axis=0), 0], np.inf)
        return out

    def _asked(self, imu: int) -> Array:
        """Beginnings of windows at which a jump is looked for; none without companions."""
        mine = [pair.t for names, pair in self._pairs.items() if imu in names]
        if not mine:
            return np.zeros(0)
        t = max(mine, key=len)
        out: Array = t[EDGE : int(np.searchsorted(t, t[-1] - CONTACT_S))]
        return out

    def _witness(self, imu: int, t: Array, i: int) -> Witness:
        told = self._told(imu, t)
        others = max(float(self._told(b, t).gain[i]) for b in self.imus if b != imu)
        gain, sigma = float(told.gain[i]), 1.0 / np.sqrt(told.information[i] + LARGEST**-2)
        # They are compared with the scales in force: what is read by a wrong one is as wrong.
        sigma = np.hypot(sigma, told.size[i] * self._scale_sigma[imu])
        return Witness(gain, len(t), gain - others, told.size[i], sigma)

    def _told(self, imu: int, t: Array) -> _Told:
        """By jumps of one accelerometer at n moments.

        A pair in which another size would be best gives up what that explains more; the level of
        its noise is found with it, so that is a logarithm.
        """
        told = []
        for (a, b), pair in self._pairs.items():
            if imu in (a, b):
                gain, size, before, information = pair.on(t)
                sign = 1.0 if imu == a else -1.0
                told.append((gain, sign * size, sign * before, information, len(pair.t)))
        known = np.sum([information for *_, information, _ in told], axis=0)
        mean, partial = (
            np.sum([x[3] * x[which] for x in told], axis=0) / np.maximum(known, LARGEST**-2)
            for which in (1, 2)
        )
        gained = np.zeros(len(t))
        for gain, size, _, information, n in told:
            lost = n * np.log1p(information * (size - mean) ** 2 / n)
            gained += np.sum(gain - lost, axis=-1)
        early = np.sum(known * partial * mean, axis=-1) / np.sum(known * mean**2 + TINY, axis=-1)
        share = 2.0 / len(self.imus)
        return _Told(share * gained, mean, share * known, np.clip(early, 0.0, 1.0))


def _steady(windows: SharedWindows, a: Companion, b: Companion) -> _Pair:
    """The pair without windows that are odd by themselves.

    A launch or a bump shakes two accelerometers otherwise, and streams of few samples do not show
    it.  At the ends of a flight, where few windows are to one side, it looks like a jump.  So a
    window that is odd by no chance is no part of the series, unless a jump explains more than it.
    """
    while True:
        pair = _pair(windows, a, b)
        gain, odd = (
            np.sum([getattr(axis, name) for axis in pair.axes], axis=0) for name in ("gain", "odd")
        )
        most = float(np.max(gain[EDGE:], initial=0.0))
        kept = np.array([x <= most or surprise(x, 3, len(odd)) < least() for x in odd.tolist()])
        if kept.all() or kept.sum() < FEWEST_WINDOWS:
            return pair
        windows = windows.where(kept)


def _pair(windows: SharedWindows, a: Companion, b: Companion) -> _Pair:
    felt_a = a.before[:3] * windows.raw_a + a.before[3:]
    felt_b = b.before[:3] * windows.raw_b + b.before[3:]
    y = felt_a - felt_b - windows.lever
    agreed = 0.5 * (felt_a + felt_b + windows.lever)
    sigma = np.hypot(a.prior_sigma, b.prior_sigma)
    drift = np.linspace(-0.5, 0.5, len(windows))
    axes = []
    for j in range(3):
        H = np.column_stack([agreed[:, j], np.ones(len(windows)), windows.swing[:, j], drift])
        prior = [sigma[j], sigma[3 + j], *(MISPLACED_M,) * 3, LARGEST]
        axes.append(steps_in(y[:, j], H, np.array(prior) ** -2.0, PAIR_NOISE_FLOOR))
    x, y_, z = axes
    return _Pair(windows.t, (x, y_, z))
