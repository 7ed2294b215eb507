"""Concealed effects: what can be wrong with a recording beyond the six numbers and the timing.

Names, unknowns and signs are those of the project's catalogue of effects: every number is the
*error of the recording* - what the sensor reads too much, how much too large the recorded
angle is, how late something is.  Each class changes exactly one thing, at sensor level on the
1 kHz grid, before filters and quantisation.  ``imu`` restricts an effect to one
accelerometer; 0 means all of them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, ClassVar, TypeAlias

Vector3: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effect:
    """Base of all: knows its catalogue name and how it is written in a truth record."""

    name: ClassVar[str] = ""

    def as_record(self) -> dict[str, Any]:
        """Name and unknowns, as a JSON object."""
        return {"name": self.name, **asdict(self)}


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsLatency(Effect):
    """Further latency of the receiver, on top of the declared one (s)."""

    name: ClassVar[str] = "gps_latency"
    delay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsSmoothing(Effect):
    """The receiver reports the mean over ``window`` seconds about the time of its fix."""

    name: ClassVar[str] = "gps_smoothing"
    window: float


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsLeverArm(Effect):
    """Antenna from the IMU, body axes, m, which no parameter tells."""

    name: ClassVar[str] = "gps_lever_arm"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ImuDelay(Effect):
    """How late the attitude is stamped against the accelerometer (s)."""

    name: ClassVar[str] = "imu_delay"
    delay: float


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossAxis(Effect):
    """``f += M f``, M without diagonal; ``xy`` is what x reads too much per unit along y."""

    name: ClassVar[str] = "cross_axis"
    xy: float = 0.0
    xz: float = 0.0
    yx: float = 0.0
    yz: float = 0.0
    zx: float = 0.0
    zy: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class MountTilt(Effect):
    """Recorded attitude is turned by (roll, pitch, 0) about body axes against the IMU (rad)."""

    name: ClassVar[str] = "mount_tilt"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerTilt(Effect):
    """The accelerometers alone are turned: gyroscopes and attitude stay as they are.

    As ArduPilot's SIM_ACC_TRIM of ``(-roll, -pitch)``: the force that is read is the true one
    turned by ``from_euler(-roll, -pitch, 0)`` transposed.  In the catalogue's sign: by how much
    the recorded attitude is too large for the accelerometer (rad).
    """

    name: ClassVar[str] = "mount_tilt"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardTilt(Effect):
    """The whole autopilot is turned in the airframe by (roll, pitch), rad: both sensors alike.

    No name of the catalogue: its own attitude fits its own sensors, and no flight shows it.  It is
    what AHRS_TRIM is for: a trim of the same angles makes the airframe's attitude of the board's.
    """

    name: ClassVar[str] = "board_tilt"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingError(Effect):
    """Recorded yaw is too large by ``yaw`` (rad)."""

    name: ClassVar[str] = "heading_error"
    yaw: float


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingByThrottle(Effect):
    """Recorded yaw is too large by this at full throttle, in proportion (rad)."""

    name: ClassVar[str] = "heading_by_throttle"
    yaw_per_throttle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TemperatureDrift(Effect):
    """``f += (x, y, z) (T - reference)``, m/s^2/K."""

    name: ClassVar[str] = "temperature_drift"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    reference: float = 35.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasRamp(Effect):
    """``f += (x, y, z) (t - t0)``, m/s^3, t0 the start of the recording."""

    name: ClassVar[str] = "bias_ramp"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasStep(Effect):
    """``f += (x, y, z)`` from ``time`` seconds after the start of the recording on, m/s^2."""

    name: ClassVar[str] = "bias_step"
    time: float
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleNonlinearity(Effect):
    """``f_i += c_i f_i^2 / g``, c in 1/g."""

    name: ClassVar[str] = "scale_nonlinearity"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationRectification(Effect):
    """``f_i += c_i vibe_i^2``, vibe as VIBRATION reports it, c in s^2/m."""

    name: ClassVar[str] = "vibration_rectification"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrottleCoupling(Effect):
    """``f += (x, y, z) throttle``, m/s^2 at full throttle."""

    name: ClassVar[str] = "throttle_coupling"
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Saturation(Effect):
    """The raw sensor clips at ``limit`` m/s^2."""

    name: ClassVar[str] = "saturation"
    limit: float
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class GpsFault(Effect):
    """Velocity too large by ``(north, east)`` between two times after the start (s, m/s)."""

    name: ClassVar[str] = "gps_fault"
    start: float
    end: float
    north: float = 0.0
    east: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClockSkew(Effect):
    """GPS becomes later by ``rate`` seconds a second, from the start of the recording."""

    name: ClassVar[str] = "clock_skew"
    rate: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Gravity(Effect):
    """Gravity is stronger than the standard 9.80665 by ``delta_g`` (m/s^2)."""

    name: ClassVar[str] = "gravity"
    delta_g: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadFlex(Effect):
    """Recorded tilt is too large by (roll, pitch) per g of load beyond one (rad)."""

    name: ClassVar[str] = "load_flex"
    roll: float = 0.0
    pitch: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class RotorDrag(Effect):
    """A multicopter's linear drag, 1/s; changes how it flies, not what sensors read."""

    name: ClassVar[str] = "rotor_drag"
    x: float
    y: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Nameless(Effect):
    """Something that no catalogue has: ``f += (x, y, z) s(t)``, for seeing what is said of it.

    ``term`` is the signal ``s``: ``dynamic_pressure`` (airspeed / 10 m/s)^2, ``roll_rate``
    rad/s, ``swing`` sin of 2 pi per 40 s, ``climb_rate`` m/s upwards.
    """

    name: ClassVar[str] = "nameless"
    term: str
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0


ALL: tuple[type[Effect], ...] = (
    GpsLatency,
    GpsSmoothing,
    GpsLeverArm,
    ImuDelay,
    CrossAxis,
    MountTilt,
    HeadingError,
    HeadingByThrottle,
    TemperatureDrift,
    BiasRamp,
    BiasStep,
    ScaleNonlinearity,
    VibrationRectification,
    ThrottleCoupling,
    Saturation,
    GpsFault,
    ClockSkew,
    Gravity,
    LoadFlex,
    RotorDrag,
)
