"""Whether the quantities of a recording are of one motion, two by two.

Three sources tell each motion twice: the attitude turns by what the gyroscope reads, the velocity
changes by what the accelerometer feels along the world's axes, and the position moves by the
velocity.  No airframe and no air has a part in that, so that where two of them are further apart
than any sensor of the catalogue may be, one of them is not what it is said to be: another sign,
another order of columns, another unit, another frame.  A body that is turned the other way up is
consistent with itself; then rotors or wings would have to pull it down.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.earth import SEMI_MAJOR_AXIS, STANDARD_GRAVITY
from onboard.core.maths.frames import (
    interpolate_rotation,
    rotation_from_euler,
    vector_from_rotation,
)
from onboard.core.vehicle.limits import (
    ALIKE_SHARE,
    APART_FORCE_M_S2,
    APART_RATE_RAD_S,
    APART_SHARE,
    APART_SHARE_FORCE,
    APART_VELOCITY_M_S,
    FEWEST_APART,
    LAGS_S,
    LONGEST_GAP_S,
    LONGEST_SPAN_S,
    MOST_OUTLYING,
    MOTION_S,
    TURN_S,
)

BODY = ("forward", "right", "down")
WORLD = ("north", "east", "down")


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was recorded of a motion; rows in any order, (n, 1 + k): times, s, and quantities.

    Attributes:
        force: specific force, body axes, m/s^2.
        rates: rad/s.
        attitude: roll, pitch, yaw, rad.
        position: latitude and longitude, rad, height, m.
        velocity: NED, m/s; NaN where it is not measured.
    """

    force: Array
    rates: Array
    attitude: Array
    position: Array
    velocity: Array


@dataclass(frozen=True, slots=True)
class Pair:
    """One motion by two sources: (n, 3) each, over the same n spans.

    Attributes:
        first: by the one.
        second: by the other.
        names: of the two.
        axes: of what.
        unit: of them.
        floor: differences of sensors that are as they should be stay below this.
        share: of the squares of both, that the square of their difference is at most.
    """

    first: Array
    second: Array
    names: tuple[str, str]
    axes: tuple[str, str, str]
    unit: str
    floor: float
    share: float


@dataclass(frozen=True, slots=True)
class Disagreement:
    """Two quantities that are not of one motion, by how much, and what would make them agree."""

    names: tuple[str, str]
    axis: str
    size: float
    unit: str
    hint: str = ""

    def __str__(self) -> str:
        """As a part of a sentence."""
        by = f"{self.names[0]} and {self.names[1]} contradict each other"
        end = f": as if {self.hint}" if self.hint else ""
        return f"{by}, {self.axis} by {self.size:.2g} {self.unit} in the median{end}"


def disagreement(recorded: Recorded, *, derived: bool = False) -> Disagreement | None:
    """The first two quantities that are not of one motion; None where all are.

    Args:
        recorded: in flight or not: at rest all agree.
        derived: whether the force is the slope of the velocity.
    """
    for pair in (_ways(recorded), _turns(recorded)):
        if pair is not None and (found := _apart(pair)) is not None:
            return found
    # A receiver lags, and in gusts that is all there is to see: one lag must make them agree.
    pushes = [] if derived else [_apart(pair) for pair in _pushes(recorded)]
    apart = [found for found in pushes if found is not None]
    if apart and len(apart) == len(pushes):
        return min(apart, key=lambda found: found.size)
    return _overturned(recorded)


def _apart(pair: Pair) -> Disagreement | None:
    """The worst axis, if it is wrong in most of the spans that move, and not only at times."""
    worst: Disagreement | None = None
    for k, axis in enumerate(pair.axes):
        known = np.isfinite(pair.first[:, k] + pair.second[:, k])
        x, y = pair.first[known, k], pair.second[known, k]
        square = x * x + y * y
        moving = square > pair.floor**2
        off = np.abs(x - y)
        wrong = (off > pair.floor) & (off**2 > pair.share * square)
        many = max(0.5 * np.count_nonzero(moving), MOST_OUTLYING * len(x), FEWEST_APART)
        if np.count_nonzero(wrong) > many:
            size = float(np.median(off[wrong]))
            if worst is None or size > worst.size:
                worst = Disagreement(pair.names, axis, size, pair.unit, _hint(pair))
    return worst


def _hint(pair: Pair) -> str:
    """What would make the second what the first says; empty where nothing simple would."""
    there = [np.isfinite(x).any(axis=0) for x in (pair.first, pair.second)]
    places = np.flatnonzero(there[0] & there[1]).tolist()
    x, y = pair.first[:, places], pair.second[:, places]
    whole = np.isfinite(x + y).all(axis=1)
    x, y = x[whole], y[whole]
    if pair.names[0] == "force" and 2 in places and (said := _gravity(x - y)):
        return said
    sizes = [float(np.median(np.linalg.norm(v, axis=1))) for v in (x, y)]
    if min(sizes) < 0.1 * max(sizes):
        return f"the {pair.names[int(np.argmin(sizes))]} said that nothing moves"
    return _rearranged(x, y, [pair.axes[k] for k in places], pair.names)


def _gravity(off: Array) -> str:
    """What of gravity is wrong in the force, by how far it is off (n, 3), m/s^2; may be nothing."""
    times = abs(float(np.median(off[:, 2]))) / STANDARD_GRAVITY
    if abs(times - 1.0) < ALIKE_SHARE:
        return "kind of the force were the other one: gravity is in it twice, or not at all"
    if abs(times - 2.0) > ALIKE_SHARE:
        return ""
    if float(np.median(np.linalg.norm(off[:, :2], axis=1))) < APART_FORCE_M_S2:
        return "world were another frame: up is down in it"
    return "the force had the other sign"


def _rearranged(x: Array, y: Array, axes: Sequence[str], names: tuple[str, str]) -> str:
    """The signs, the order and the scale by which y (n, k) is x (n, k)."""
    best, words = ALIKE_SHARE, ""
    scale = float(np.sqrt(np.median(np.sum(y * y, axis=1)) / np.median(np.sum(x * x, axis=1))))
    size = float(np.sum(np.abs(x)) * max(scale, 1.0) + np.sum(np.abs(y)))
    for order in itertools.permutations(range(len(axes))):
        for signs in itertools.product((1.0, -1.0), repeat=len(axes)):
            for by in (1.0, scale):
                moved = by * x[:, list(order)] * np.array(signs)
                share = float(np.sum(np.abs(y - moved))) / size
                if share < best:
                    best, words = share, _words(order, signs, by, axes, names)
    return words


def _words(
    order: Sequence[int],
    signs: Sequence[float],
    by: float,
    axes: Sequence[str],
    names: tuple[str, str],
) -> str:
    """Of a rearrangement that is not the one that there is."""
    said, name = [], f"of the {names[1]}"
    if moved := [axes[k] for k, other in enumerate(order) if k != other]:
        said.append(f"{' and '.join(moved)} {name} were exchanged")
    if turned := [axes[k] for k, sign in enumerate(signs) if sign < 0.0]:
        said.append(f"{' and '.join(turned)} {name} had the other sign")
    if not 0.7 < by < 1.4:
        said.append(f"the unit {name} were {1.0 / by:.3g} of what it is said to be")
    return ", and ".join(said)


def _overturned(recorded: Recorded) -> Disagreement | None:
    """Rotors and wings carry along one way of the body's axis only: up."""
    f = recorded.force[:, 1:]
    carried = f[np.linalg.norm(f, axis=1) > 0.5 * STANDARD_GRAVITY]
    if len(carried) < FEWEST_APART or np.median(carried[:, 2]) < 0.0:
        return None
    size = float(np.median(carried[:, 2])) + STANDARD_GRAVITY
    hint = "body were the other frame: what carries it points to its underside"
    return Disagreement(("force", "what carries a vehicle"), "down", size, "m/s^2", hint)


def _turns(recorded: Recorded) -> Pair | None:
    """Mean rates over spans by the attitude and by the gyroscope."""
    attitude, rates = _ordered(recorded.attitude), _ordered(recorded.rates)
    spans = _spans(attitude[:, 0], TURN_S, rates[:, 0])
    if spans is None:
        return None
    early, late = spans
    R = rotation_from_euler(*attitude[:, 1:].T)
    start, end = attitude[early, 0], attitude[late, 0]
    turned = vector_from_rotation(np.swapaxes(R[early], -1, -2) @ R[late])
    by_gyro = _over(start, end, rates[:, 0], rates[:, 1:])
    by_attitude = turned / (end - start)[:, None]
    its = "rad/s", APART_RATE_RAD_S, APART_SHARE
    return Pair(by_attitude, by_gyro, ("attitude", "rates"), BODY, *its)


def _pushes(recorded: Recorded) -> Iterator[Pair]:
    """Mean accelerations over spans by the force, turned by the attitude, and by the velocity.

    One for each lag that a receiver may have; none if there is nothing to compare.
    """
    attitude, force = _ordered(recorded.attitude), _ordered(recorded.force)
    velocity = _ordered(recorded.velocity, level=True)
    if len(attitude) < 2:
        return
    inside = (force[:, 0] >= attitude[0, 0]) & (force[:, 0] <= attitude[-1, 0])
    t, f = force[inside, 0], force[inside, 1:]
    spans = _spans(velocity[:, 0], MOTION_S, t)
    if spans is None:
        return
    early, late = spans
    start, end = velocity[early, 0], velocity[late, 0]
    R = interpolate_rotation(t, attitude[:, 0], rotation_from_euler(*attitude[:, 1:].T))
    felt = np.einsum("nij,nj->ni", R, f) + np.array([0.0, 0.0, STANDARD_GRAVITY])
    changed = (velocity[late, 1:] - velocity[early, 1:]) / (end - start)[:, None]
    its = "m/s^2", APART_FORCE_M_S2, APART_SHARE_FORCE
    for lag in LAGS_S:
        pushed = _over(start - lag, end - lag, t, felt)
        yield Pair(pushed, changed, ("force", "velocity"), WORLD, *its)


def _ways(recorded: Recorded) -> Pair | None:
    """Mean velocities over spans by the position and by the velocity."""
    position, velocity = _ordered(recorded.position), _ordered(recorded.velocity, level=True)
    spans = _spans(position[:, 0], MOTION_S, velocity[:, 0], LONGEST_SPAN_S)
    if spans is None:
        return None
    early, late = spans
    start, end = position[early, 0], position[late, 0]
    shrunk = np.cos(np.median(position[:, 1]))
    place = np.column_stack(
        [
            SEMI_MAJOR_AXIS * position[:, 1],
            SEMI_MAJOR_AXIS * shrunk * position[:, 2],
            -position[:, 3],
        ]
    )
    if not np.ptp(place, axis=0)[:2].any():  # some recordings have one constant position
        return None
    moved = (place[late] - place[early]) / (end - start)[:, None]
    by_velocity = _over(start, end, velocity[:, 0], velocity[:, 1:])
    its = "m/s", APART_VELOCITY_M_S, APART_SHARE
    return Pair(moved, by_velocity, ("position", "velocity"), WORLD, *its)


def _ordered(rows: Array, *, level: bool = False) -> Array:
    """Rows in order of time, once each, where all of it is known; or what is level."""
    rows = rows[np.isfinite(rows[:, :3] if level else rows).all(axis=1)]
    _, first = np.unique(rows[:, 0], return_index=True)
    return rows[first]


def _spans(
    t: Array, length: float, within: Array, gap: float = LONGEST_GAP_S
) -> tuple[NDArray[np.intp], NDArray[np.intp]] | None:
    """First and last of samples t (n,), so far apart at least, where ``within`` has no gap."""
    if len(t) < 2 or len(within) < 2:
        return None
    ahead = np.searchsorted(t, t + (length - 1e-6))
    early, k = [], 0
    while k < len(t) and ahead[k] < len(t):
        early.append(k)
        k = int(ahead[k])
    first = np.array(early, dtype=np.intp)
    last = ahead[first]
    holes = np.concatenate([[0], np.cumsum(np.diff(within) > gap)])
    before = np.searchsorted(within, t[first], side="right") - 1
    after = np.searchsorted(within, t[last])
    there = (before >= 0) & (after < len(within)) & (t[last] - t[first] < LONGEST_SPAN_S)
    whole: Mask = there.copy()
    whole[there] = holes[before[there]] == holes[after[there]]
    return first[whole], last[whole]


def _over(start: Array, end: Array, t: Array, x: Array) -> Array:
    """(n, k) means of a signal x (m, k) from ``start`` (n,) to ``end`` (n,), by trapezes."""
    total = np.zeros_like(x)
    total[1:] = np.cumsum(0.5 * (x[1:] + x[:-1]) * np.diff(t)[:, None], axis=0)
    columns = [np.interp(end, t, c) - np.interp(start, t, c) for c in total.T]
    out: Array = np.stack(columns, axis=1) / (end - start)[:, None]
    return out
