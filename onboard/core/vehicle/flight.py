"""A flight on an even grid: what the models predict from, and the force that they must predict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array, Mask
from onboard.core.maths.spans import inside
from onboard.core.vehicle.atmosphere import density
from onboard.core.vehicle.limits import BLOCK_S, CONTACT_M_S2, FEWEST_BLOCKS, STEP_S
from onboard.core.vehicle.signals import COVERED, Signals, Stream
from onboard.core.vehicle.trajectory import Motion

_BY_STEP = (
    *("t", "piece", "f_b", "w_b", "R_bn", "v_b", "v_n", "height", "rho"),
    *("outputs", "commands", "battery", "airspeed", "ekf_wind", "measured_wind", "part"),
    *("place", "unsure", "shaken"),
)
"""Fields that have a value for each step."""
DRIFT = 3
"""Column of what is unsure that is the heading's."""
ROUNDING = 1e-6
"""Of a block: a recording that begins where one does is of that block, however numbers are rounded
[cost]."""


@dataclass(frozen=True, slots=True)
class History:
    """Commands at every step of a recording, those that are no part of the flight as well.

    What follows its command with a lag has a memory, which does not begin anew where steps of the
    flight are left out: ``commands`` (m, k), and ``piece`` (m,) as that of a :class:`Flight`.
    """

    commands: Array
    piece: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Flight:
    """Means over steps of :data:`~onboard.core.vehicle.limits.STEP_S`; n steps in the air.

    Attributes:
        t: (n,) middle of each step, s.
        piece: (n,) number of the uninterrupted piece that a step belongs to.
        f_b: (n, 3) specific force measured, m/s^2.
        w_b: (n, 3) rates, rad/s.
        R_bn: (n, 3, 3) NED to body.
        v_b: (n, 3) velocity over ground in body axes, m/s.
        v_n: (n, 3) the same, NED.
        height: (n,) above mean sea level, m.
        ground: height of the ground, m.
        rho: (n,) density of the standard atmosphere, kg/m^3.
        outputs: (n, k) pulse widths (or commands), or empty (n, 0).
        commands: (n, 3) of the motors: mean, mean square, and how evenly they share the thrust
            (:meth:`onboard.core.vehicle.copter.Outputs.commands`); or empty (n, 0).
        battery: (n, 2) voltage and current, or empty (n, 0).
        airspeed: (n,) as reported; NaN where there is none.
        ekf_wind: (n, 2) or empty (n, 0).
        velocity_sigma: of the velocity, m/s.
        attitude_sigma: (3,) of the attitude, about north, east and down, rad.
        measured_wind: (n, 3) towards north and east, and its sigma, m/s; or empty (n, 0).
        part: (n,) which of several recordings a step is of (:mod:`onboard.core.vehicle.several`).
        rest_volts: of the battery before the flight began, V; NaN where nobody saw it.
        unsure: (n, 4) a standard deviation of what the sensor level leaves of the force as the load
            changes, body axes, m/s^2, each with the load's sign, and of the heading as it drifts,
            rad.
        shaken: (n,) mean square of the force along z about its mean within a step, m^2/s^4.
        step_s: length of a step, s.
        ground_seen: whether it began or ended on the ground, so that heights above it are known.
        history: of the commands; None where they are those of the flight alone.
        place: (n,) of each step in the history.
        unheard_s: how long in the air commands or airspeed were not recorded, which is left out, s.
        dead_s: how long in the air the airspeed sensor repeated one reading, s.
        lost_s: how long in the air nobody knows its velocity, which is left out, s.
    """

    t: Array
    piece: NDArray[np.int64]
    f_b: Array
    w_b: Array
    R_bn: Array
    v_b: Array
    v_n: Array
    height: Array
    ground: float
    rho: Array
    outputs: Array
    commands: Array
    battery: Array
    airspeed: Array
    ekf_wind: Array
    velocity_sigma: float
    attitude_sigma: Array
    measured_wind: Array = field(default_factory=lambda: np.zeros((0, 0)))
    part: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    unsure: Array = field(default_factory=lambda: np.zeros((0, 4)))
    shaken: Array = field(default_factory=lambda: np.zeros(0))
    rest_volts: float = math.nan
    step_s: float = STEP_S
    ground_seen: bool = True
    history: History | None = None
    place: NDArray[np.int64] = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    unheard_s: float = 0.0
    dead_s: float = 0.0
    lost_s: float = 0.0

    def __post_init__(self) -> None:
        """One recording, in a wind that nobody measured, where nothing else is said."""
        n = len(self.t)
        if len(self.part) != n:
            object.__setattr__(self, "part", np.zeros(n, dtype=np.int64))
        if len(self.measured_wind) != n:
            object.__setattr__(self, "measured_wind", np.zeros((n, 0)))
        if len(self.unsure) != n:
            object.__setattr__(self, "unsure", np.zeros((n, 4)))
        if len(self.shaken) != n:
            object.__setattr__(self, "shaken", np.zeros(n))
        if len(self.place) != n:
            object.__setattr__(self, "place", np.arange(n))

    def __len__(self) -> int:
        return len(self.t)

    @property
    def parts(self) -> int:
        """How many recordings it is of."""
        return int(self.part[-1]) + 1

    def blocks_of(self, t: Array) -> NDArray[np.int64]:
        """Numbers of the blocks whose sums are kept at times (k,) of the flight, s.

        Blocks of a short flight are a whole part of the usual ones, so that recordings still begin
        where a block does: with one block there is no flight that a fit has not seen, and with a
        few nothing tells how much they scatter.
        """
        shorter = math.ceil(FEWEST_BLOCKS * BLOCK_S / (len(self) * self.step_s))
        at = (t - self.t[0]) * max(shorter, 1) / BLOCK_S
        out: NDArray[np.int64] = np.floor(at + ROUNDING).astype(np.int64)
        return out

    @property
    def since_start(self) -> Array:
        """(n,) s since the start of the recording that a step is of."""
        first = np.searchsorted(self.part, self.part)
        out: Array = self.t - self.t[first]
        return out

    @property
    def mean_heights(self) -> Array:
        """(n,) mean height above the ground of the recording that a step is of, m."""
        sums = np.bincount(self.part, self.height - self.ground)
        out: Array = (sums / np.maximum(np.bincount(self.part), 1))[self.part]
        return out

    def levelled(self) -> Flight:
        """The same path and heading, flown without a tilt.

        What a vehicle's axes would be if it had answered nothing: an autopilot leans into a gust at
        once, and is moved by it over seconds.
        """
        north, east = self.R_bn[:, 0, 0], self.R_bn[:, 0, 1]
        length = np.maximum(np.hypot(north, east), 1e-9)
        R_bn = np.zeros_like(self.R_bn)
        R_bn[:, 0, 0] = R_bn[:, 1, 1] = north / length
        R_bn[:, 0, 1], R_bn[:, 1, 0] = east / length, -east / length
        R_bn[:, 2, 2] = 1.0
        return replace(self, R_bn=R_bn, v_b=np.einsum("nij,nj->ni", R_bn, self.v_n))

    def cut(self, mask: Mask) -> Flight:
        """The steps (n,) that are True; a piece ends where some between them are left out.

        The noise's memory must not reach across.
        """
        out = self.kept(mask)
        breaks = (np.diff(out.t) > 1.5 * out.step_s) | (np.diff(out.piece) != 0)
        pieces = np.concatenate([[0], np.cumsum(breaks)])[: len(out)]
        return replace(out, piece=pieces.astype(np.int64))

    def kept(self, mask: Mask) -> Flight:
        """The steps (n,) that are True."""
        cut = {name: getattr(self, name)[mask] for name in _BY_STEP}
        return replace(self, **cut)


def flight_of(
    pieces: Sequence[Motion],
    signals: Signals,
    commands: Stream,
    grounded: list[tuple[float, float]],
    ground: float,
) -> Flight | None:
    """Flight on the grid, without what was near the ground; None if nothing is left.

    Args:
        pieces: motion at the accelerometer's samples.
        signals: of the vehicle.
        commands: of a copter's motors, as in :class:`Flight`; empty where there are none.
        grounded: spans on the ground, which are left out, s.
        ground: height of the ground, m.
    """
    parts: list[dict[str, Array]] = []
    for number, m in enumerate(pieces):
        part = _binned(m, signals, commands, number)
        if part is not None:
            parts.append(part)
    if not parts:
        return None
    joined = {name: np.concatenate([p[name] for p in parts]) for name in parts[0]}
    hit = np.linalg.norm(joined["f_b"], axis=1) > CONTACT_M_S2
    flown = ~inside(joined["t"], grounded) & ~hit
    lost = joined["lost"] > 0.0
    air = flown & ~lost & (joined["known"] > 0.0)
    dead = inside(joined["t"], list(signals.airspeed_dead))
    if not air.any():
        return None
    flight = Flight(
        ground=ground,
        ground_seen=bool(grounded),
        velocity_sigma=max(m.velocity_sigma for m in pieces),
        attitude_sigma=np.max([m.attitude_sigma for m in pieces], axis=0),
        piece=joined["piece"].astype(np.int64),
        t=joined["t"],
        f_b=joined["f_b"],
        w_b=joined["w_b"],
        R_bn=joined["R_bn"],
        v_b=joined["v_b"],
        v_n=joined["v_n"],
        height=joined["height"],
        rho=joined["rho"],
        outputs=joined["outputs"],
        commands=joined["commands"],
        battery=joined["battery"],
        airspeed=joined["airspeed"],
        ekf_wind=joined["ekf_wind"],
        measured_wind=joined["measured_wind"],
        unsure=joined["unsure"],
        shaken=joined["shaken"],
        rest_volts=_before(signals.battery, float(joined["t"][air][0])),
        history=History(joined["commands"], joined["piece"].astype(np.int64)),
        unheard_s=STEP_S * float(np.count_nonzero(flown & ~air & ~dead & ~lost)),
        dead_s=STEP_S * float(np.count_nonzero(flown & dead)),
        lost_s=STEP_S * float(np.count_nonzero(flown & lost)),
    )
    return flight.cut(air)


def _before(battery: Stream, t: float) -> float:
    """Median voltage before ``t``, V; NaN where there is none."""
    volts = battery.x[battery.t < t, 0]
    volts = volts[np.isfinite(volts)]
    return float(np.median(volts)) if len(volts) else math.nan


def _binned(m: Motion, signals: Signals, commands: Stream, number: int) -> dict[str, Array] | None:
    """Means of a piece's samples over the steps that have any."""
    m = m.finer(0.5 * STEP_S)
    which = np.floor((m.t - m.t[0]) / STEP_S).astype(np.int64)
    steps, first, counts = np.unique(which, return_index=True, return_counts=True)
    if len(steps) < 3:
        return None

    def mean(x: Array) -> Array:
        shape = (-1,) + (1,) * (x.ndim - 1)
        out: Array = np.add.reduceat(x, first, axis=0) / counts.reshape(shape)
        return out

    f_b, R_bn = mean(m.f_b), np.swapaxes(m.R_nb, -1, -2)
    v_b = np.einsum("nij,nj->ni", R_bn, m.v_n)
    height = mean(m.height)
    n = len(steps)
    streams = (
        *(signals.outputs, commands, signals.battery, signals.airspeed),
        *(signals.ekf_wind, signals.measured_wind),
    )
    # Speed through the air and commands are no straight lines over an outage.
    needed = [commands] if signals.kind == "copter" else [commands, signals.airspeed]
    there = [s.known(m.t) for s in needed]
    absent = [s for s, known in zip(needed, there, strict=True) if np.mean(known) <= COVERED]
    outages = [~known for known in there if np.mean(known) > COVERED]
    lost = np.any(outages, axis=0) if outages else np.zeros(len(m.t), dtype=bool)
    outputs, orders, battery, airspeed, wind, measured = (
        mean(s.at(m.t)) if s.covers(m.t) and not any(s is of for of in absent) else np.zeros((n, 0))
        for s in streams
    )
    return {
        "known": (mean(lost.astype(np.float64)) == 0.0).astype(np.float64),
        "lost": mean(m.lost.astype(np.float64)),
        "t": m.t[0] + (steps + 0.5) * STEP_S,
        "piece": np.full(n, float(number)),
        "f_b": f_b,
        "shaken": mean((m.f_b[:, 2] - np.repeat(f_b[:, 2], counts)) ** 2),
        "w_b": mean(m.w_b),
        "R_bn": mean(R_bn),
        "v_b": mean(v_b),
        "v_n": mean(m.v_n),
        "height": height,
        "rho": density(height),
        "outputs": outputs,
        "commands": orders,
        "battery": battery,
        "airspeed": airspeed[:, 0] if airspeed.shape[1] else np.full(n, np.nan),
        "ekf_wind": wind,
        "measured_wind": measured,
        "unsure": mean(np.column_stack([m.f_b * m.load_sigma, m.heading_drift])),
    }
