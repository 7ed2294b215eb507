"""Columns as a recording that the estimator reads, and a recording as columns."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from heapq import merge
from pathlib import Path
from typing import Any, Final

import numpy as np

from onboard.api.arrays import Arrays, accelerometers, receivers
from onboard.api.streams import Attitude, Inertial, Told, Velocity
from onboard.core.inputs.samples import (
    AttitudeSample,
    GpsFix,
    ImuSample,
    ImuSource,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.core.maths.arrays import Array
from onboard.recordings.opening import open_recording
from onboard.recordings.recording import Recording, elapsed_s

EARTH_RADIUS_M: Final = 6_371_000.0
ORIGIN: Final = (math.radians(47.0), math.radians(8.0))
"""Where a flight is that does not say it, rad: the middle latitudes' turning of the earth."""
NOTHING, NO_VECTORS = np.zeros(0), np.zeros((0, 3))
Placed = tuple[float, Sample]


def recording_of(arrays: Arrays, name: str = "") -> Recording:
    """Columns as a recording that can be read again and again."""
    inertial, fixes, told = accelerometers(arrays), receivers(arrays), arrays.told
    counts = {f"inertial {imu}": 0 for imu in sorted({i.imu for i in inertial})}
    for i in inertial:
        counts[f"inertial {i.imu}"] += len(i.t)
    counts |= {"attitude": len(arrays.attitude.t), "velocity": sum(len(v.t) for v in fixes)}
    return Recording(
        Path(name or arrays.name),
        "arrays",
        arrays.autopilot,
        max(elapsed_s(i.t) for i in inertial) if told is None else told.duration_s,
        counts,
        lambda: _samples(arrays),
        damage=() if told is None else told.damage,
        notes=() if told is None else told.notes,
        airborne=arrays.airborne,
    )


def columns_of(path: str) -> dict[str, Any]:
    """What :class:`Arrays` is made of, from a recording.

    Raises:
        RecordingError: a file that cannot be used.
    """
    recording = open_recording(path)
    inertial: dict[tuple[int, ImuSource, float, float], list[tuple[int, ImuSample]]] = {}
    fixes: dict[tuple[int, float], list[tuple[int, GpsFix]]] = {}
    attitude: list[tuple[int, AttitudeSample]] = []
    rest: list[tuple[int, Sample]] = []
    kind = ""
    for place, s in enumerate(recording.samples()):
        if isinstance(s, ImuSample):
            inertial.setdefault((s.imu, s.source, s.f_step, s.w_step), []).append((place, s))
        elif isinstance(s, GpsFix):
            fixes.setdefault((s.receiver, s.speed_step), []).append((place, s))
        elif isinstance(s, AttitudeSample):
            attitude.append((place, s))
        else:
            rest.append((place, s))
            kind = (s.kind or kind) if isinstance(s, VehicleState) else kind
    return {
        "inertial": [_inertial(rows) for _, rows in sorted(inertial.items(), key=lambda x: x[0][0])]
        or [Inertial(t=NOTHING, f_b=NO_VECTORS, arrived=NOTHING)],
        "attitude": Attitude(
            t=_column(attitude, "t"),
            roll=_column(attitude, "roll"),
            pitch=_column(attitude, "pitch"),
            yaw=_column(attitude, "yaw"),
            arrived=_places(attitude),
        ),
        "velocity": [_velocity(rows) for _, rows in sorted(fixes.items())]
        or [Velocity(t=NOTHING, v_n=NO_VECTORS, arrived=NOTHING)],
        "vehicle": kind,
        "autopilot": recording.autopilot,
        "airborne": recording.airborne,
        "name": path,
        "told": Told(
            tuple(s for _, s in rest),
            _places(rest),
            recording.duration_s,
            recording.damage,
            recording.notes,
        ),
    }


def _inertial(rows: Sequence[tuple[int, ImuSample]]) -> Inertial:
    first = rows[0][1]
    nothing = (math.nan,) * 3
    w_b = np.array([s.w_b or nothing for _, s in rows])
    temperature = _column(rows, "temperature")
    return Inertial(
        t=_column(rows, "t"),
        f_b=np.array([s.f_b for _, s in rows]),
        w_b=None if np.isnan(w_b).all() else w_b,
        temperature=None if np.isnan(temperature).all() else temperature,
        imu=first.imu,
        f_step=first.f_step,
        w_step=first.w_step,
        source=first.source.value,
        arrived=_places(rows),
    )


def _velocity(rows: Sequence[tuple[int, GpsFix]]) -> Velocity:
    first = rows[0][1]
    known = {
        name: _column(rows, name)
        for name in ("speed_accuracy", "hdop", "satellites", "t_receiver", "t_message")
    }
    return Velocity(
        t=_column(rows, "t"),
        v_n=np.column_stack([_column(rows, name) for name in ("v_n", "v_e", "v_d")]),
        latitude=_column(rows, "latitude"),
        longitude=_column(rows, "longitude"),
        altitude=_column(rows, "altitude"),
        fix_type=_column(rows, "fix_type"),
        receiver=first.receiver,
        speed_step=first.speed_step,
        arrived=_places(rows),
        **{name: None if np.isnan(x).all() else x for name, x in known.items()},
    )


def _column(rows: Sequence[tuple[int, Sample]], name: str) -> Array:
    """(n,) values of one field, NaN where there is none."""
    values = (getattr(s, name) for _, s in rows)
    return np.array([math.nan if v is None else v for v in values], dtype=np.float64)


def _places(rows: Sequence[tuple[int, object]]) -> Array:
    return np.array([place for place, _ in rows], dtype=np.float64)


def _samples(arrays: Arrays) -> Iterator[Sample]:
    """Everything in the order of arrival where all of it has one, else in order of time."""
    a, told = arrays.attitude, arrays.told
    inertial, fixes = accelerometers(arrays), receivers(arrays)
    its = [a.arrived, *(i.arrived for i in inertial), *(v.arrived for v in fixes)]
    ordered = told is not None and all(arrived is not None for arrived in its)
    streams: list[Iterator[Placed]] = [
        _placed(a.t, a.arrived if ordered else None, _attitudes(a)),
        *(_placed(i.t, i.arrived if ordered else None, _forces(i)) for i in inertial),
        *(_placed(v.t, v.arrived if ordered else None, _fixes(v)) for v in fixes),
    ]
    if told is not None:
        times = [-math.inf if s.t is None else s.t for s in told.samples]
        places = told.arrived.tolist() if ordered else times
        streams.append(iter(sorted(zip(places, told.samples, strict=True), key=_place)))
    begin: list[Sample] = [ParameterValue(n, v) for n, v in arrays.parameters.items()]
    if told is None:
        first = min(float(i.t[0]) for i in inertial)
        begin.append(VehicleState(first, armed=True, kind=arrays.vehicle))
    return itertools.chain(begin, (s for _, s in merge(*streams, key=_place)))


def _place(placed: Placed) -> float:
    return placed[0]


def _placed(t: Array, arrived: Array | None, samples: Iterator[Sample]) -> Iterator[Placed]:
    return zip((t if arrived is None else arrived).tolist(), samples, strict=True)


def _attitudes(a: Attitude) -> Iterator[Sample]:
    rows = zip(a.t.tolist(), a.roll.tolist(), a.pitch.tolist(), a.yaw.tolist(), strict=True)
    return itertools.starmap(AttitudeSample, rows)


def _forces(i: Inertial) -> Iterator[Sample]:
    n, source = len(i.t), ImuSource(i.source)
    rates = [None] * n if i.w_b is None else [None if _absent(w) else (*w,) for w in i.w_b.tolist()]
    heat = _optional(i.temperature, n)
    for t, f, w, c in zip(i.t.tolist(), i.f_b.tolist(), rates, heat, strict=True):
        yield ImuSample(t, i.imu, (f[0], f[1], f[2]), w, c, i.f_step, i.w_step, source)


def _fixes(v: Velocity) -> Iterator[Sample]:
    n = len(v.t)
    latitude, longitude, altitude = _place_of(v)
    kinds = np.full(n, 3.0) if v.fix_type is None else v.fix_type
    rest = (v.t_receiver, v.satellites, v.hdop, v.speed_accuracy, v.t_message)
    rows = zip(
        *(x.tolist() for x in (v.t, kinds, latitude, longitude, altitude, v.v_n)),
        *(_optional(x, n) for x in rest),
        strict=True,
    )
    for t, kind, lat, lon, height, (north, east, down), own, seen, hdop, sigma, stamp in rows:
        yield GpsFix(
            t,
            v.receiver,
            int(kind) if math.isfinite(kind) else 0,
            lat,
            lon,
            height,
            north,
            east,
            None if math.isnan(down) else down,
            own,
            None if seen is None else int(seen),
            hdop,
            sigma,
            v.speed_step,
            stamp,
        )


def _place_of(v: Velocity) -> tuple[Array, Array, Array]:
    """Latitude, longitude and altitude (n,): as given, else where the velocity leads."""
    way = np.cumsum(np.nan_to_num(v.v_n) * np.diff(v.t, prepend=v.t[:1])[:, None], axis=0)
    latitude, longitude, altitude = v.latitude, v.longitude, v.altitude
    if latitude is None or longitude is None:
        latitude = ORIGIN[0] + way[:, 0] / EARTH_RADIUS_M
        longitude = ORIGIN[1] + way[:, 1] / (EARTH_RADIUS_M * math.cos(ORIGIN[0]))
    return latitude, longitude, -way[:, 2] if altitude is None else altitude


def _absent(w: Sequence[float]) -> bool:
    return all(map(math.isnan, w))


def _optional(x: Array | None, rows: int) -> list[float | None]:
    if x is None:
        return [None] * rows
    return [None if math.isnan(value) else value for value in x.tolist()]
