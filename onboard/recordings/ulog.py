"""PX4 logs (.ulg), by pyulog: for advice only, since ArduPilot's parameters mean nothing there."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyulog.core import ULog

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.errors import RecordingError
from onboard.recordings.recording import Recording, elapsed_s

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]
Converter = Callable[[Floats, Columns, int], list[Sample]]
Stream = tuple[Floats, list[Sample]]
"""Times (n,), s, and the n samples of one topic."""

MAGIC = b"ULog"
ARMED = 2
KINDS = {1: "copter", 2: "plane", 3: "rover"}
"""vehicle_status.vehicle_type: rotary wing, fixed wing, rover."""
JAMMED = 2
"""jamming_state and spoofing_state: 1 is fine, 2 and 3 are trouble."""


def is_ulog(head: bytes) -> bool:
    """Whether a file that begins so is a ULog."""
    return head.startswith(MAGIC)


def open_ulog(path: Path) -> Recording:
    """Load a log.

    Raises:
        RecordingError: it cannot be parsed, or has no accelerometer.
    """
    topics, parameters, damage = _load(path)
    streams = [
        stream
        for (name, instance), columns in topics.items()
        for convert in CONVERTERS.get(name, ())
        if (stream := _converted(convert, instance, columns)) is not None
    ]
    inertial = [t for t, samples in streams if samples and isinstance(samples[0], ImuSample)]
    if not inertial:
        raise RecordingError(f"{path}: a PX4 log without accelerometer data (sensor_combined)")

    def read() -> Iterator[Sample]:
        yield from parameters
        t = np.concatenate([t for t, _ in streams])
        samples = [sample for _, part in streams for sample in part]
        for k in np.argsort(t, kind="stable").tolist():
            yield samples[k]

    return Recording(
        path=path,
        kind="ulog",
        autopilot="px4",
        duration_s=elapsed_s(inertial[0]),
        counts={f"{n}[{i}]" if i else n: len(c["timestamp"]) for (n, i), c in topics.items()},
        read=read,
        damage=damage,
        notes=("a PX4 recording: the result is advice, its parameters are ArduPilot's",),
    )


def _load(path: Path) -> tuple[dict[tuple[str, int], Columns], list[Sample], tuple[str, ...]]:
    """Topics by name and instance, the parameters, and what was damaged."""
    chatter = io.StringIO()  # pyulog prints its warnings
    try:
        with path.open("rb") as file, redirect_stdout(chatter):
            log = ULog(file, [*CONVERTERS])
    except Exception as error:  # noqa: BLE001 - pyulog raises anything on damaged bytes
        why = " ".join(str(error).split()) or type(error).__name__
        raise RecordingError(f"{path}: a ULog that cannot be parsed ({why})") from None
    topics = {(d.name, int(d.multi_id)): d.data for d in log.data_list if "timestamp" in d.data}
    if "sensor_gps" in {name for name, _ in topics}:
        # vehicle_gps_position is then a selection from, or a blend of, the receivers.
        topics = {key: c for key, c in topics.items() if key[0] != "vehicle_gps_position"}
    if ("sensor_combined", 0) in topics:
        topics.pop(("vehicle_acceleration", 0), None)
    parameters: list[Sample] = [
        ParameterValue(str(name), float(value))
        for name, value in log.initial_parameters.items()
        if isinstance(value, int | float)
    ]
    parameters += [
        ParameterValue(str(name), float(value), t / 1e6)
        for t, name, value in log.changed_parameters
        if isinstance(value, int | float)
    ]
    damage = []
    if log.file_corruption:
        damage.append("damaged: some of the log was skipped")
    if log.dropouts:
        lost = sum(d.duration for d in log.dropouts) / 1e3
        damage.append(f"{len(log.dropouts)} dropouts of the logger, {lost:.1f} s in all")
    return topics, parameters, tuple(damage)


def _converted(convert: Converter, instance: int, columns: Columns) -> Stream | None:
    """The samples of a topic; None where it has not the fields, or not those we know."""
    try:
        with np.errstate(all="ignore"):  # damaged bytes make any number
            t = columns["timestamp"].astype(np.float64) / 1e6
            return t, convert(t, columns, instance)
    except KeyError:
        return None


def _three(columns: Columns, name: str) -> list[tuple[float, float, float]]:
    axes = [columns[f"{name}[{i}]"].astype(np.float64).tolist() for i in range(3)]
    return list(zip(*axes, strict=True))


def _floats(columns: Columns, name: str) -> list[float]:
    values: list[float] = columns[name].astype(np.float64).tolist()
    return values


def sensor_combined(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Primary accelerometer and gyroscope, corrected, body frame."""
    f_b, w_b = _three(columns, "accelerometer_m_s2"), _three(columns, "gyro_rad")
    return [ImuSample(at, 1, f, w) for at, f, w in zip(t.tolist(), f_b, w_b, strict=True)]


def vehicle_acceleration(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """The same accelerometer, filtered, where sensor_combined was not logged."""
    return [ImuSample(at, 1, f) for at, f in zip(t.tolist(), _three(columns, "xyz"), strict=True)]


def vehicle_attitude(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Quaternion (w, x, y, z) from body to NED, to roll, pitch, yaw."""
    w, x, y, z = (columns[f"q[{i}]"].astype(np.float64) for i in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return list(map(AttitudeSample, t.tolist(), roll.tolist(), pitch.tolist(), yaw.tolist()))


def gps(t: Floats, columns: Columns, instance: int) -> list[Sample]:
    """sensor_gps or vehicle_gps_position; integer degrees 1e-7 and millimetres in old logs."""
    new = "latitude_deg" in columns
    names = ("latitude_deg", "longitude_deg", "altitude_msl_m") if new else ("lat", "lon", "alt")
    lat, lon, alt = (columns[name].astype(np.float64) for name in names)
    if not new:
        lat, lon, alt = lat / 1e7, lon / 1e7, alt / 1e3
    place = np.radians(lat).tolist(), np.radians(lon).tolist(), alt.tolist()
    v_n, v_e, v_d = (_floats(columns, f"vel_{axis}_m_s") for axis in "ned")
    fix = columns["fix_type"].tolist()

    def positive(column: str) -> list[Any]:
        """Values of a column, None where it is absent or says that it does not know."""
        values = columns[column].tolist() if column in columns else [0] * len(t)
        return [v if v > 0 else None for v in values]

    receiver_us = positive("time_utc_usec")
    satellites, hdop = positive("satellites_used"), positive("hdop")
    accuracy = positive("s_variance_m_s")
    samples: list[Sample] = []
    for k, at in enumerate(t.tolist()):
        samples.append(
            GpsFix(
                t=at,
                receiver=instance + 1,
                fix_type=fix[k],
                latitude=place[0][k],
                longitude=place[1][k],
                altitude=place[2][k],
                v_n=v_n[k],
                v_e=v_e[k],
                v_d=v_d[k],
                t_receiver=None if receiver_us[k] is None else receiver_us[k] / 1e6,
                satellites=satellites[k],
                hdop=hdop[k],
                speed_accuracy=accuracy[k],
            )
        )
    return samples


def gps_integrity(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Jamming and spoofing states of a GPS topic that has them."""
    jammed = columns["jamming_state"] >= JAMMED
    spoofed = columns["spoofing_state"] >= JAMMED
    return [
        GpsIntegrity(at, bool(j), bool(s))
        for at, j, s in zip(t.tolist(), jammed, spoofed, strict=True)
    ]


def vehicle_status(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Armed, and the kind of vehicle."""
    armed = columns["arming_state"] == ARMED
    kinds = columns.get("vehicle_type", np.zeros(len(t)))
    return [
        VehicleState(at, armed=bool(a), kind=KINDS.get(int(kind), ""))
        for at, a, kind in zip(t.tolist(), armed, kinds, strict=True)
    ]


def vehicle_land_detected(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Landed."""
    landed = columns["landed"]
    return [VehicleState(at, landed=bool(x)) for at, x in zip(t.tolist(), landed, strict=True)]


def airspeed(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """True airspeed."""
    values = _floats(columns, "true_airspeed_m_s")
    return [AirData(at, airspeed=v) for at, v in zip(t.tolist(), values, strict=True)]


def battery_status(t: Floats, columns: Columns, _instance: int) -> list[Sample]:
    """Voltage and current."""
    values = zip(
        t.tolist(), _floats(columns, "voltage_v"), _floats(columns, "current_a"), strict=True
    )
    return [Battery(at, volts, amperes) for at, volts, amperes in values]


CONVERTERS: dict[str, tuple[Converter, ...]] = {
    "sensor_combined": (sensor_combined,),
    "vehicle_acceleration": (vehicle_acceleration,),
    "vehicle_attitude": (vehicle_attitude,),
    "sensor_gps": (gps, gps_integrity),
    "vehicle_gps_position": (gps, gps_integrity),
    "vehicle_status": (vehicle_status,),
    "vehicle_land_detected": (vehicle_land_detected,),
    "airspeed": (airspeed,),
    "battery_status": (battery_status,),
}
