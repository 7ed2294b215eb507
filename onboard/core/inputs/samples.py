"""What the core eats: frozen records of one measurement each, already in SI units.

The decoders of live MAVLink, of .tlog, of DataFlash and of ULog files all produce these,
in the order of arrival.  ``t`` is always the autopilot's boot clock *as stamped by the
autopilot* (s); nothing is corrected for delay before it gets here.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias

from onboard.core.inputs.limits import TOUCHED_S
from onboard.core.maths.arrays import Vector3


class ImuSource(Enum):
    """Where an inertial sample came from; decides which stream is preferred."""

    RAW_IMU = "RAW_IMU"
    HIGHRES_IMU = "HIGHRES_IMU"
    SCALED_IMU = "SCALED_IMU"
    LOG = "log"


COARSE: Final = (ImuSource.RAW_IMU, ImuSource.SCALED_IMU)
"""In integers.  ArduPilot's HIGHRES_IMU is of the first accelerometer that is used and healthy,
which may be any (INS_USE): beside it none of these is taken of that one."""


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Accelerometer and gyroscope of one IMU, body frame, as the autopilot reports them.

    ``f_b`` is already corrected with the autopilot's INS_ACC* parameters in force (the core
    undoes them).  ``f_step`` / ``w_step`` is the step of an integer field that was
    *truncated toward zero* (RAW_IMU: 9.80665e-3 m/s^2 and 1e-3 rad/s), 0 for floats.
    """

    t: float
    imu: int
    f_b: Vector3
    w_b: Vector3 | None = None
    temperature: float | None = None
    f_step: float = 0.0
    w_step: float = 0.0
    source: ImuSource = ImuSource.LOG


@dataclass(frozen=True, slots=True)
class AttitudeSample:
    """The autopilot's attitude solution (rad), as reported: ArduPilot's is minus AHRS_TRIM.

    ``turned`` says that the trim was taken off by turning the body, not angle by angle.
    """

    t: float
    roll: float
    pitch: float
    yaw: float
    turned: bool = False


FIX_3D = 3
"""GPS_FIX_TYPE of MAVLink, from which a receiver knows where it is, and how high [data sheet]."""


@dataclass(frozen=True, slots=True)
class GpsFix:
    """One report of a GPS receiver.  Repeats of a fix are passed on; the core drops them.

    ``t_receiver`` is the receiver's own time of the epoch (s, any origin; DataFlash GMS).
    ``t_message`` (s, boot clock) is the time from which the autopilot counts the receiver's latency
    where ``t`` is another one (DataFlash GPA.SMS); None: that is ``t``, or not known.
    ``v_d`` is None where the message has no vertical speed (GPS_RAW_INT).  ``speed_step``
    is the step (m/s) to which the horizontal speed was truncated, 0 if it was not.
    ``speed_accuracy`` is the receiver's own sigma of velocity; None or 0: unknown.
    """

    t: float
    receiver: int
    fix_type: int
    latitude: float
    longitude: float
    altitude: float
    v_n: float
    v_e: float
    v_d: float | None = None
    t_receiver: float | None = None
    satellites: int | None = None
    hdop: float | None = None
    speed_accuracy: float | None = None
    speed_step: float = 0.0
    t_message: float | None = None


@dataclass(frozen=True, slots=True)
class VehicleState:
    """Armed and landed flags; None where the source does not say.

    ``late_s`` is how late the word may be: it may have touched the ground so long before, s.
    ``kind`` is ``copter``, ``plane``, ``rover``, ...; empty where the source does not say.
    """

    t: float
    armed: bool | None = None
    landed: bool | None = None
    kind: str = ""
    late_s: float = TOUCHED_S


@dataclass(frozen=True, slots=True)
class EkfHealth:
    """EKF_STATUS_REPORT: flags as in the MAVLink enum (bit 15: GPS glitching)."""

    t: float
    flags: int


@dataclass(frozen=True, slots=True)
class GpsIntegrity:
    """Jamming and spoofing as the autopilot reports them, where it does."""

    t: float
    jammed: bool
    spoofed: bool


@dataclass(frozen=True, slots=True)
class Vibration:
    """VIBRATION / VIBE: standard deviation after a 5 Hz high-pass (m/s^2), clip counters per IMU.

    ``imu`` is None for MAVLink's message (primary accelerometer).
    """

    t: float
    level: Vector3
    clipping: tuple[int, ...] = ()
    imu: int | None = None


@dataclass(frozen=True, slots=True)
class Throttle:
    """Collective throttle or mean motor output, 0 ... 1."""

    t: float
    throttle: float


@dataclass(frozen=True, slots=True)
class AirData:
    """Airspeed (m/s) and wind (NED, m/s), each None where it is not known.

    ``airspeed`` is the equivalent one, what a pitot tube says in air of the density at sea level.
    ``wind_sigma`` is that of a wind that was measured, m/s; None: it is the autopilot's estimate.
    """

    t: float
    airspeed: float | None = None
    wind_n: float | None = None
    wind_e: float | None = None
    wind_sigma: float | None = None


@dataclass(frozen=True, slots=True)
class Battery:
    """Battery voltage (V) and current (A)."""

    t: float
    voltage: float
    current: float | None = None


@dataclass(frozen=True, slots=True)
class Outputs:
    """What the autopilot commands its motors and servos, by channel from the first.

    ``values`` are pulse widths, microseconds, 0 where a channel is not driven; with ``normalised``
    they are commands, 0 to 1 (of motors) and NaN where there is none.
    """

    t: float
    values: tuple[float, ...]
    normalised: bool = False


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """A parameter as the autopilot reported it; ``t`` is None where the message has no time."""

    name: str
    value: float
    t: float | None = None


@dataclass(frozen=True, slots=True)
class EkfBias:
    """The EKF's own accelerometer bias estimate for one core (DataFlash XKF2), m/s^2, body."""

    t: float
    core: int
    bias_b: Vector3


Sample: TypeAlias = (
    ImuSample
    | AttitudeSample
    | GpsFix
    | VehicleState
    | EkfHealth
    | GpsIntegrity
    | Vibration
    | Throttle
    | AirData
    | Battery
    | Outputs
    | ParameterValue
    | EkfBias
)
