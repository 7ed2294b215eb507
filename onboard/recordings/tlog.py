"""MAVLink telemetry logs (.tlog): an 8-byte time of arrival before each packet, MAVLink 1 or 2.

The time of arrival is the ground station's and is not used: samples carry the autopilot's clock.
Packets are found by length and checksum; those of messages that the dialect does not know by
length and by what follows them.  Damage costs the packets that it hit and no others.
"""

from __future__ import annotations

import struct
from array import array
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from mmap import ACCESS_READ, mmap
from pathlib import Path

import numpy as np

from onboard.core.inputs.samples import ParameterValue, Sample
from onboard.errors import RecordingError
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import mavlink, message_ids
from onboard.mavlink.framing import (
    MAGICS,
    header,
    is_valid,
    message_id,
    next_valid,
    packet_length,
)
from onboard.recordings.packets import Unpacker
from onboard.recordings.recording import Recording, elapsed_s

Bytes = bytes | mmap
Source = tuple[int, int]
"""System id, component id."""

STAMP_LENGTH = 8
LONGEST_SILENCE_US = 86_400_000_000
LATE_S = 60.0
"""A parameter that is first reported so long after the inertial samples began was read late, as
by a ground station that connected in flight; one that never changed was in force all along."""
INERTIAL = {
    mavlink.MAVLINK_MSG_ID_RAW_IMU: ("<Q", 1e6),
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: ("<Q", 1e6),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU: ("<I", 1e3),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU2: ("<I", 1e3),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU3: ("<I", 1e3),
}
"""Inertial messages: their time field, which is the first, and its ticks per second."""
WANTED = message_ids(Decoder.names)
AUTOPILOTS = {
    mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot",
    mavlink.MAV_AUTOPILOT_PX4: "px4",
}


@dataclass(slots=True)
class _Vehicle:
    """What one source of packets sent: place, length and time of what is wanted."""

    autopilot: int | None = None
    counts: Counter[int] = field(default_factory=Counter)
    offsets: array[int] = field(default_factory=lambda: array("q"))
    lengths: array[int] = field(default_factory=lambda: array("H"))
    imu_times: dict[int, array[float]] = field(default_factory=dict)
    parameters: list[tuple[int, int, bool]] = field(default_factory=list)
    """Place and length of each report, and whether it came late."""

    @property
    def imu_messages(self) -> int:
        return sum(n for kind, n in self.counts.items() if kind in INERTIAL)

    @property
    def duration_s(self) -> float:
        longest = max(self.imu_times.values(), key=len, default=array("d"))
        return elapsed_s(np.array(longest, dtype=np.float64))


@dataclass(slots=True)
class TlogIndex:
    """Packets of a file by source, and what was damaged."""

    vehicles: dict[Source, _Vehicle] = field(default_factory=dict)
    packets: int = 0
    damaged_places: int = 0
    skipped_bytes: int = 0
    cut_off: bool = False


def is_tlog(head: bytes) -> bool:
    """Whether the beginning of a file holds a valid packet after a time stamp."""
    return next_valid(head, STAMP_LENGTH) < len(head)


def open_tlog(path: Path) -> Recording:
    """Index a log and choose the vehicle.

    Raises:
        RecordingError: no autopilot in it sent inertial messages.
    """
    with path.open("rb") as file:
        data = mmap(file.fileno(), 0, access=ACCESS_READ)
    index = index_tlog(data)
    source, notes = _choose(index, path)
    vehicle = index.vehicles[source]

    def read() -> Iterator[Sample]:
        return _samples(data, source, vehicle)

    return Recording(
        path=path,
        kind="tlog",
        autopilot=AUTOPILOTS.get(vehicle.autopilot, "unknown"),
        duration_s=vehicle.duration_s,
        counts={mavlink.mavlink_map[kind].msgname: n for kind, n in sorted(vehicle.counts.items())},
        read=read,
        damage=_damage(index),
        notes=notes,
    )


def index_tlog(data: Bytes) -> TlogIndex:
    """Find the packets; never raises on damage, counts it instead."""
    index = TlogIndex()
    end = len(data)
    at = STAMP_LENGTH  # of the packet; its time of arrival stands before it
    while at < end:
        length = packet_length(data, at)
        kind = message_id(data, at) if length else -1
        wanted = kind in WANTED
        if (
            length
            and at + length <= end
            and (
                is_valid(data, at, kind)
                or (not wanted and _chained(data, at, at + length + STAMP_LENGTH, end))
            )
        ):
            index.packets += 1
            if wanted:
                _note(index, data, at, length, kind)
            at += length + STAMP_LENGTH
            continue
        found = next_valid(data, at + 1)
        if found < end or at - STAMP_LENGTH < end:
            if found >= end:
                index.cut_off = True
            else:
                index.damaged_places += 1
            index.skipped_bytes += min(found, end) - at
        at = found
    return index


def _chained(data: Bytes, at: int, following: int, end: int) -> bool:
    """Whether a packet that we cannot check is followed by another that arrived about then."""
    if following >= end or data[following] not in MAGICS:
        return following == end + STAMP_LENGTH
    here, there = (
        int.from_bytes(data[place - STAMP_LENGTH : place], "big") for place in (at, following)
    )
    return abs(there - here) < LONGEST_SILENCE_US


def _note(index: TlogIndex, data: Bytes, at: int, length: int, kind: int) -> None:
    head = header(data, at)
    source, payload = (head.system, head.component), head.payload
    vehicle = index.vehicles.get(source)
    if vehicle is None:
        vehicle = index.vehicles[source] = _Vehicle()
    vehicle.counts[kind] += 1
    vehicle.offsets.append(at)
    vehicle.lengths.append(length)
    if kind in INERTIAL:
        form, ticks = INERTIAL[kind]
        size = struct.calcsize(form)
        stamp = data[payload : payload + min(size, data[at + 1])].ljust(size, b"\0")
        vehicle.imu_times.setdefault(kind, array("d")).append(struct.unpack(form, stamp)[0] / ticks)
    elif kind == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
        late = any(t[-1] - t[0] > LATE_S for t in vehicle.imu_times.values())
        vehicle.parameters.append((at, length, late))
    elif kind == mavlink.MAVLINK_MSG_ID_HEARTBEAT:
        body = data[payload : payload + data[at + 1]].ljust(9, b"\0")
        if body[4] != mavlink.MAV_TYPE_GCS and body[5] != mavlink.MAV_AUTOPILOT_INVALID:
            vehicle.autopilot = body[5]


def _choose(index: TlogIndex, path: Path) -> tuple[Source, tuple[str, ...]]:
    """The autopilot with most inertial data, and what to say about the others."""
    flying = {s: v for s, v in index.vehicles.items() if v.imu_messages}
    if not flying:
        raise RecordingError(
            f"{path}: no inertial messages (RAW_IMU, HIGHRES_IMU, SCALED_IMU2) in it"
        )
    ranked = sorted(
        flying,
        key=lambda s: (flying[s].autopilot is not None, flying[s].imu_messages),
        reverse=True,
    )
    notes = []
    if flying[ranked[0]].autopilot is None:
        notes.append(f"no heartbeat of an autopilot; system {ranked[0][0]} is taken for one")
    if len(ranked) > 1:
        others = ", ".join(f"{s[0]} ({flying[s].imu_messages})" for s in ranked[1:])
        notes.append(
            f"several vehicles: system {ranked[0][0]} is read, with "
            f"{flying[ranked[0]].imu_messages} inertial messages, not system {others}"
        )
    return ranked[0], tuple(notes)


def _damage(index: TlogIndex) -> tuple[str, ...]:
    notes = []
    if index.damaged_places:
        places = "place" if index.damaged_places == 1 else "places"
        notes.append(
            f"{index.damaged_places} damaged {places}, {index.skipped_bytes} bytes skipped"
        )
    if index.cut_off:
        notes.append("cut off: the end of the log is missing")
    return tuple(notes)


def _samples(data: Bytes, source: Source, vehicle: _Vehicle) -> Iterator[Sample]:
    yield from _told_late(data, source, vehicle)
    # As on a live link, nothing is taken before the autopilot's first heartbeat, if there is one.
    system, component = source
    decoder = Decoder(system, component if vehicle.autopilot is None else None)
    unpack = Unpacker()
    for at, length in zip(vehicle.offsets, vehicle.lengths, strict=True):
        yield from _decoded(unpack, data[at : at + length], decoder)


def _told_late(data: Bytes, source: Source, vehicle: _Vehicle) -> Iterator[ParameterValue]:
    """Parameters that are reported late, and always with the same value."""
    decoder = Decoder(*source)
    unpack = Unpacker()
    values: dict[str, set[float]] = {}
    late: dict[str, bool] = {}
    for at, length, is_late in vehicle.parameters:
        for sample in _decoded(unpack, data[at : at + length], decoder):
            if isinstance(sample, ParameterValue):
                values.setdefault(sample.name, set()).add(sample.value)
                late.setdefault(sample.name, is_late)
    for name, seen in values.items():
        if late[name] and len(seen) == 1:
            yield ParameterValue(name, seen.pop())


def _decoded(unpack: Unpacker, packet: bytes, decoder: Decoder) -> tuple[Sample, ...]:
    try:
        return decoder.decode(unpack(packet))
    except mavlink.MAVError:
        return ()  # a right checksum over a payload that cannot be unpacked
