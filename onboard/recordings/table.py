"""A table of any laboratory (CSV) as a recording, by a column map.

Motion capture, a simulator of one's own, another autopilot: whatever has time, attitude, specific
force and velocity or position can be asked.  An empty cell is no measurement, so that quantities of
different rates fit into one table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from heapq import merge
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    GpsFix,
    ImuSample,
    Outputs,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import (
    euler_from_rotation,
    interpolate_rotation,
    rotation_from_euler,
    rotation_from_quaternion,
    vector_from_rotation,
)
from onboard.core.vehicle.atmosphere import SEA_LEVEL_DENSITY, density
from onboard.core.vehicle.signals import RUDDER_FUNCTION, THROTTLE_FUNCTION
from onboard.errors import RecordingError
from onboard.recordings.recording import Recording, elapsed_s
from onboard.recordings.table_cells import FEWEST_ROWS, cells_of, word_in
from onboard.recordings.table_map import TableMap, load_map

EARTH_RADIUS_M = 6_371_000.0
SLOPE_S = 0.1
"""Span over which a position becomes a velocity, s: longer than the noise of motion capture,
shorter than a manoeuvre."""
TURN_S = 0.02
"""Span over which an attitude becomes rates, s, where there is no gyroscope."""
LONGEST_S = 3.2e7
"""A year: what lasts longer is no flight, but a cell that is no time [bound]."""
SMALLEST = 1e-6
"""Length of a quaternion that is none."""


@dataclass(frozen=True, slots=True)
class Track:
    """One quantity at its own times: ``t`` (n,) s, ``x`` (n, k)."""

    t: Array
    x: Array


def open_table(path: str | Path, columns: str | Path) -> Recording:
    """Open a CSV table with a column map.

    Raises:
        RecordingError: the table cannot be read, lacks a column, or holds too little; names both.
        ConfigurationError: the map cannot be used.
    """
    path, chosen = Path(path), load_map(columns)
    wanted = list(dict.fromkeys(c for q in chosen.quantities.values() for c in q.columns))
    cells, lines = cells_of(path, wanted)
    with np.errstate(all="ignore"):  # a cell may hold any number
        tracks = _tracks(path, cells, lines, chosen)
        samples = _samples(path, tracks, chosen)
    counts = {name: len(track.t) for name, track in tracks.items()}
    return Recording(
        path,
        "table",
        "unknown",
        elapsed_s(tracks["force"].t),
        counts,
        lambda: iter(samples()),
        notes=(f"columns as {Path(columns).name} says",),
        airborne=chosen.airborne,
        derived=chosen.derived,
    )


def _tracks(
    path: Path, cells: dict[str, Array], lines: Array, chosen: TableMap
) -> dict[str, Track]:
    """Each quantity in SI at the rows that have all of it, in order of time."""
    clock = chosen.quantities["time"]
    t = clock.factor * cells[clock.columns[0]]
    values = {
        name: quantity.factor * np.column_stack([cells[c] for c in quantity.columns])
        for name, quantity in chosen.quantities.items()
        if name != "time"
    }
    rows = {
        name: np.flatnonzero(np.isfinite(x).all(axis=1) & np.isfinite(t))
        for name, x in values.items()
    }
    _refuse_words(path, t, clock.columns[0])
    _forward(path, t, rows.values(), lines, clock.columns[0])
    out: dict[str, Track] = {}
    for name, x in values.items():
        its, first = np.unique(t[rows[name]], return_index=True)
        if name in ("attitude", "force", "velocity", "position") and len(its) < FEWEST_ROWS:
            where = ", ".join(chosen.quantities[name].columns)
            for k, column in enumerate(chosen.quantities[name].columns):
                _refuse_words(path, x[:, k], column)
            raise RecordingError(f"{path}: {len(its)} rows with a number in {where} are no flight")
        out[name] = Track(its, x[rows[name]][first])
    # The clock starts at zero: nanoseconds since 1970 would leave no digits for a difference.
    zero = min(float(track.t[0]) for track in out.values() if len(track.t))
    out = {name: Track(track.t - zero, track.x) for name, track in out.items()}
    where = ", ".join(clock.columns)
    if float(np.median(np.diff(out["force"].t))) > 1.0:
        raise RecordingError(f"{path}: rows over a second apart; is the unit of {where} right?")
    if max(float(track.t[-1]) for track in out.values() if len(track.t)) > LONGEST_S:
        raise RecordingError(f"{path}: a flight of more than a year by {where}")
    return out


def _refuse_words(path: Path, x: Array, column: str) -> None:
    """See to it that a column (n,) whose cells are hardly ever numbers is said to be of words."""
    if np.count_nonzero(np.isfinite(x)) < FEWEST_ROWS and (word := word_in(path, column)):
        raise RecordingError(
            f"{path}: {column} holds {word!r}, which is no number: decimals have a point, and "
            "times are numbers, not dates"
        )


def _forward(
    path: Path, t: Array, rows: Iterable[NDArray[np.intp]], lines: Array, clock: str
) -> None:
    """See to it that the time of no quantity goes back; each may stand in rows of its own.

    Sorted, the runs of a clock that began anew would be one flight of two vehicles.
    """
    back = [k[late] for k in rows if len(late := np.flatnonzero(np.diff(t[k]) < 0.0) + 1)]
    if back:
        line = lines[min(int(k[0]) for k in back)]
        raise RecordingError(
            f"{path}: line {line:.0f}: {clock} goes back: sort the rows by time, or cut the table "
            "where its clock begins anew"
        )


def _samples(
    path: Path, tracks: dict[str, Track], chosen: TableMap
) -> Callable[[], Iterator[Sample]]:
    """What reads the tracks as samples in order of time."""
    R_nb = _rotations(tracks["attitude"], chosen)
    t = tracks["attitude"].t
    fixes = _fixes(path, tracks, chosen)
    streams: list[list[Sample]] = [
        [VehicleState(0.0, armed=True, kind=chosen.vehicle)],
        # Without these, an ordinary autopilot's filters would be taken for granted.
        [
            ParameterValue("INS_ACCEL_FILTER", chosen.low_pass[0], 0.0),
            ParameterValue("INS_GYRO_FILTER", chosen.low_pass[1], 0.0),
        ],
        [
            AttitudeSample(float(a), float(e[0]), float(e[1]), float(e[2]))
            for a, e in zip(t, np.column_stack(euler_from_rotation(R_nb)), strict=True)
        ],
        _imu(tracks, Track(t, R_nb), chosen),
        [*fixes],
        _outputs(tracks, chosen),
        *_of_a_plane(tracks),
        _battery(tracks),
        _airspeeds(tracks, fixes, chosen),
    ]
    if "wind" in tracks:
        its = tracks["wind"]
        level = np.column_stack([its.x, np.zeros(len(its.x))]) @ chosen.world.T
        streams.append(
            [
                AirData(float(a), None, float(w[0]), float(w[1]), chosen.wind_sigma)
                for a, w in zip(its.t, level, strict=True)
            ]
        )
    return lambda: merge(*streams, key=lambda s: s.t or 0.0)


def _rotations(attitude: Track, chosen: TableMap) -> Array:
    """(n, 3, 3) forward-right-down to north-east-down."""
    if chosen.quaternion:
        q = attitude.x.copy()
        q[np.linalg.norm(q, axis=1) < SMALLEST, 0] = 1.0
        R = rotation_from_quaternion(q)
    else:
        R = rotation_from_euler(attitude.x[:, 0], attitude.x[:, 1], attitude.x[:, 2])
    if chosen.conjugate:
        R = np.swapaxes(R, -1, -2)
    out: Array = chosen.world @ R @ chosen.body.T
    return out


def _imu(tracks: dict[str, Track], attitude: Track, chosen: TableMap) -> list[Sample]:
    """Specific force and rates along forward, right, down."""
    force = tracks["force"]
    R_bn = np.swapaxes(interpolate_rotation(force.t, attitude.t, attitude.x), -1, -2)
    if chosen.force_in_world:
        f = np.einsum("nij,nj->ni", R_bn, force.x @ chosen.world.T)
    else:
        f = force.x @ chosen.body.T
    if chosen.kinematic:  # an accelerometer does not feel gravity, but what holds against it
        f = f - STANDARD_GRAVITY * R_bn[:, :, 2]
    w = _rates(tracks, attitude, chosen, force.t)
    return [
        ImuSample(float(a), 1, (float(b[0]), float(b[1]), float(b[2])),
                  (float(c[0]), float(c[1]), float(c[2])))
        for a, b, c in zip(force.t, f, w, strict=True)
    ]  # fmt: skip


def _rates(tracks: dict[str, Track], attitude: Track, chosen: TableMap, t: Array) -> Array:
    """(m, 3) rad/s at times (m,): the gyroscope's, or the slope of the attitude."""
    if "rates" in tracks and len(tracks["rates"].t) > 1:
        known, x = tracks["rates"].t, tracks["rates"].x @ chosen.body.T
    else:
        known = attitude.t
        at = np.searchsorted(known, known + TURN_S), np.searchsorted(known, known - TURN_S)
        late, early = (np.clip(k, 0, len(known) - 1) for k in at)
        turn = np.swapaxes(attitude.x[early], -1, -2) @ attitude.x[late]
        x = vector_from_rotation(turn) / np.maximum(known[late] - known[early], 1e-6)[:, None]
    return np.column_stack([np.interp(t, known, x[:, k]) for k in range(3)])


def _fixes(path: Path, tracks: dict[str, Track], chosen: TableMap) -> list[GpsFix]:
    """Velocity and place as a receiver would report them."""
    position = tracks.get("position")
    p = None if position is None else position.x @ chosen.world.T
    if "velocity" in tracks:
        t, v = tracks["velocity"].t, tracks["velocity"].x @ chosen.world.T
    elif position is not None and p is not None:
        t, v = _slope(position.t, p)
        if not len(t):
            where = ", ".join(chosen.quantities["position"].columns)
            raise RecordingError(f"{path}: {where} last too short for a velocity ({SLOPE_S:g} s)")
    else:
        return []
    keep = _thinned(t, chosen.fix_rate)
    t, v = t[keep], v[keep]
    if position is not None and p is not None:
        at = np.column_stack([np.interp(t, position.t, p[:, k]) for k in range(3)])
    else:  # heights matter for wind and density: the velocity's own way
        steps = np.diff(t, prepend=t[0])[:, None]
        at = np.cumsum(v * steps, axis=0)
    latitude, longitude = np.radians(chosen.origin[:2])
    altitude = chosen.origin[2]
    north = at[:, 0] / EARTH_RADIUS_M
    east = at[:, 1] / (EARTH_RADIUS_M * np.cos(latitude))
    return [
        GpsFix(float(a), 0, 3, float(latitude + north[k]), float(longitude + east[k]),
               altitude - float(at[k, 2]), float(v[k, 0]), float(v[k, 1]), float(v[k, 2]))
        for k, a in enumerate(t)
    ]  # fmt: skip


def _slope(t: Array, p: Array) -> tuple[Array, Array]:
    """Velocity at the middle of each span, by difference."""
    late = np.searchsorted(t, t + SLOPE_S)
    early = np.arange(len(t))
    there = late < len(t)
    early, late = early[there], late[there]
    span = t[late] - t[early]
    # A gap is no velocity: three times as long as a span at the rate of the table, or longer.
    whole = span < 3.0 * max(SLOPE_S, float(np.median(np.diff(t))))
    early, late, span = early[whole], late[whole], span[whole]
    return 0.5 * (t[late] + t[early]), (p[late] - p[early]) / span[:, None]


def _airspeeds(tracks: dict[str, Track], fixes: Sequence[GpsFix], chosen: TableMap) -> list[Sample]:
    """Equivalent airspeeds, which is what an autopilot's sensor tells."""
    its = tracks.get("airspeed")
    if its is None:
        return []
    v = its.x[:, 0]
    if chosen.true_airspeed:  # the same pressure at sea level, by the height that is flown
        height = np.interp(its.t, [f.t for f in fixes], [f.altitude for f in fixes])
        v = v * np.sqrt(density(height) / SEA_LEVEL_DENSITY)
    return [AirData(float(a), float(b)) for a, b in zip(its.t, v, strict=True)]


def _thinned(t: Array, rate: float) -> NDArray[np.intp]:
    """Indices of samples at no more than a rate (Hz)."""
    slot = np.floor((t - t[0]) * rate + 1e-6)
    return np.flatnonzero(np.concatenate([[True], np.diff(slot) > 0]))


def _outputs(tracks: dict[str, Track], chosen: TableMap) -> list[Sample]:
    its = tracks.get("motors")
    if its is None:
        return []
    x, normalised = its.x, chosen.quantities["motors"].unit != "us"
    if chosen.motor_range is not None:
        low, high = chosen.motor_range
        x, normalised = np.clip((x - low) / (high - low), 0.0, 1.0), True
    return [
        Outputs(float(a), tuple(float(c) for c in row), normalised)
        for a, row in zip(its.t, x, strict=True)
    ]


def _of_a_plane(tracks: dict[str, Track]) -> list[list[Sample]]:
    """Throttle and rudder as an autopilot's outputs would have them."""
    throttle, rudder = tracks.get("throttle"), tracks.get("rudder")
    if throttle is None or not len(throttle.t):
        return []
    there = rudder is not None and len(rudder.t) > 0
    turned = np.zeros(len(throttle.t))
    if rudder is not None and there:
        turned = np.interp(throttle.t, rudder.t, rudder.x[:, 0])
    named: list[Sample] = [ParameterValue("SERVO1_FUNCTION", THROTTLE_FUNCTION, 0.0)]
    if there:
        named.append(ParameterValue("SERVO2_FUNCTION", RUDDER_FUNCTION, 0.0))
    pulses = np.column_stack([1000.0 + 1000.0 * throttle.x[:, 0], 1500.0 + 500.0 * turned])
    return [
        named,
        [
            Outputs(float(t), (float(a), float(b)), normalised=False)
            for t, (a, b) in zip(throttle.t, pulses, strict=True)
        ],
    ]


def _battery(tracks: dict[str, Track]) -> list[Sample]:
    volts, amps = tracks.get("voltage"), tracks.get("current")
    if volts is None:
        return []
    current = None
    if amps is not None and len(amps.t) > 1:
        current = np.interp(volts.t, amps.t, amps.x[:, 0])
    return [
        Battery(float(a), float(v), None if current is None else float(current[k]))
        for k, (a, v) in enumerate(zip(volts.t, volts.x[:, 0], strict=True))
    ]
