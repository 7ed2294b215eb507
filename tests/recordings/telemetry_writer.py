"""Writes small .tlog and .ulg files for the tests."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence

from pymavlink.dialects.v20 import ardupilotmega as mavlink


class TelemetryWriter:
    """Packs messages of one or more systems into a .tlog."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.stamp_us = 1_700_000_000_000_000
        self.packers: dict[tuple[int, int], mavlink.MAVLink] = {}
        self.places: list[int] = []

    def __bytes__(self) -> bytes:
        return bytes(self.data)

    def add(
        self,
        message: mavlink.MAVLink_message,
        system: int = 1,
        component: int = 1,
        version: int = 2,
    ) -> None:
        key = system, component
        packer = self.packers.setdefault(key, mavlink.MAVLink(None, system, component))
        self.stamp_us += 1000
        self.places.append(len(self.data))
        self.data += struct.pack(">Q", self.stamp_us)
        self.data += message.pack(packer, force_mavlink1=version == 1)
        packer.seq = (packer.seq + 1) % 256


def heartbeat(autopilot: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, armed: bool = False) -> object:
    kind = mavlink.MAV_TYPE_GCS if autopilot == mavlink.MAV_AUTOPILOT_INVALID else 2
    return mavlink.MAVLink_heartbeat_message(kind, autopilot, 128 if armed else 0, 0, 4, 3)


def raw_imu(t_us: int, z: int = -1000) -> object:
    return mavlink.MAVLink_raw_imu_message(t_us, 10, -20, z, 1, 2, 3, 0, 0, 0, 0, 3150)


def telemetry(
    seconds: int = 4,
    system: int = 1,
    version: int = 2,
    writer: TelemetryWriter | None = None,
    firmware: int = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA,
) -> TelemetryWriter:
    """RAW_IMU and ATTITUDE at 25 Hz, GPS at 5 Hz, heartbeat at 1 Hz, a parameter, some others."""
    log = writer or TelemetryWriter()

    def add(message: object) -> None:
        log.add(message, system=system, version=version)

    for k in range(25 * seconds):
        t = 10_000_000 + 40_000 * k
        if k % 25 == 0:
            add(heartbeat(firmware))
            log.add(heartbeat(mavlink.MAV_AUTOPILOT_INVALID), 255, 190, version)
        if k == 1:
            add(mavlink.MAVLink_param_value_message(b"INS_ACCSCAL_X", 1.01, 9, 1, 0))
        add(raw_imu(t))
        add(mavlink.MAVLink_attitude_message(t // 1000, 0.1, -0.05, 1.5, 0, 0, 0))
        add(mavlink.MAVLink_scaled_pressure_message(t // 1000, 1000, 0, 2000))
        if k % 5 == 0:
            add(mavlink.MAVLink_gps_raw_int_message(
                t, 3, -353632621, 1491652371, 584050, 80, 100, 1000, 9000, 12,
                vel_acc=300 if version == 2 else 0))  # fmt: skip
    return log


FORMATS = {
    "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;uint32_t gyro_integral_dt;"
    "int32_t accelerometer_timestamp_relative;float[3] accelerometer_m_s2;",
    "vehicle_attitude": "uint64_t timestamp;float[4] q;",
    "sensor_gps": "uint64_t timestamp;double latitude_deg;double longitude_deg;"
    "double altitude_msl_m;float s_variance_m_s;float vel_n_m_s;float vel_e_m_s;float vel_d_m_s;"
    "float hdop;uint64_t time_utc_usec;uint8_t fix_type;uint8_t satellites_used;"
    "uint8_t jamming_state;uint8_t spoofing_state;",
    "vehicle_status": "uint64_t timestamp;uint8_t arming_state;uint8_t vehicle_type;",
    "sensor_selection": "uint64_t timestamp;uint32_t accel_device_id;uint32_t gyro_device_id;",
}
PACKING = {
    "sensor_combined": "<Q3fIi3f",
    "vehicle_attitude": "<Q4f",
    "sensor_gps": "<QdddfffffQBBBB",
    "vehicle_status": "<QBB",
    "sensor_selection": "<QII",
}


def px4_log(
    seconds: int = 2,
    parameters: Mapping[str, float] | None = None,
    selected: Sequence[int] = (),
) -> bytes:
    """A ULog with the topics above at 50, 50, 5 and 1 Hz.

    ``parameters``: those that end in ``_ID`` and ``_ROT`` are integers; ``selected``: which
    accelerometer flies, each for an equal part of the log.
    """

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 1_000_000))
    out += message("B", bytes(40))
    for name, layout in FORMATS.items():
        out += message("F", f"{name}:{layout}".encode())
    for name, value in (parameters or {"CAL_ACC0_XOFF": 0.125}).items():
        whole = name.endswith(("_ID", "_ROT"))
        key = f"{'int32_t' if whole else 'float'} {name}".encode()
        packed = struct.pack("<i", int(value)) if whole else struct.pack("<f", value)
        out += message("P", bytes((len(key),)) + key + packed)
    numbers = {name: k for k, name in enumerate(FORMATS)}
    for name, number in numbers.items():
        out += message("A", struct.pack("<BH", 0, number) + name.encode())

    def data(name: str, *values: float) -> bytes:
        body = struct.pack("<H", numbers[name]) + struct.pack(PACKING[name], *values)
        return message("D", body)

    half = 2.0**-0.5
    for k in range(50 * seconds):
        t = 2_000_000 + 20_000 * k
        out += data("sensor_combined", t, 0.1, 0.2, 0.3, 20_000, 0, 1.0, 2.0, -9.5)
        out += data("vehicle_attitude", t + 5, half, 0.0, 0.0, half)
        if k % 10 == 0:
            out += data("sensor_gps", t + 9, 47.4, 8.5, 500.0, 0.2, 1.0, 2.0, -0.5, 0.8,
                        1_700_000_000_000_000 + t, 3, 15, 1, 1)  # fmt: skip
        if k % 50 == 0:
            out += data("vehicle_status", t + 11, 2, 2)
        if selected and k % 10 == 0:
            now = selected[k * len(selected) // (50 * seconds)]
            out += data("sensor_selection", t + 12, now, 1)
    return bytes(out)
