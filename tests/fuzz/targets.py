"""Each place where bytes come in, as a function of bytes; it raises an OnboardError or nothing."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import math
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from zlib import crc32

import msgspec

from onboard.answers.chronicle import Chronicle
from onboard.answers.match_files import read_frame
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.daemon.learning.flight import decode, encode
from onboard.daemon.learning.store import Store
from onboard.daemon.mqtt.commands import Commands
from onboard.daemon.outlets.control import ControlServer
from onboard.daemon.outlets.door import bound
from onboard.daemon.process.condition import Observed
from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.daemon.setup import configuration, secret_files, settings
from onboard.daemon.view.history import History
from onboard.daemon.view.journal_lines import journal_view
from onboard.daemon.view.notices import Notices
from onboard.errors import UsageError
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from onboard.mavlink.dialect import mavlink, message_ids
from onboard.push.journal import Journal
from onboard.recordings import dataflash, ulog
from onboard.recordings.arrays import read_arrays
from onboard.recordings.opening import open_recording
from onboard.recordings.table import open_table
from onboard.web.page import status_page
from tests.daemon.blank_snapshot import blank_snapshot
from tests.daemon.test_control import Recorded
from tests.fuzz import samples


@dataclass(frozen=True, slots=True)
class Target:
    """What is done with bytes, what they look like if they are right, and words of theirs."""

    run: Callable[[bytes], object]
    seeds: tuple[bytes, ...]
    tokens: tuple[bytes, ...] = ()


@contextlib.contextmanager
def _directory():
    with tempfile.TemporaryDirectory(prefix="onboard-fuzz-") as name:
        yield Path(name)


@contextlib.contextmanager
def _file(data: bytes, name: str):
    with _directory() as directory:
        path = directory / name
        path.write_bytes(data)
        yield path


def codec(data: bytes) -> int:
    """Bytes of the link, in three cuts."""
    receiver = Codec()
    third = len(data) // 3 + 1
    frames = 0
    for at in range(0, len(data), third):
        frames += len(receiver.feed(data[at : at + third]))
    if len(receiver._buffer) > 280 + 8:
        raise AssertionError(f"{len(receiver._buffer)} bytes wait for a frame")
    return frames


def messages(data: bytes) -> int:
    """Packets whose checksum is right, with any payload, to all that listen."""
    kinds = sorted(message_ids((*Decoder.names, *ParameterWatch.names, "HEARTBEAT")))
    receiver, decoder, observed, watch = Codec(), Decoder(1, 1), Observed(), ParameterWatch()
    watch.start(1, 1, 0.0)
    calibrator = Calibrator()
    taken = at = 0
    while at + 2 <= len(data):
        kind, length = kinds[data[at] % len(kinds)], data[at + 1]
        payload = data[at + 2 : at + 2 + length]
        at += 2 + max(length, 1)
        head = bytes((len(payload), 0, 0, taken & 0xFF, 1, 1)) + kind.to_bytes(3, "little")
        extra = bytes((mavlink.mavlink_map[kind].crc_extra,))
        crc = mavlink.x25crc(head + payload + extra).crc
        for frame in receiver.feed(b"\xfd" + head + payload + crc.to_bytes(2, "little")):
            if frame.message is None:
                continue
            taken += 1
            watch.feed(frame.message, float(taken))
            for sample in decoder.decode(frame.message):
                observed.feed(sample, float(taken))
                calibrator.feed(sample)
    observed.condition(float(taken))
    return taken


def recording(data: bytes, name: str = "x") -> int:
    """A file of any of the three kinds."""
    with _file(data, name) as path:
        opened = open_recording(path)
        if not opened.duration_s >= 0.0:
            raise AssertionError(f"lasts {opened.duration_s} s")
        read_arrays(path, (*dataflash.WANTED, *Decoder.names, *ulog.CONVERTERS))
        return sum(1 for _ in opened.samples())


def chronicle(data: bytes) -> float:
    """What a recording says, watched on its way into the estimator."""
    watched = Chronicle(Calibrator())
    with _file(data, "x") as path:
        for sample in open_recording(path).samples():
            watched.feed(sample)
    watched.restart()
    watched.finish()
    for imu in watched.calibrator.imus:
        watched.figures(imu)
        with contextlib.suppress(KeyError):
            watched.calibrator.calibration(imu)
    return watched.duration_s + len(watched.spans) + len(watched.speed.t)


def frame(data: bytes) -> object:
    """A frame file of the simulator, as far as a match makes numbers of it."""
    with _file(data, "frame.json") as path:
        given = read_frame(path)
    made = []
    for kind in (CopterAirframe, PlaneAirframe):
        try:
            made.append(kind.of(given))
        except ValueError as error:  # which the command tells with the name of the file
            raise UsageError(str(error)) from None
    copter, plane = made
    numbers = [copter.reference_density, copter.rotor_drag, copter.body_drag, copter.inflow]
    numbers += [copter.full_thrust, plane.induced]
    numbers += [float(x) for x in asdict(copter.with_drag(0.2, 0.02)).values()]
    if not all(map(math.isfinite, numbers)):
        raise AssertionError(f"{numbers}")
    return numbers


def table(data: bytes) -> int:
    """A column map and a table."""
    columns, _, rows = data.partition(samples.MAP_ENDS)
    with _directory() as directory:
        (directory / "map.toml").write_bytes(columns)
        (directory / "x.csv").write_bytes(rows)
        opened = open_table(directory / "x.csv", directory / "map.toml")
        return sum(1 for _ in opened.samples())


def configured(data: bytes) -> object:
    """A configuration, down to the settings of the parts."""
    with _file(data, "vehicle.toml") as path:
        chosen = configuration.load(path)
    settings.endpoints(chosen.link)
    settings.policy_settings(chosen.push)
    settings.stream_requests(chosen.link.rates)
    return settings.estimator_settings(chosen.estimator)


def secret(data: bytes) -> str:
    """A file with a token."""
    with _file(data, "token") as path:
        path.chmod(0o600)
        return secret_files.read_secret(str(path), key="[http] token_file")


def state(data: bytes) -> object:
    """The file of saved sums, and the one of the charts."""
    with _directory() as directory:
        store = Store(directory)
        (directory / "history-1.bin").write_bytes(data)
        history = History(directory, clock=lambda: 0.0)
        history.take(blank_snapshot())
        msgspec.json.encode(history.document())
        store.path(1).write_bytes(data)
        return store.load(1)


def sums(data: bytes) -> int:
    """Saved sums whose checksum is right."""
    calibrator = Calibrator()
    calibrator.lay_aside(data)
    return len(calibrator.to_bytes())


def flight(data: bytes) -> object:
    """A saved flight whose checksum is right."""
    judged = decode(data)
    return None if judged is None else (encode(judged), judged.says_nothing)


def journal(data: bytes) -> int:
    """The journal, and what is asked of it at a start; ``#`` stands for a right checksum."""
    lines = []
    for line in data.split(b"\n"):
        head, mark, entry = line.partition(b"#,")
        body = entry.partition(b":")[2][:-1]
        lines.append(head + str(crc32(body)).encode() + b"," + entry if mark else line)
    with _file(b"\n".join(lines), "journal.jsonl") as path, Journal(path) as opened:
        opened.refusals()
        for imu in range(1, 6):
            opened.last_completed(imu)
        msgspec.json.encode(journal_view(opened.entries))
        opened.recover()
        return len(opened.entries)


class Quiet(logging.Handler):
    """Remembers what was logged as an error."""

    def __init__(self) -> None:
        super().__init__(logging.ERROR)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(record.getMessage())


def http(data: bytes) -> bytes:
    """Bytes on a connection to the page; neither a traceback nor silence may follow."""
    return asyncio.run(_asked(data))


async def _asked(data: bytes) -> bytes:
    errors = Quiet()
    logging.getLogger().addHandler(errors)
    server = ControlServer(Recorded(), token="open", pages=(status_page,))
    with bound("127.0.0.1", 0) as listening:
        await server.start(listening)
        try:
            async with asyncio.timeout(30.0):
                reader, writer = await asyncio.open_connection(*listening.getsockname())
                with contextlib.suppress(ConnectionError):
                    writer.write(data)
                    writer.write_eof()
                    await writer.drain()
                answer = b""
                with contextlib.suppress(ConnectionError):
                    answer = await reader.read(1_000_000)
                writer.close()
        finally:
            await server.stop()
            logging.getLogger().removeHandler(errors)
    if errors.lines or answer.startswith(b"HTTP/1.1 500"):
        raise AssertionError(f"{errors.lines} {answer[:100]!r}")
    return answer


def mqtt(data: bytes) -> object:
    """A command."""
    notices = cast("Notices", SimpleNamespace(post=lambda *_args, **_keywords: None))
    commands = Commands(Recorded(), notices, Counter())
    return asyncio.run(commands.take(data, retained=False))


TARGETS: dict[str, Target] = {
    "codec": Target(codec, samples.STREAMS, samples.FRAME_TOKENS),
    "messages": Target(messages, samples.PAYLOADS, samples.FRAME_TOKENS),
    "tlog": Target(recording, samples.TLOGS, samples.FRAME_TOKENS),
    "dataflash": Target(recording, samples.DATAFLASHES, samples.DATAFLASH_TOKENS),
    "ulog": Target(recording, samples.ULOGS, samples.ULOG_TOKENS),
    "chronicle": Target(chronicle, samples.RECORDINGS, samples.FRAME_TOKENS),
    "frame": Target(frame, samples.FRAMES, samples.JSON_TOKENS),
    "table": Target(table, samples.TABLES, samples.TOML_TOKENS),
    "configuration": Target(configured, samples.CONFIGURATIONS, samples.TOML_TOKENS),
    "secret": Target(secret, samples.SECRETS),
    "state": Target(state, samples.STATES),
    "sums": Target(sums, samples.SUMS, samples.JSON_TOKENS),
    "flight": Target(flight, samples.FLIGHTS),
    "journal": Target(journal, samples.JOURNALS, samples.JSON_TOKENS),
    "http": Target(http, samples.REQUESTS, samples.HTTP_TOKENS),
    "mqtt": Target(mqtt, samples.COMMANDS, samples.JSON_TOKENS),
}
