"""A flight as numpy columns: for whoever keeps flights in something else than a recording."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np

from onboard.api import units
from onboard.api.streams import Attitude, Inertial, Told, Velocity, put
from onboard.errors import ArraysError

MOST_ROLL = 2.0 * np.pi
"""rad, and of longitude: either of the usual ranges [definition]."""
MOST_PITCH = 0.5 * np.pi
"""rad, and of latitude [definition]."""


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
        put(self, "inertial", _several("inertial", self.inertial, Inertial))
        put(self, "velocity", _several("velocity", self.velocity, Velocity))
        if not isinstance(self.attitude, Attitude):
            raise ArraysError(f"attitude is a {type(self.attitude).__name__}, expected Attitude")
        put(self, "parameters", {str(k): float(v) for k, v in self.parameters.items()})
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


def _several(name: str, given: object, kind: type) -> tuple[object, ...]:
    out = (given,) if isinstance(given, kind) else given
    if not isinstance(out, Sequence) or not out or not all(isinstance(x, kind) for x in out):
        raise ArraysError(f"{name} is no {kind.__name__}, nor several of them")
    return tuple(out)


def _check(arrays: Arrays) -> None:
    """Units and frames of columns that nobody but their owner has looked at."""
    a = arrays.attitude
    units.check_rows("attitude", len(a.t))
    units.check_angles("attitude, roll", a.roll, MOST_ROLL)
    units.check_angles("attitude, pitch", a.pitch, MOST_PITCH)
    for v in receivers(arrays):
        units.check_rows("velocity", len(v.t))
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
