"""The autopilot's parameters as far as they change what its messages mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum
from math import inf
from typing import Final

import numpy as np

from onboard.core.inputs.reported_attitude import DCM_GAIN
from onboard.core.maths.accelerometer import SixParameters, parameter_names
from onboard.core.maths.arrays import Array, vector3
from onboard.core.maths.board_orientation import board_rotation, is_axis_aligned

DEFAULT_FILTER_HZ = 20.0


def receiver_names(receiver: int) -> dict[str, tuple[str, str]]:
    """Names of a receiver's parameters since ArduPilot 4.6, and before.

    Keys are ``TYPE``, ``DELAY_MS``, ``X``, ``Y`` and ``Z``.  Of what is blended from several there
    are none: it has those of the first.
    """
    k = receiver if receiver in (1, 2) else 1
    former = "" if k == 1 else f"{k}"
    place = {a: (f"GPS{k}_POS_{a}", f"GPS_POS{k}_{a}") for a in "XYZ"}
    return place | {n: (f"GPS{k}_{n}", f"GPS_{n}{former}") for n in ("TYPE", "DELAY_MS")}


class Until(Enum):
    """What has to happen before ArduPilot applies a parameter that was changed."""

    DISARMED = "disarmed"
    BOOT = "boot"


HELD: Final = {
    "AHRS_ORIENTATION": Until.DISARMED,  # AP_AHRS::update_orientation
    "EK3_PRIMARY": Until.DISARMED,  # NavEKF3::UpdateFilter: armed, errors choose the lane
    "EK3_IMU_MASK": Until.BOOT,  # NavEKF3::InitialiseFilter
    **{name: Until.BOOT for k in (1, 2) for name in receiver_names(k)["TYPE"]},  # AP_GPS: driver
}
"""Of what is asked here; all else (the six, filters, trims, places, delays) it reads anew every
time, also where its documentation asks for a reboot."""

CORRECTIONS: Final = {f"{parameter_names(imu).correction}ENABLE": imu for imu in range(1, 6)}
"""What switches an accelerometer's correction for temperature, which is read anew every time."""
REPORTED_S: Final = 2.0
"""s between what a parameter does and its report: a slow link sends it when there is room
[bound]."""


def filter_delay(cutoff_hz: float) -> float:
    """Delay (s) of ArduPilot's two-pole Butterworth low-pass well below its cut-off.

    ``sqrt(2) / (2 pi f)``: the group delay at zero of ``1 / (s^2 + sqrt(2) s + 1)``.  A cut-off of
    zero or less switches the filter off.
    """
    return float(np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz)) if cutoff_hz > 0 else 0.0


@dataclass(slots=True)
class ParametersInForce:
    """What the autopilot applies of its parameters, as it was reported, and what follows from it.

    A value is what was last reported, but for the few that wait for something (:data:`HELD`).  What
    was in force before the first report of a boot nobody knows: that one is taken as it is.
    """

    values: dict[str, float] = field(default_factory=dict)
    receiver: int = 1
    """The one that is watched."""
    armed: bool | None = None
    """As the autopilot says; None if it has not."""
    waiting: dict[str, float] = field(default_factory=dict)
    """What was reported and is not applied yet."""
    switched: dict[int, list[float]] = field(default_factory=dict)
    """When the correction of an accelerometer for temperature was switched, s on the boot clock."""
    _known: set[str] = field(default_factory=set)
    """Of :data:`HELD`, what was reported since the boot."""
    _sixes: dict[int, SixParameters] = field(default_factory=dict)
    """By accelerometer, until another report: every inertial sample asks."""

    def set(self, name: str, value: float, at: float = -inf) -> None:
        """Take a report, which came ``at`` a time, s on the boot clock."""
        if name in CORRECTIONS and self.values.get(name, value) != value:
            self.switched.setdefault(CORRECTIONS[name], []).append(at)
        held = HELD.get(name)
        if held is not None:
            self.waiting.pop(name, None)
            stays = name in self._known and (self.armed or held is Until.BOOT)
            if stays and value != self.values[name]:
                self.waiting[name] = value
                return
            self._known.add(name)
        self.values[name] = value
        self._sixes.clear()

    def hear(self, *, armed: bool | None) -> None:
        """Take what the autopilot says of itself: disarmed, it applies what waits for that."""
        self.armed = armed
        if not armed:
            self._apply([n for n in self.waiting if HELD[n] is Until.DISARMED])

    def boot(self) -> None:
        """The autopilot has begun anew: it has read all of them, disarmed or not."""
        self.armed = None
        self.switched.clear()
        self._apply(list(self.waiting))
        self._known.clear()

    def _apply(self, names: Sequence[str]) -> None:
        for name in names:
            self.values[name] = self.waiting.pop(name)

    def switched_at(self, imu: int, moment: float, sigma: float) -> bool:
        """Whether an accelerometer's correction for temperature was switched then, s, as said."""
        early, late = moment - 2.0 * sigma, moment + 2.0 * sigma + REPORTED_S
        return any(early <= at <= late for at in self.switched.get(imu, ()))

    def get(self, *names: str, default: float) -> float:
        """First of ``names`` that is known."""
        for name in names:
            if name in self.values:
                return self.values[name]
        return default

    def known(self, imu: int) -> bool:
        """True if all six of this accelerometer were reported."""
        return all(name in self.values for name in parameter_names(imu).six)

    def device_id(self, imu: int) -> float | None:
        """INS_ACCn_ID as reported; None if it was not."""
        return self.values.get(parameter_names(imu).device_id)

    def one_chip(self, imu: int) -> bool:
        """True if this IMU's accelerometer and gyroscope are known to be one chip.

        The low 16 bits of a device id are bus type, bus and address on it (AP_HAL::Device).
        """
        names = parameter_names(imu)
        ids = [
            int(self.values.get(name, 0.0)) & 0xFFFF for name in (names.device_id, names.gyro_id)
        ]
        return ids[0] == ids[1] != 0

    @property
    def attitude_imu(self) -> int:
        """Whose gyroscope the recorded attitude is integrated from, as far as parameters tell.

        EK3_PRIMARY counts the bits of EK3_IMU_MASK; a lane that changes in flight they do not tell.
        """
        mask = int(self.get("EK3_IMU_MASK", default=7.0))
        lanes = [i + 1 for i in range(mask.bit_length()) if mask >> i & 1]
        primary = int(self.get("EK3_PRIMARY", default=0.0))
        return lanes[primary] if 0 <= primary < len(lanes) else 1

    def six(self, imu: int) -> SixParameters:
        """Scale and offset in force; one and zero where they were never reported."""
        known = self._sixes.get(imu)
        if known is not None:
            return known
        names = parameter_names(imu)
        s = [self.values.get(n, 1.0) for n in names.scale]
        o = [self.values.get(n, 0.0) for n in names.offset]
        known = self._sixes[imu] = SixParameters(
            vector3(x if x != 0.0 else 1.0 for x in s),
            vector3(o),
        )
        return known

    @property
    def R_bs(self) -> Array:
        """Board orientation; the identity where it is unknown (then see :attr:`representable`)."""
        R = board_rotation(self.get("AHRS_ORIENTATION", default=0.0))
        return np.eye(3) if R is None else R

    @property
    def representable(self) -> bool:
        """False if the sensor's axes are not known or not along the body's."""
        R = board_rotation(self.get("AHRS_ORIENTATION", default=0.0))
        return R is not None and is_axis_aligned(R)

    @property
    def trim(self) -> tuple[float, float, float]:
        """AHRS_TRIM, rad."""
        return (
            self.get("AHRS_TRIM_X", default=0.0),
            self.get("AHRS_TRIM_Y", default=0.0),
            self.get("AHRS_TRIM_Z", default=0.0),
        )

    @property
    def dcm_gain(self) -> float | None:
        """AHRS_RP_P, 1/s, where DCM finds the attitude; None: an EKF does.

        Firmware that has trims but no choice of EKF is older than the choice; the first EKF could
        be switched on (AHRS_EKF_USE).
        """
        if "AHRS_EKF_TYPE" in self.values:
            by_dcm = self.values["AHRS_EKF_TYPE"] == 0.0
        else:
            by_dcm = "AHRS_TRIM_X" in self.values and not self.get("AHRS_EKF_USE", default=0.0)
        return self.get("AHRS_RP_P", default=DCM_GAIN) if by_dcm else None

    @property
    def antenna(self) -> Array:
        """(3,) configured position of the GPS antenna, body axes, m."""
        names = receiver_names(self.receiver)
        return np.array([self.get(*names[a], default=0.0) for a in "XYZ"], dtype=float)

    def lever_arm(self, imu: int) -> Array:
        """(3,) configured lever arm: from the accelerometer to the antenna, body axes, m."""
        own = np.array([self.get(f"INS_POS{imu}_{a}", default=0.0) for a in "XYZ"])
        out: Array = self.antenna - own
        return out

    @property
    def imu_delay(self) -> float:
        """Delay of the accelerometer by its declared low-pass, s."""
        return filter_delay(self.get("INS_ACCEL_FILTER", default=DEFAULT_FILTER_HZ))

    @property
    def gyro_lag(self) -> float:
        """How much later the gyroscope is than the accelerometer, s."""
        gyro = self.get("INS_GYRO_FILTER", default=DEFAULT_FILTER_HZ)
        return filter_delay(gyro) - self.imu_delay

    @property
    def gps_delay_configured(self) -> float:
        """Configured latency of the receiver, s (0: not configured)."""
        return 1e-3 * self.get(*receiver_names(self.receiver)["DELAY_MS"], default=0.0)
