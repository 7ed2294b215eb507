"""MAVLink telemetry logs (.tlog): an 8-byte time of arrival before each packet, MAVLink 1 or 2.

The time of arrival is the ground station's and is not used: samples carry the autopilot's clock.
Packets are found by length and checksum; those of messages that the dialect does not know by
length and by what follows them.  Damage costs the packets that it hit and no others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from mmap import ACCESS_READ, MADV_DONTNEED, mmap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from onboard.core.inputs.blocks import Piece
from onboard.core.inputs.samples import ParameterValue, Sample
from onboard.core.inputs.views import ASKED, Views
from onboard.errors import RecordingError
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import Message, mavlink, message_ids
from onboard.mavlink.framing import next_valid
from onboard.mavlink.parameter_messages import NO_INDEX
from onboard.recordings.bulk import no_collection
from onboard.recordings.packet_blocks import PacketBlocks
from onboard.recordings.packet_columns import (
    STAMP_LENGTH,
    Integers,
    Octets,
    headers,
    payloads,
)
from onboard.recordings.packets import Unpacker
from onboard.recordings.recording import Recording, because_of, damage_notes, elapsed_s
from onboard.recordings.tlog_index import Bytes, TlogIndex, index_tlog

Source = tuple[int, int]
"""System id, component id."""
Floats = NDArray[np.float64]
Words = NDArray[np.int32]

LATE_S = 60.0
"""A parameter that is first reported so long after the inertial samples began was read late, as
by a ground station that connected in flight; one that never changed was in force all along."""
INERTIAL = {
    mavlink.MAVLINK_MSG_ID_RAW_IMU: ("<u8", 1e6),
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: ("<u8", 1e6),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU: ("<u4", 1e3),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU2: ("<u4", 1e3),
    mavlink.MAVLINK_MSG_ID_SCALED_IMU3: ("<u4", 1e3),
}
"""Inertial messages: their time field, which is the first, and its ticks per second."""
HEARTBEAT_LENGTH = 9
PARAMETER = np.dtype([("value", "<f4"), ("count_and_index", "<u4"), ("id", "S16")])
"""PARAM_VALUE without its type, which ArduPilot does not heed: all are sent as floats."""
OF_VIEW = (
    "in its hovering modes ATTITUDE is not the body's attitude, and there is no "
    "ATTITUDE_QUATERNION, which always is: ask for it while recording, or fly it forward"
)
BLOCK = 2048
"""Packets decoded at a time: bounds the memory, whatever the length of the log [cost]."""
TOGETHER = 65536
"""Packets whose headers are looked at together [cost]."""
WANTED = message_ids(Decoder.names)
AUTOPILOTS = {
    mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot",
    mavlink.MAV_AUTOPILOT_PX4: "px4",
}


@dataclass(frozen=True, slots=True)
class _Vehicle:
    """What one source of packets sent: the places of what is wanted.

    ``duration_s`` is that of the clock over the inertial messages of which there are most;
    ``reports`` are the places of parameters, and ``late`` says whether they came late.
    """

    autopilot: int | None
    counts: dict[int, int]
    offsets: Integers
    duration_s: float
    reports: Integers
    late: NDArray[np.bool_]

    @property
    def imu_messages(self) -> int:
        return sum(n for kind, n in self.counts.items() if kind in INERTIAL)


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
    index = index_tlog(data, WANTED)
    vehicles = _vehicles(index)
    _let_go(data)
    damage = damage_notes(index.damaged_places, index.skipped_bytes, index.cut_off_bytes)
    source, notes = _choose(vehicles, path, damage)
    vehicle = vehicles[source]

    def read() -> Iterator[Sample]:
        return chain(_told_late(data, source, vehicle), _samples(data, source, vehicle))

    def gather() -> Iterator[Piece]:
        return chain(_told_late(data, source, vehicle), _pieces(data, source, vehicle))

    return Recording(
        path=path,
        kind="tlog",
        autopilot=AUTOPILOTS.get(vehicle.autopilot, "unknown"),
        duration_s=vehicle.duration_s,
        counts={mavlink.mavlink_map[kind].msgname: n for kind, n in sorted(vehicle.counts.items())},
        read=read,
        damage=damage,
        notes=notes + _of_view(data, vehicle),
        gather=gather,
    )


def _vehicles(index: TlogIndex) -> dict[Source, _Vehicle]:
    """The wanted packets by their senders, in the order in which these were heard first."""
    data = np.frombuffer(index.data, np.uint8)
    kinds, senders = _told(data, index.offsets)
    found, first = np.unique(senders, return_index=True)
    vehicles = {}
    for sender in found[np.argsort(first)].tolist():
        rows = np.flatnonzero(senders == sender) if len(found) > 1 else slice(None)
        vehicle = _vehicle(data, index.offsets[rows], kinds[rows])
        vehicles[sender >> 8, sender & 0xFF] = vehicle
    return vehicles


def _told(data: Octets, offsets: Integers) -> tuple[Words, Words]:
    """Kinds and senders of packets, (n,) each: of many not all of their headers at once."""
    kinds, senders = np.empty((2, len(offsets)), np.int32)
    for start in range(0, len(offsets), TOGETHER):
        some = slice(start, start + TOGETHER)
        head = headers(data, offsets[some])
        kinds[some], senders[some] = head.kind, head.system << 8 | head.component
    return kinds, senders


def _times(data: Octets, offsets: Integers, form: str, ticks: float) -> Floats:
    """(n,) s, of inertial messages whose time is in this form."""
    out, width = np.empty(len(offsets)), np.dtype(form).itemsize
    for start in range(0, len(offsets), TOGETHER):
        some = slice(start, start + TOGETHER)
        ticked = payloads(data, headers(data, offsets[some]), width).view(form)[:, 0]
        out[some] = ticked.astype(np.float64) / ticks
    return out


def _vehicle(data: Octets, offsets: Integers, kind_of: Words) -> _Vehicle:
    def rows_of(kind: int) -> Integers:
        return np.flatnonzero(kind_of == kind)

    kinds, first, counts = np.unique(kind_of, return_index=True, return_counts=True)
    imu_rows, imu_times = {}, {}
    for kind in kinds[np.argsort(first)].tolist():
        if kind in INERTIAL:
            imu_rows[kind] = rows_of(kind)
            imu_times[kind] = _times(data, offsets[imu_rows[kind]], *INERTIAL[kind])
    reports = rows_of(mavlink.MAVLINK_MSG_ID_PARAM_VALUE)
    late = np.zeros(len(reports), bool)
    for kind, t in imu_times.items():
        last = np.searchsorted(imu_rows[kind], reports) - 1
        late |= (last >= 0) & (t[last] - t[0] > LATE_S)
    heartbeats = headers(data, offsets[rows_of(mavlink.MAVLINK_MSG_ID_HEARTBEAT)])
    beats = payloads(data, heartbeats, HEARTBEAT_LENGTH)
    flying = (beats[:, 4] != mavlink.MAV_TYPE_GCS) & (beats[:, 5] != mavlink.MAV_AUTOPILOT_INVALID)
    return _Vehicle(
        autopilot=int(beats[flying, 5][-1]) if flying.any() else None,
        counts=dict(zip(kinds.tolist(), counts.tolist(), strict=True)),
        offsets=offsets,
        duration_s=elapsed_s(max(imu_times.values(), key=len, default=np.zeros(0))),
        reports=offsets[reports],
        late=late,
    )


def _choose(
    vehicles: dict[Source, _Vehicle], path: Path, damage: tuple[str, ...]
) -> tuple[Source, tuple[str, ...]]:
    """The autopilot with most inertial data, and what to say about the others."""
    flying = {s: v for s, v in vehicles.items() if v.imu_messages}
    if not flying:
        raise RecordingError(
            f"{path}: no inertial messages (RAW_IMU, HIGHRES_IMU, SCALED_IMU2) in it; "
            f"set SRn_RAW_SENS to 25 or more while it is recorded{because_of(damage)}"
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


def _of_view(data: Bytes, vehicle: _Vehicle) -> tuple[str, ...]:
    """What to say about an attitude that is not the body's while it hovers."""
    counts = vehicle.counts
    if mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION in counts or not len(vehicle.reports):
        return ()
    octets = np.frombuffer(data, np.uint8)
    told = payloads(octets, headers(octets, vehicle.reports), PARAMETER.itemsize)
    names, values = (told.view(PARAMETER)[name][:, 0] for name in ("id", "value"))
    asked = np.isin(names, [name.encode() for name in ASKED])
    views = Views()
    for name, value in zip(names[asked].tolist(), values[asked].tolist(), strict=True):
        views.take(name.decode(), value)
    return (OF_VIEW,) if views.told else ()


def _decoder(source: Source, vehicle: _Vehicle) -> Decoder:
    # As on a live link, nothing is taken before the autopilot's first heartbeat, if there is one.
    system, component = source
    return Decoder(system, component if vehicle.autopilot is None else None)


def _told_late(data: Bytes, source: Source, vehicle: _Vehicle) -> Iterator[ParameterValue]:
    """Parameters that are reported late, in lists alone, and always with the same value.

    What is reported beside a list was asked for by name, or somebody has just set it; then nobody
    knows what was in force before.
    """
    values: dict[str, set[float]] = {}
    late: dict[str, bool] = {}
    unlisted: set[str] = set()
    decoder = Decoder(*source)
    unpack = Unpacker()
    octets = np.frombuffer(data, np.uint8)
    messages = unpack(octets, vehicle.reports)
    for message, is_late in zip(messages, vehicle.late.tolist(), strict=True):
        for sample in () if message is None else decoder.decode(message):
            if isinstance(sample, ParameterValue):
                values.setdefault(sample.name, set()).add(sample.value)
                late.setdefault(sample.name, is_late)
                if message is not None and message.param_index == NO_INDEX:
                    unlisted.add(sample.name)
    for name, seen in values.items():
        if late[name] and len(seen) == 1 and name not in unlisted:
            yield ParameterValue(name, seen.pop())


def _decoded(messages: list[Message | None], decoder: Decoder) -> list[Sample]:
    return [s for m in messages if m is not None for s in decoder.decode(m)]


def _samples(data: Bytes, source: Source, vehicle: _Vehicle) -> Iterator[Sample]:
    """Samples of packets one by one, decoded block by block."""
    decoder, unpack = _decoder(source, vehicle), Unpacker()
    octets = np.frombuffer(data, np.uint8)
    for start in range(0, len(vehicle.offsets), BLOCK):
        with no_collection():
            at = vehicle.offsets[start : start + BLOCK]
            samples = _decoded(unpack(octets, at), decoder)
        _let_go(data)
        yield from samples


def _pieces(data: Bytes, source: Source, vehicle: _Vehicle) -> Iterator[Piece]:
    """The same with what is many in columns."""
    decoder, unpack = _decoder(source, vehicle), Unpacker()
    octets = np.frombuffer(data, np.uint8)
    blocks = PacketBlocks(octets, decoder, unpack)
    for start in range(0, len(vehicle.offsets), BLOCK):
        at = vehicle.offsets[start : start + BLOCK]
        with no_collection():
            block = blocks(at)
            samples = _decoded(unpack(octets, at), decoder) if block is None else ()
        _let_go(data)
        if block is not None:
            yield block
        yield from samples


def _let_go(data: Bytes) -> None:
    """What was read of the file need not stay in this process's memory: the system has it."""
    if isinstance(data, mmap):
        data.madvise(MADV_DONTNEED)
