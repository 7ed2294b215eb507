"""Streams of a flight as numpy columns, each with times of its own."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.api.columns import clock, column, optional, order, vectors
from onboard.core.inputs.samples import ImuSource, ParameterValue, Sample
from onboard.core.maths.arrays import Array
from onboard.errors import ArraysError

SOURCES = tuple(source.value for source in ImuSource)
OPTIONAL = ("latitude", "longitude", "altitude", "speed_accuracy", "hdop", "satellites",
            "fix_type", "t_receiver", "t_message")  # fmt: skip
"""Of a velocity."""


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
        put(self, "f_b", vectors(f"{name}, f_b", self.f_b, rows))
        if self.w_b is not None:
            put(self, "w_b", vectors(f"{name}, w_b", self.w_b, rows))
        put(self, "temperature", optional(f"{name}, temperature", self.temperature, rows))


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
            put(self, name, column(f"attitude, {name}", getattr(self, name), rows))


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
        put(self, "v_n", vectors("velocity, v_n", self.v_n, rows))
        for name in OPTIONAL:
            put(self, name, optional(f"velocity, {name}", getattr(self, name), rows))
        if (self.latitude is None) != (self.longitude is None):
            raise ArraysError("velocity: latitude and longitude belong together")


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


def put(record: object, name: str, value: object) -> None:
    """Set a field of a frozen record while it is made."""
    object.__setattr__(record, name, value)


def _clock(record: Inertial | Attitude | Velocity, name: str) -> int:
    """Check times and order; the number of rows."""
    rows = len(column(f"{name}, t", record.t))
    arrived = order(f"{name}, arrived", record.arrived, rows)
    put(record, "arrived", arrived)
    put(record, "t", clock(f"{name}, t", record.t, arrived))
    return rows
