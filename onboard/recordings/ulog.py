"""PX4 logs (.ulg): for advice only; what they hold is what PX4's own calibration has left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.samples import (
    AirData,
    AttitudeSample,
    Battery,
    GpsFix,
    GpsIntegrity,
    ImuSample,
    Outputs,
    ParameterValue,
    Sample,
    VehicleState,
)
from onboard.errors import RecordingError
from onboard.recordings.bulk import no_collection, samples_of
from onboard.recordings.recording import Recording, because_of, damage_notes, elapsed_s
from onboard.recordings.ulog_index import Records, Topic, UlogIndex, columns_of, index_ulog

Floats = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]
Converter = Callable[[Floats, Columns, int], Sequence[Sample]]

MAGIC = b"ULog"
BLOCK = 4096
"""Records converted at a time: bounds the memory, whatever the length of the log [cost]."""
ARMED = 2
KINDS = {1: "copter", 2: "plane", 3: "rover"}
"""vehicle_status.vehicle_type: rotary wing, fixed wing, rover."""
AIRSPEEDS = tuple(f"{kind}_airspeed_m_s" for kind in ("calibrated", "equivalent", "indicated"))
"""What a pitot tube says, which is of density at sea level: with the sensor's scale taken off, the
same by its older name, and as it is.  PX4 reckons the true airspeed from these."""
MOST_OUTPUTS = 16
JAMMED = 2
"""jamming_state and spoofing_state: 1 is fine, 2 and 3 are trouble."""


def is_ulog(head: bytes) -> bool:
    """Whether a file that begins so is a ULog."""
    return head.startswith(MAGIC)


@dataclass(frozen=True, slots=True)
class _Stream:
    """One use of one instance of a topic: its records, and their times (n,), s."""

    convert: Converter
    instance: int
    records: Records
    t: Floats

    def samples(self, rows: NDArray[np.intp] | slice) -> Sequence[Sample]:
        """Samples of some of the records.

        Raises:
            KeyError: the topic has not the fields, or not those we know.
        """
        with np.errstate(all="ignore"):  # damaged bytes make any number
            return self.convert(self.t[rows], columns_of(self.records[rows]), self.instance)


def open_ulog(path: Path) -> Recording:
    """Index a log.

    Raises:
        RecordingError: it cannot be read, or has no accelerometer.
    """
    with path.open("rb") as file:
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    try:
        index = index_ulog(data, frozenset(CONVERTERS))
    except RecordingError as error:
        raise RecordingError(f"{path}: {error}") from None
    topics = _chosen(index)
    records = {key: topic.records(data) for key, topic in topics.items() if topic.offsets}
    streams = [
        stream
        for (name, instance), of_topic in records.items()
        for convert in CONVERTERS[name]
        if (stream := _stream(convert, instance, of_topic)) is not None
    ]
    inertial = [s for s in streams if s.convert in (sensor_combined, vehicle_acceleration)]
    if not inertial:
        why = because_of(damage_of(index))
        raise RecordingError(
            f"{path}: a PX4 log without accelerometer data (sensor_combined); "
            f"log the default topics{why}"
        )

    def read() -> Iterator[Sample]:
        yield from _parameters(index)
        yield from _in_order(streams)

    return Recording(
        path=path,
        kind="ulog",
        autopilot="px4",
        duration_s=elapsed_s(inertial[0].t),
        counts={f"{n}[{i}]" if i else n: len(r) for (n, i), r in records.items()},
        read=read,
        damage=damage_of(index),
        notes=("a PX4 recording: its numbers are corrections on top of PX4's own calibration",),
    )


def _chosen(index: UlogIndex) -> dict[tuple[str, int], Topic]:
    """Topics to read, sorted by name and instance: of two that tell the same, the better."""
    topics = dict(sorted(index.topics.items()))
    if "sensor_gps" in {name for name, _ in topics}:
        # vehicle_gps_position is then a selection from, or a blend of, the receivers.
        topics = {key: topic for key, topic in topics.items() if key[0] != "vehicle_gps_position"}
    if ("sensor_combined", 0) in topics:
        topics.pop(("vehicle_acceleration", 0), None)
    # Auxiliary outputs move servos; and what goes to the pins is another form of the motors'.
    extra = ("actuator_outputs",) if ("actuator_motors", 0) in topics else ()
    # A sample has no number that would tell two batteries, or two sensors, apart.
    single = {"actuator_outputs", "actuator_motors", "wind", "wind_estimate", "battery_status"}
    single |= {"airspeed", "airspeed_validated"}
    topics = {
        key: c
        for key, c in topics.items()
        if key[0] not in extra and not (key[0] in single and key[1])
    }
    if ("airspeed_validated", 0) in topics:
        topics.pop(("airspeed", 0), None)
    return topics


def _parameters(index: UlogIndex) -> Iterator[Sample]:
    for name, value in index.initial.items():
        yield ParameterValue(name, value)
    for t, name, value in index.changed:
        yield ParameterValue(name, value, t / 1e6)


def damage_of(index: UlogIndex) -> tuple[str, ...]:
    """What the log lacks, in plain words."""
    notes = damage_notes(index.damaged_places, index.skipped_bytes, index.cut_off_bytes)
    if not index.dropouts:
        return notes
    lost = index.dropped_ms / 1e3
    return *notes, f"{index.dropouts} dropouts of the logger, {lost:.1f} s in all"


def _stream(convert: Converter, instance: int, records: Records) -> _Stream | None:
    """Use of a topic; None where it has not the fields, or not those we know."""
    stream = _Stream(convert, instance, records, records["timestamp"].astype(np.float64) / 1e6)
    try:
        stream.samples(slice(0, 1))
    except KeyError:
        return None
    return stream


def _in_order(streams: list[_Stream]) -> Iterator[Sample]:
    """Samples of all streams by their time."""
    whose = np.repeat(np.arange(len(streams)), [len(s.t) for s in streams])
    first = np.cumsum([0, *(len(s.t) for s in streams)])
    order = np.argsort(np.concatenate([s.t for s in streams]), kind="stable")
    for start in range(0, len(order), BLOCK):
        block = order[start : start + BLOCK]
        samples: list[Sample] = []
        places = []
        with no_collection():
            for k in np.unique(whose[block]).tolist():
                places.append(np.flatnonzero(whose[block] == k))
                samples += streams[k].samples(block[places[-1]] - first[k])
        yield from map(samples.__getitem__, np.argsort(np.concatenate(places)).tolist())


def _three(columns: Columns, name: str) -> list[tuple[float, float, float]]:
    axes = [columns[f"{name}[{i}]"].astype(np.float64).tolist() for i in range(3)]
    return list(zip(*axes, strict=True))


def _integers(values: NDArray[Any]) -> list[int]:
    """A field of small whole numbers, in whatever type it was logged; -1 where it is none."""
    small = np.nan_to_num(values.astype(np.float64), nan=-1.0, posinf=-1.0, neginf=-1.0)
    whole: list[int] = np.clip(small, -1.0, 255.0).astype(int).tolist()
    return whole


def _floats(columns: Columns, name: str) -> list[float]:
    values: list[float] = columns[name].astype(np.float64).tolist()
    return values


def sensor_combined(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Primary accelerometer and gyroscope, corrected, body frame."""
    f_b, w_b = _three(columns, "accelerometer_m_s2"), _three(columns, "gyro_rad")
    return samples_of(ImuSample, t.tolist(), [1] * len(t), f_b, w_b)


def vehicle_acceleration(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """The same accelerometer, filtered, where sensor_combined was not logged."""
    return samples_of(ImuSample, t.tolist(), [1] * len(t), _three(columns, "xyz"))


def vehicle_attitude(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Quaternion (w, x, y, z) from body to NED, to roll, pitch, yaw."""
    w, x, y, z = (columns[f"q[{i}]"].astype(np.float64) for i in range(4))
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return samples_of(AttitudeSample, t.tolist(), roll.tolist(), pitch.tolist(), yaw.tolist())


def gps(t: Floats, columns: Columns, instance: int) -> Sequence[Sample]:
    """sensor_gps or vehicle_gps_position; integer degrees 1e-7 and millimetres in old logs."""
    new = "latitude_deg" in columns
    names = ("latitude_deg", "longitude_deg", "altitude_msl_m") if new else ("lat", "lon", "alt")
    lat, lon, alt = (columns[name].astype(np.float64) for name in names)
    if not new:
        lat, lon, alt = lat / 1e7, lon / 1e7, alt / 1e3
    place = np.radians(lat).tolist(), np.radians(lon).tolist(), alt.tolist()
    v_n, v_e, v_d = (_floats(columns, f"vel_{axis}_m_s") for axis in "ned")
    fix = _integers(columns["fix_type"])

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


def gps_integrity(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Jamming and spoofing states of a GPS topic that has them."""
    jammed = columns["jamming_state"] >= JAMMED
    spoofed = columns["spoofing_state"] >= JAMMED
    return [
        GpsIntegrity(at, bool(j), bool(s))
        for at, j, s in zip(t.tolist(), jammed, spoofed, strict=True)
    ]


def vehicle_status(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Armed, and the kind of vehicle."""
    armed = columns["arming_state"] == ARMED
    kinds = _integers(columns.get("vehicle_type", np.zeros(len(t))))
    return [
        VehicleState(at, armed=bool(a), kind=KINDS.get(kind, ""))
        for at, a, kind in zip(t.tolist(), armed, kinds, strict=True)
    ]


def vehicle_land_detected(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Landed."""
    landed = columns["landed"]
    return [VehicleState(at, landed=bool(x)) for at, x in zip(t.tolist(), landed, strict=True)]


def airspeed(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """The equivalent airspeed; the true one, which is beside it, has the density taken off."""
    name = next((name for name in AIRSPEEDS if name in columns), AIRSPEEDS[0])
    values = _floats(columns, name)
    return [AirData(at, airspeed=v) for at, v in zip(t.tolist(), values, strict=True)]


def battery_status(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Voltage and current."""
    volts, amperes = _floats(columns, "voltage_v"), _floats(columns, "current_a")
    return samples_of(Battery, t.tolist(), volts, amperes)


def actuator_outputs(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Pulse widths of the main outputs, microseconds."""
    return _outputs(t, columns, "output", normalised=False)


def actuator_motors(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """Commands of the motors, 0 to 1; NaN for those that are not there."""
    return _outputs(t, columns, "control", normalised=True)


def _outputs(t: Floats, columns: Columns, name: str, *, normalised: bool) -> Sequence[Sample]:
    used = [f"{name}[{k}]" for k in range(MOST_OUTPUTS) if f"{name}[{k}]" in columns]
    if not used:
        raise KeyError(name)
    rows = list(zip(*(_floats(columns, column) for column in used), strict=True))
    return samples_of(Outputs, t.tolist(), rows, [normalised] * len(t))


def wind(t: Floats, columns: Columns, _instance: int) -> Sequence[Sample]:
    """The autopilot's own estimate."""
    north, east = _floats(columns, "windspeed_north"), _floats(columns, "windspeed_east")
    return [
        AirData(at, wind_n=n, wind_e=e) for at, n, e in zip(t.tolist(), north, east, strict=True)
    ]


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
    "actuator_outputs": (actuator_outputs,),
    "actuator_motors": (actuator_motors,),
    "wind": (wind,),
    "wind_estimate": (wind,),
    "airspeed_validated": (airspeed,),
}
