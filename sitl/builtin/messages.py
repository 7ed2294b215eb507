"""Message contents, with ArduPilot's habits: truncation, clocks, units and all.

One function per message: from an :class:`Instant` to a message of pymavlink's
ardupilotmega dialect, or None where ArduPilot would not send it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.builtin.gps import FIX_3D
from sitl.builtin.instant import Instant
from sitl.builtin.params import as_float32
from sitl.builtin.trajectory import STANDARD_GRAVITY

Message: TypeAlias = Any
"""A pymavlink message; the dialect has no types."""

MILLI_G = 1000.0 / STANDARD_GRAVITY
EARTH_FIELD_MG = np.array([240.0, 30.0, -510.0])
UNKNOWN_16 = 65535
AUTOPILOT_CUSTOM = 1
ARMED = 128
UID2_BYTES = 18


def packed(message: Message, packer: Message) -> bytes:
    """MAVLink 2 frame; pymavlink counts the sequence only in its own ``send``."""
    frame = bytes(message.pack(packer))
    packer.seq = (packer.seq + 1) % 256
    return frame


def truncated(x: float) -> int:
    """A C cast of float to int16: toward zero."""
    whole = int(x)
    return whole if -32768 <= whole <= 32767 else max(-32768, min(32767, whole))


_f = as_float32


def _inertial(now: Instant, imu: int) -> list[int]:
    """Nine int16: milli-g, milli-rad/s, milli-gauss."""
    accel, gyro = now.accel(imu), now.gyro(imu).tolist()
    field = (EARTH_FIELD_MG @ now.piece.trajectory.R_nb[now.row]).tolist()
    return (
        [truncated(x * MILLI_G) for x in accel]
        + [truncated(x * 1000.0) for x in gyro]
        + [truncated(x) for x in field]
    )


def raw_imu(now: Instant) -> Message:
    """RAW_IMU: IMU 1, corrected and filtered, truncated toward zero."""
    return mav.MAVLink_raw_imu_message(
        now.microseconds, *_inertial(now, 0), 0, truncated(now.temperature(0) * 100.0)
    )


def scaled_imu2(now: Instant) -> Message:
    """SCALED_IMU2, where there is a second IMU."""
    if now.imus < 2:
        return None
    return mav.MAVLink_scaled_imu2_message(
        now.milliseconds, *_inertial(now, 1), truncated(now.temperature(1) * 100.0)
    )


def scaled_imu3(now: Instant) -> Message:
    """SCALED_IMU3, where there is a third IMU."""
    if now.imus < 3:
        return None
    return mav.MAVLink_scaled_imu3_message(
        now.milliseconds, *_inertial(now, 2), truncated(now.temperature(2) * 100.0)
    )


def highres_imu(now: Instant) -> Message:
    """HIGHRES_IMU: floats of the primary IMU, the barometer's temperature, id from 0."""
    altitude = now.barometer.altitude(_true_altitude(now))
    pressure = now.barometer.pressure(altitude) * 0.01
    ground = now.barometer.pressure(now.world.environment.altitude) * 0.01
    field = EARTH_FIELD_MG @ now.piece.trajectory.R_nb[now.row] * 1000.0
    return mav.MAVLink_highres_imu_message(
        now.microseconds,
        *(_f(x) for x in now.accel(0)),
        *(_f(x) for x in now.gyro(0)),
        *(_f(x) for x in field),
        _f(pressure),
        _f(pressure - ground),
        _f(altitude),
        _f(now.temperature(0) - 6.0),
        0x1FFF,
        0,
    )


def attitude(now: Instant) -> Message:
    """ATTITUDE: the estimate less AHRS_TRIM, rates without their estimated bias."""
    roll, pitch, yaw = now.attitude().tolist()
    rates = (now.gyro(0) - now.ahrs.gyro_bias).tolist()
    return mav.MAVLink_attitude_message(
        now.milliseconds, _f(roll), _f(pitch), _f(yaw), *(_f(x) for x in rates)
    )


def gps_raw_int(now: Instant) -> Message:
    """GPS_RAW_INT: stamped in whole ms with the arrival, repeated until the next fix."""
    fix = now.fix
    if fix is None:
        return mav.MAVLink_gps_raw_int_message(0, 1, 0, 0, 0, 9999, 9999, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    speed = math.hypot(fix.v_n[0], fix.v_n[1])
    course = math.degrees(math.atan2(fix.v_n[1], fix.v_n[0])) % 360.0
    altitude_cm = round(fix.altitude * 100.0)
    return mav.MAVLink_gps_raw_int_message(
        int(fix.t_stamp * 1e3) * 1000,
        fix.fix_type,
        round(fix.latitude_deg * 1e7),
        round(fix.longitude_deg * 1e7),
        altitude_cm * 10,
        round(fix.hdop * 100.0),
        round(fix.hdop * 160.0),
        int(speed * 100.0),
        int(course * 100.0),
        fix.satellites,
        altitude_cm * 10 - 19_000,
        300,
        450,
        int(fix.speed_accuracy * 1000.0),
        0,
        0,
    )


def global_position_int(now: Instant) -> Message:
    """GLOBAL_POSITION_INT: the filter's own output."""
    north, east, down = now.position()
    v = now.velocity()
    latitude, longitude = _geodetic(now, float(north), float(east))
    yaw = math.degrees(float(now.attitude()[2])) % 360.0
    home = now.world.environment.altitude
    return mav.MAVLink_global_position_int_message(
        now.milliseconds,
        latitude,
        longitude,
        round((home - float(down)) * 1000.0),
        round(-float(down) * 1000.0),
        *(truncated(float(x) * 100.0) for x in v),
        int(yaw * 100.0),
    )


def local_position_ned(now: Instant) -> Message:
    """LOCAL_POSITION_NED: the filter's own output."""
    return mav.MAVLink_local_position_ned_message(
        now.milliseconds, *(_f(x) for x in now.position()), *(_f(x) for x in now.velocity())
    )


def vfr_hud(now: Instant) -> Message:
    """VFR_HUD: throttle in whole percent."""
    v = now.velocity()
    yaw = math.degrees(float(now.attitude()[2])) % 360.0
    altitude = now.world.environment.altitude - float(now.position()[2])
    speed = now.piece.trajectory.airspeed if now.outputs is None else now.outputs.indicated
    return mav.MAVLink_vfr_hud_message(
        _f(speed[now.row]),
        _f(math.hypot(v[0], v[1])),
        int(yaw),
        int(now.throttle * 100.0),
        _f(altitude),
        _f(-v[2]),
    )


def vibration(now: Instant) -> Message:
    """VIBRATION: levels of the primary accelerometer, clip counters of all."""
    level = now.piece.imus[0].vibration[now.row]
    clips = [int(imu.clipped[now.row]) for imu in now.piece.imus] + [0, 0]
    return mav.MAVLink_vibration_message(now.microseconds, *(_f(x) for x in level), *clips[:3])


def ekf_status_report(now: Instant) -> Message:
    """EKF_STATUS_REPORT: 831 when all is well, bit 15 while GPS is being refused."""
    ratios = now.ahrs.ratios
    aided = now.fix is not None and now.fix.fix_type >= FIX_3D and now.t - now.fix_new < 3.0
    flags = 831 if aided else 165
    if aided and max(ratios[:2]) > 1.0:
        flags |= 1 << 15
    return mav.MAVLink_ekf_status_report_message(
        flags, _f(ratios[0]), _f(ratios[1]), _f(ratios[2]), _f(ratios[3]), 0.0, 0.0
    )


def extended_sys_state(now: Instant) -> Message:
    """EXTENDED_SYS_STATE: on the ground or in the air."""
    return mav.MAVLink_extended_sys_state_message(0, 1 if now.landed else 2)


def _battery(now: Instant) -> tuple[float, float, float, int]:
    """Voltage (V), current (A), charge used (mAh), per cent left."""
    if now.outputs is not None:
        used = float(now.outputs.consumed[now.row])
        left = max(0, int(100.0 - 100.0 * used / now.capacity_mah))
        return float(now.outputs.voltage[now.row]), float(now.outputs.current[now.row]), used, left
    current = 0.4 + 32.0 * now.throttle
    left = max(0, int(100.0 - now.consumed_mah / 50.0))
    voltage = 12.5 - now.consumed_mah / 4000.0 - 0.015 * current
    return voltage, current, now.consumed_mah, left


def sys_status(now: Instant) -> Message:
    """SYS_STATUS: sensors present and healthy, load, battery."""
    sensors = 0x1 | 0x2 | 0x4 | 0x8 | 0x20 | 0x200000
    healthy = sensors if now.fix is not None and now.fix.fix_type >= FIX_3D else sensors & ~0x20
    voltage, current, _, left = _battery(now)
    return mav.MAVLink_sys_status_message(
        sensors,
        sensors,
        healthy,
        170,
        int(voltage * 1000.0),
        int(current * 100.0),
        left,
        0,
        0,
        0,
        0,
        0,
        0,
    )


def battery_status(now: Instant) -> Message:
    """BATTERY_STATUS of one battery."""
    voltage, current, used, left = _battery(now)
    cells = [int(voltage * 1000.0)] + [UNKNOWN_16] * 9
    return mav.MAVLink_battery_status_message(
        0, 0, 0, 32767, cells, int(current * 100.0), int(used), -1, left
    )


def scaled_pressure(now: Instant) -> Message:
    """SCALED_PRESSURE of the barometer."""
    pressure = now.barometer.pressure(now.barometer.altitude(_true_altitude(now))) * 0.01
    temperature = truncated((now.temperature(0) - 6.0) * 100.0)
    return mav.MAVLink_scaled_pressure_message(now.milliseconds, _f(pressure), 0.0, temperature)


def servo_output_raw(now: Instant) -> Message:
    """SERVO_OUTPUT_RAW: motors of a copter, throttle channel of a plane."""
    if now.outputs is not None:
        real = [round(float(x)) for x in now.outputs.pwm[now.row]]
        return mav.MAVLink_servo_output_raw_message(
            now.microseconds & 0xFFFFFFFF, 0, *real, *[0] * (8 - len(real))
        )
    pwm = 1000 + int(1000.0 * now.throttle)
    outputs = [pwm] * 4 + [0] * 4 if now.vehicle == "copter" else [1500, 1500, pwm, 1500] + [0] * 4
    return mav.MAVLink_servo_output_raw_message(now.microseconds & 0xFFFFFFFF, 0, *outputs)


def system_time(now: Instant) -> Message:
    """SYSTEM_TIME: boot clock and the time of day that GPS gave."""
    return mav.MAVLink_system_time_message(
        1_760_000_000_000_000 + now.microseconds, now.milliseconds
    )


def wind(now: Instant) -> Message:
    """WIND: where it comes from, and how hard; of a vehicle with an airframe, as it believes."""
    if now.outputs is not None:
        north, east = (float(x) for x in now.outputs.told_wind[now.row])
    else:
        north, east, _ = now.world.environment.wind_n
    direction = math.degrees(math.atan2(-east, -north))
    return mav.MAVLink_wind_message(_f(direction), _f(math.hypot(north, east)), 0.0)


def heartbeat(now: Instant) -> Message:
    """HEARTBEAT: vehicle type, armed flag, mode."""
    kind = mav.MAV_TYPE_FIXED_WING if now.vehicle == "plane" else mav.MAV_TYPE_QUADROTOR
    base = 81 | (ARMED if now.armed else 0)
    state = mav.MAV_STATE_ACTIVE if now.armed else mav.MAV_STATE_STANDBY
    return mav.MAVLink_heartbeat_message(
        kind, mav.MAV_AUTOPILOT_ARDUPILOTMEGA, base, now.mode, state, 3
    )


def home_position(now: Instant) -> Message:
    """HOME_POSITION: where it stood when it started."""
    latitude, longitude = _geodetic(now, 0.0, 0.0)
    nan = float("nan")
    return mav.MAVLink_home_position_message(
        latitude,
        longitude,
        round(now.world.environment.altitude * 1000.0),
        0.0,
        0.0,
        0.0,
        [1.0, 0.0, 0.0, 0.0],
        nan,
        nan,
        nan,
        now.microseconds,
    )


def autopilot_version(now: Instant) -> Message:
    """AUTOPILOT_VERSION: the features that this simulator has, and which board it is."""
    capabilities = (
        mav.MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
        | mav.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | mav.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    )
    version = (4 << 24) | (7 << 16)
    # ArduPilot fills in the long id only.
    uid2 = list(bytes.fromhex(now.world.truth.board).ljust(UID2_BYTES, b"\0"))
    return mav.MAVLink_autopilot_version_message(
        capabilities, version, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0, uid2
    )


def _true_altitude(now: Instant) -> float:
    return now.world.environment.altitude - float(now.piece.trajectory.p_n[now.row, 2])


def _geodetic(now: Instant, north: float, east: float) -> tuple[int, int]:
    """Degrees times 1e7 of a place given from home."""
    home = now.world.environment
    metre = 1e7 / 111_319.49
    longitude = home.longitude_deg * 1e7 + east * metre / math.cos(math.radians(home.latitude_deg))
    return round(home.latitude_deg * 1e7 + north * metre), round(longitude)


BUILDERS: dict[str, Callable[[Instant], Message]] = {
    "HEARTBEAT": heartbeat,
    "RAW_IMU": raw_imu,
    "SCALED_IMU2": scaled_imu2,
    "SCALED_IMU3": scaled_imu3,
    "HIGHRES_IMU": highres_imu,
    "ATTITUDE": attitude,
    "GPS_RAW_INT": gps_raw_int,
    "GLOBAL_POSITION_INT": global_position_int,
    "LOCAL_POSITION_NED": local_position_ned,
    "VFR_HUD": vfr_hud,
    "VIBRATION": vibration,
    "EKF_STATUS_REPORT": ekf_status_report,
    "EXTENDED_SYS_STATE": extended_sys_state,
    "SYS_STATUS": sys_status,
    "BATTERY_STATUS": battery_status,
    "SCALED_PRESSURE": scaled_pressure,
    "SERVO_OUTPUT_RAW": servo_output_raw,
    "SYSTEM_TIME": system_time,
    "WIND": wind,
    "HOME_POSITION": home_position,
    "AUTOPILOT_VERSION": autopilot_version,
}

IDS: dict[int, str] = {getattr(mav, f"MAVLINK_MSG_ID_{name}"): name for name in BUILDERS}
"""Message names by MAVLink id."""
