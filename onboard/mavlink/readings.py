"""What each message says, in samples: SI units, stamped by the autopilot's boot clock.

Units and quirks are those of ArduPilot 4.x unless a line says otherwise; see the message
definitions in MAVLink's common.xml and ardupilotmega.xml for the fields.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    EkfHealth,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    ImuSource,
    Outputs,
    ParameterValue,
    Sample,
    Throttle,
    VehicleState,
    Vibration,
)
from onboard.core.inputs.views import Views
from onboard.core.maths.frames import euler_from_rotation, rotation_from_quaternion
from onboard.mavlink.bootclock import BootClock
from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.parameter_messages import number_meant
from onboard.mavlink.vehicle import kind_of_vehicle

Samples: TypeAlias = tuple[Sample, ...]

MILLI_G = 9.80665e-3
MILLI_RAD = 1e-3
GYRO_FIELDS = 0x38
ACCEL_FIELDS = 0x07
"""Bits of HIGHRES_IMU.fields_updated."""
UNKNOWN_U16 = 0xFFFF
CENTI = 0.01
CHANNELS = 14
"""Outputs that are read, as many as a log has."""
NO_POSITION_FIX = 1
"""GPS fix types up to this one (no GPS, no fix) have neither position nor velocity."""
DETECTED = 3
"""GPS_JAMMING_STATE and GPS_SPOOFING_STATE: detected and not mitigated."""
ON_GROUND, LANDED_UNKNOWN = 1, 0
BODY_KEPT_S = 3.0
"""s after an ATTITUDE_QUATERNION for which ATTITUDE is not asked: what a link delays [physics]."""
NOTHING: Samples = ()


class Readings:
    """Reads the messages of one autopilot, for which there is a method each, ``_`` and its name.

    Messages without a time of their own get the latest boot time heard.  ``refused`` counts what
    could not be used, by name.
    """

    def __init__(self, clock: BootClock) -> None:
        self.refused: dict[str, int] = {}
        self._clock = clock
        self._has_battery_status = False
        self._views = Views()
        self._body_attitude = -math.inf

    def of(self, name: str) -> Callable[[Message], Samples]:
        """How the messages of this name are read."""
        reading: Callable[[Message], Samples] = getattr(self, f"_{name.lower()}")
        return reading

    def _refuse(self, reason: str) -> Samples:
        self.refused[reason] = self.refused.get(reason, 0) + 1
        return NOTHING

    # Inertial

    def _raw_imu(self, m: Message) -> Samples:
        t = self._clock.seconds_us(m.time_usec)
        return self._integer_imu(t, m.id + 1, m, ImuSource.RAW_IMU)

    def _scaled_imu(self, m: Message) -> Samples:
        return self._integer_imu(self._clock.seconds_ms(m.time_boot_ms), 1, m, ImuSource.SCALED_IMU)

    def _scaled_imu2(self, m: Message) -> Samples:
        return self._integer_imu(self._clock.seconds_ms(m.time_boot_ms), 2, m, ImuSource.SCALED_IMU)

    def _scaled_imu3(self, m: Message) -> Samples:
        return self._integer_imu(self._clock.seconds_ms(m.time_boot_ms), 3, m, ImuSource.SCALED_IMU)

    def _integer_imu(self, t: float, imu: int, m: Message, source: ImuSource) -> Samples:
        x, y, z, p, q, r = m.xacc, m.yacc, m.zacc, m.xgyro, m.ygyro, m.zgyro
        if not (x or y or z or p or q or r):
            return self._refuse(f"{source.value}: absent")
        # Temperature is an extension field: 0 where the sender does not know it.
        temperature = m.temperature
        return (
            ImuSample(
                t,
                imu,
                (x * MILLI_G, y * MILLI_G, z * MILLI_G),
                (p * MILLI_RAD, q * MILLI_RAD, r * MILLI_RAD),
                temperature * CENTI if temperature else None,
                MILLI_G,
                MILLI_RAD,
                source,
            ),
        )

    def _highres_imu(self, m: Message) -> Samples:
        t = self._clock.seconds_us(m.time_usec)
        if m.fields_updated & ACCEL_FIELDS != ACCEL_FIELDS:
            return self._refuse("HIGHRES_IMU: no acceleration")
        f_b = (m.xacc, m.yacc, m.zacc)
        w_b = (m.xgyro, m.ygyro, m.zgyro) if m.fields_updated & GYRO_FIELDS == GYRO_FIELDS else None
        if not all(map(math.isfinite, f_b)) or (w_b and not all(map(math.isfinite, w_b))):
            return self._refuse("HIGHRES_IMU: not finite")
        if not any(f_b) and not (w_b and any(w_b)):
            return self._refuse("HIGHRES_IMU: absent")
        # The temperature field is the barometer's.
        return (ImuSample(t, m.id + 1, f_b, w_b, source=ImuSource.HIGHRES_IMU),)

    def _attitude(self, m: Message) -> Samples:
        t = self._clock.seconds_ms(m.time_boot_ms)
        if not (math.isfinite(m.roll) and math.isfinite(m.pitch) and math.isfinite(m.yaw)):
            return self._refuse("ATTITUDE: not finite")
        if self.tells_views and 0.0 <= t - self._body_attitude < BODY_KEPT_S:
            return NOTHING
        return (AttitudeSample(t, m.roll, m.pitch, m.yaw),)

    def _attitude_quaternion(self, m: Message) -> Samples:
        """Of the body always: used where ATTITUDE is not."""
        if not self.tells_views:
            return NOTHING
        t = self._clock.seconds_ms(m.time_boot_ms)
        q = np.array([m.q1, m.q2, m.q3, m.q4], dtype=np.float64)
        size = float(np.linalg.norm(q))
        if not 0.5 < size < 2.0:  # none yet, or damaged: its length is one
            return self._refuse("ATTITUDE_QUATERNION: no rotation")
        self._body_attitude = t
        roll, pitch, yaw = map(float, euler_from_rotation(rotation_from_quaternion(q)))
        return (AttitudeSample(t, roll, pitch, yaw, turned=True),)

    @property
    def tells_views(self) -> bool:
        """Whether ATTITUDE is of other axes in hover than in forward flight."""
        return self._views.told

    # Satellite navigation

    def _gps_raw_int(self, m: Message) -> Samples:
        return self._gps(m, 1, "GPS_RAW_INT")

    def _gps2_raw(self, m: Message) -> Samples:
        return self._gps(m, 2, "GPS2_RAW")

    def _gps(self, m: Message, receiver: int, name: str) -> Samples:
        speed, course = m.vel * CENTI, math.radians(m.cog * CENTI)
        if m.fix_type <= NO_POSITION_FIX:
            speed = course = 0.0
        elif m.vel == UNKNOWN_U16:
            return self._refuse(f"{name}: no velocity")
        elif m.cog == UNKNOWN_U16:
            if m.vel:
                return self._refuse(f"{name}: no course")
            course = 0.0
        # The stamp is that of the fix, 0 before the first one; a fix may be old, so that it
        # must not set the boot clock.
        t = self._clock.seconds_us(m.time_usec) if m.time_usec else self._clock.latest
        if t is None:
            return self._refuse(f"{name}: no time yet")
        return (
            GpsFix(
                t,
                receiver,
                m.fix_type,
                math.radians(m.lat * 1e-7),
                math.radians(m.lon * 1e-7),
                m.alt * 1e-3,
                speed * math.cos(course),
                speed * math.sin(course),
                satellites=None if m.satellites_visible == 0xFF else m.satellites_visible,
                hdop=None if m.eph == UNKNOWN_U16 else m.eph * CENTI,
                # mm/s; 0: the receiver does not say, or MAVLink 1 cut the field off
                speed_accuracy=m.vel_acc * 1e-3 or None,
                speed_step=CENTI,
            ),
        )

    def _gnss_integrity(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None:
            return NOTHING
        return (GpsIntegrity(t, m.jamming_state == DETECTED, m.spoofing_state == DETECTED),)

    # Status

    def _heartbeat(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None:
            return NOTHING
        armed = bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        return (VehicleState(t, armed=armed, kind=kind_of_vehicle(m.type)),)

    def _extended_sys_state(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None or m.landed_state == LANDED_UNKNOWN:
            return NOTHING
        return (VehicleState(t, landed=m.landed_state == ON_GROUND),)

    def _ekf_status_report(self, m: Message) -> Samples:
        t = self._clock.latest
        return NOTHING if t is None else (EkfHealth(t, m.flags),)

    def _vibration(self, m: Message) -> Samples:
        t = self._clock.seconds_us(m.time_usec)
        level = (m.vibration_x, m.vibration_y, m.vibration_z)
        if not all(map(math.isfinite, level)):
            return self._refuse("VIBRATION: not finite")
        return (Vibration(t, level, (m.clipping_0, m.clipping_1, m.clipping_2)),)

    def _vfr_hud(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None:
            return NOTHING
        airspeed = m.airspeed if math.isfinite(m.airspeed) else None
        return Throttle(t, m.throttle * CENTI), AirData(t, airspeed=airspeed)

    def _wind(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None or not (math.isfinite(m.speed) and math.isfinite(m.direction)):
            return NOTHING
        # ``speed`` is the length of the 3D vector, ``direction`` where the wind comes from.
        horizontal = math.sqrt(max(0.0, m.speed**2 - m.speed_z**2))
        azimuth = math.radians(m.direction)
        return (
            AirData(
                t, wind_n=-horizontal * math.cos(azimuth), wind_e=-horizontal * math.sin(azimuth)
            ),
        )

    def _battery_status(self, m: Message) -> Samples:
        t = self._clock.latest
        voltage = sum(cell for cell in m.voltages if cell != UNKNOWN_U16) * 1e-3
        if t is None or m.id != 0 or voltage == 0.0:
            return NOTHING
        self._has_battery_status = True
        return (Battery(t, voltage, None if m.current_battery < 0 else m.current_battery * CENTI),)

    def _servo_output_raw(self, m: Message) -> Samples:
        t = self._clock.latest
        if t is None or m.port != 0:
            return NOTHING
        pulses = tuple(float(getattr(m, f"servo{n}_raw")) for n in range(1, CHANNELS + 1))
        return (Outputs(t, tuple(0.0 if p == UNKNOWN_U16 else p for p in pulses)),)

    def _sys_status(self, m: Message) -> Samples:
        t = self._clock.latest
        # The first battery once more, where BATTERY_STATUS does not come.
        if t is None or self._has_battery_status or m.voltage_battery in (0, UNKNOWN_U16):
            return NOTHING
        current = None if m.current_battery < 0 else m.current_battery * CENTI
        return (Battery(t, m.voltage_battery * 1e-3, current),)

    def _system_time(self, _: Message) -> Samples:
        return NOTHING  # told to the clock, like all that is stamped

    def _param_value(self, m: Message) -> Samples:
        value = number_meant(float(m.param_value), m.param_type)
        if not math.isfinite(value):
            return self._refuse("PARAM_VALUE: not finite")
        self._views.take(m.param_id, value)
        return (ParameterValue(m.param_id, value, self._clock.latest),)
