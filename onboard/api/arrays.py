"""A flight as numpy columns: for whoever keeps flights in something else than a recording."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from onboard.api import units
from onboard.api.columns import clock, column, optional, order, vectors
from onboard.core.inputs.samples import ImuSource, ParameterValue, Sample
from onboard.core.maths.arrays import Array
from onboard.errors import ArraysError

SOURCES = tuple(source.value for source in ImuSource)
MOST_ROLL = 2.0 * np.pi
"""rad, and of longitude: either of the usual ranges."""
MOST_PITCH = 0.5 * np.pi
"""rad, and of latitude."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Inertial:
    """One accelerometer, with the gyroscope beside it.

    Any sequences of numbers may be given; they become arrays of double precision.  Values that are
    not finite are refused by the estimator and counted, not here.

    Attributes:
        t: (n,) time, s; any origin, the same for all of the flight; it must not go back.
        f_b: (n, 3) specific force, m/s^2, forward, right, down (at rest about 0, 0, -9.8), as the
            autopilot reports it: with its INS_ACC* parameters applied.
        w_b: (n, 3) angular rate, rad/s, the same axes; NaN, or None, where there is none.
        temperature: (n,) of the sensor, degrees Celsius; None: not known.
        imu: which accelerometer, 1 to 5.
        f_step: step to which ``f_b`` was truncated, m/s^2; 0: it was not.
        w_step: the same of ``w_b``, rad/s.
        source: the message it came with; where there are several, one is chosen.
        arrived: (n,) place in the order of arrival, rising over all that the flight has; None: at
            its time.

    Raises:
        ArraysError: a shape that cannot be; names the column.
    """

    t: Array
    f_b: Array
    w_b: Array | None = None
    temperature: Array | None = None
    imu: int = 1
    f_step: float = 0.0
    w_step: float = 0.0
    source: str = ImuSource.LOG.value
    arrived: Array | None = None

    def __post_init__(self) -> None:
        name = f"inertial {self.imu}"
        if self.imu not in range(1, 6):
            raise ArraysError(f"imu is {self.imu!r}, expected 1 to 5")
        if self.source not in SOURCES:
            raise ArraysError(f"{name}: source is {self.source!r}, expected {', '.join(SOURCES)}")
        rows = _clock(self, name)
        _put(self, "f_b", vectors(f"{name}, f_b", self.f_b, rows))
        if self.w_b is not None:
            _put(self, "w_b", vectors(f"{name}, w_b", self.w_b, rows))
        _put(self, "temperature", optional(f"{name}, temperature", self.temperature, rows))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Attitude:
    """The autopilot's attitude (or that of any other estimator) at its own times.

    Attributes:
        t: (n,) time, s.
        roll: (n,) rad.
        pitch: (n,) rad.
        yaw: (n,) rad, from true north.
        arrived: (n,) as of :class:`Inertial`.

    Raises:
        ArraysError: a shape that cannot be; names the column.
    """

    t: Array
    roll: Array
    pitch: Array
    yaw: Array
    arrived: Array | None = None

    def __post_init__(self) -> None:
        rows = _clock(self, "attitude")
        for name in ("roll", "pitch", "yaw"):
            _put(self, name, column(f"attitude, {name}", getattr(self, name), rows))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Velocity:
    """Fixes of one receiver, or of anything else that measures the velocity over ground.

    Attributes:
        t: (n,) time, s, as it is stamped: a latency is found.
        v_n: (n, 3) velocity north, east, down, m/s; down may be NaN: not measured.
        latitude: (n,) rad.  Without latitude and longitude the place follows from the velocity.
        longitude: (n,) rad.
        altitude: (n,) above the sea, m; None: from the velocity.
        speed_accuracy: (n,) the receiver's own sigma of the velocity, m/s; NaN or None: not known.
        hdop: (n,) horizontal dilution of precision; NaN or None: not known.
        satellites: (n,) number; NaN or None: not known.
        fix_type: (n,) as MAVLink counts it: 3 and more is a fix in space; None: 3.
        t_receiver: (n,) the receiver's own time of the fix, s, any origin; None: not known.
        t_message: (n,) time from which the autopilot counts the latency, s; None: ``t``.
        receiver: which one, from 0.
        speed_step: step to which the horizontal speed was truncated, m/s; 0: it was not.
        arrived: (n,) as of :class:`Inertial`.

    Raises:
        ArraysError: a shape that cannot be; names the column.
    """

    t: Array
    v_n: Array
    latitude: Array | None = None
    longitude: Array | None = None
    altitude: Array | None = None
    speed_accuracy: Array | None = None
    hdop: Array | None = None
    satellites: Array | None = None
    fix_type: Array | None = None
    t_receiver: Array | None = None
    t_message: Array | None = None
    receiver: int = 0
    speed_step: float = 0.0
    arrived: Array | None = None

    def __post_init__(self) -> None:
        rows = _clock(self, "velocity")
        _put(self, "v_n", vectors("velocity, v_n", self.v_n, rows))
        for name in OPTIONAL:
            _put(self, name, optional(f"velocity, {name}", getattr(self, name), rows))
        if (self.latitude is None) != (self.longitude is None):
            raise ArraysError("velocity: latitude and longitude belong together")


OPTIONAL = ("latitude", "longitude", "altitude", "speed_accuracy", "hdop", "satellites",
            "fix_type", "t_receiver", "t_message")  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What else a recording told: states, parameters, flags, in the estimator's own records.

    Attributes:
        samples: the records.
        arrived: (n,) their places in the order of arrival.
        duration_s: length of the recording, s.
        damage: what was skipped, in words.
        notes: what was chosen, in words.
    """

    samples: tuple[Sample, ...]
    arrived: Array
    duration_s: float
    damage: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def parameters(self) -> dict[str, float]:
        """The autopilot's parameters as they were reported last, by name."""
        return {s.name: s.value for s in self.samples if isinstance(s, ParameterValue)}


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Arrays:
    """A flight as columns: what every function here takes in place of a file.

    Columns of your own are checked for units and frames as far as physics allows: gravity must come
    out of force and attitude, a gyroscope must turn as the attitude does.  What :meth:`read` takes
    from a recording stays as the recording has it, order of arrival included, and gives the same
    answer as the file.

    Attributes:
        inertial: one for each accelerometer.
        attitude: of the vehicle.
        velocity: one for each receiver.
        parameters: the autopilot's by name, in force from the beginning: INS_ACC* and the filters.
            What is not given is taken as ArduPilot's default, so give ``INS_ACCEL_FILTER`` and
            ``INS_GYRO_FILTER`` as 0 for samples that went through no filter.
        vehicle: ``copter``, ``plane``, ... or empty.
        autopilot: ``ardupilot``, ``px4`` or ``unknown``; only the first has parameters to set.
        airborne: whether all of it is flight: then :func:`onboard.match` looks for no ground.
        name: what results and reports call it.
        told: what else a recording told; None for columns of your own.

    Raises:
        ArraysError: a unit, a frame or a time that cannot be; names the column.
    """

    inertial: Inertial | Sequence[Inertial]
    attitude: Attitude
    velocity: Velocity | Sequence[Velocity]
    parameters: Mapping[str, float] = field(default_factory=dict)
    vehicle: str = ""
    autopilot: str = "ardupilot"
    airborne: bool = False
    name: str = "arrays"
    told: Told | None = None

    def __post_init__(self) -> None:
        _put(self, "inertial", _several("inertial", self.inertial, Inertial))
        _put(self, "velocity", _several("velocity", self.velocity, Velocity))
        if not isinstance(self.attitude, Attitude):
            raise ArraysError(f"attitude is a {type(self.attitude).__name__}, expected Attitude")
        _put(self, "parameters", {str(k): float(v) for k, v in self.parameters.items()})
        if self.told is None:
            _check(self)

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Self:
        """The columns of a recording: .BIN, .tlog, .ulg.

        Raises:
            RecordingError: a file that cannot be used.
        """
        # The readers only when a file is asked for.
        from onboard.api.array_recording import columns_of  # noqa: PLC0415

        return cls(**columns_of(os.fspath(path)))


def accelerometers(arrays: Arrays) -> tuple[Inertial, ...]:
    """The inertial columns, however many were given."""
    given = arrays.inertial
    return (given,) if isinstance(given, Inertial) else tuple(given)


def receivers(arrays: Arrays) -> tuple[Velocity, ...]:
    """The velocity columns, however many were given."""
    given = arrays.velocity
    return (given,) if isinstance(given, Velocity) else tuple(given)


def _put(record: object, name: str, value: object) -> None:
    object.__setattr__(record, name, value)


def _clock(record: Inertial | Attitude | Velocity, name: str) -> int:
    """Check times and order; the number of rows."""
    rows = len(column(f"{name}, t", record.t))
    arrived = order(f"{name}, arrived", record.arrived, rows)
    _put(record, "arrived", arrived)
    _put(record, "t", clock(f"{name}, t", record.t, arrived))
    return rows


def _several(name: str, given: object, kind: type) -> tuple[object, ...]:
    out = (given,) if isinstance(given, kind) else given
    if not isinstance(out, Sequence) or not out or not all(isinstance(x, kind) for x in out):
        raise ArraysError(f"{name} is no {kind.__name__}, nor several of them")
    return tuple(out)


def _check(arrays: Arrays) -> None:
    """Units and frames of columns that nobody but their owner has looked at."""
    a = arrays.attitude
    if len(a.t) < units.FEWEST_ROWS:
        raise ArraysError(f"attitude: {len(a.t)} rows are no flight")
    units.check_angles("attitude, roll", a.roll, MOST_ROLL)
    units.check_angles("attitude, pitch", a.pitch, MOST_PITCH)
    for v in receivers(arrays):
        if len(v.t) < units.FEWEST_ROWS:
            raise ArraysError(f"velocity: {len(v.t)} rows are no flight")
        units.check_velocity("velocity, v_n", v.v_n)
        if v.latitude is not None and v.longitude is not None:
            units.check_angles("velocity, latitude", v.latitude, MOST_PITCH)
            units.check_angles("velocity, longitude", v.longitude, MOST_ROLL)
    euler = np.column_stack([a.roll, a.pitch, a.yaw])
    for i in accelerometers(arrays):
        name = f"inertial {i.imu}"
        units.check_clock(f"{name}, t", i.t)
        units.check_force(f"{name}, f_b", i.f_b)
        for other, its in [("attitude", a.t), *(("velocity", v.t) for v in receivers(arrays))]:
            if its[-1] < i.t[0] or its[0] > i.t[-1]:
                raise ArraysError(f"{name} and {other} have no time in common: one clock for all")
        units.check_together(a.t, euler, i.t, i.f_b, i.w_b)
