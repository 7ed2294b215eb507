"""Recordings in blocks hold the samples that they hold one by one, and give the same answers."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from onboard.answers.recorded import Recorded
from onboard.answers.replay import read
from onboard.core.inputs.blocks import Block
from onboard.core.inputs.samples import ImuSample, Sample
from onboard.mavlink.bootclock import WRAP_S
from onboard.mavlink.decode import Decoder
from onboard.recordings import dataflash, tlog
from onboard.recordings.opening import open_recording
from onboard.recordings.packet_blocks import PacketBlocks
from onboard.recordings.packets import Unpacker
from tests.core.inputs.in_blocks import differing
from tests.recordings.dataflash_writer import DataflashWriter, modern_log, old_log
from tests.recordings.telemetry_writer import TelemetryWriter, heartbeat, telemetry


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """Short logs in several blocks, too."""
    monkeypatch.setattr(tlog, "BLOCK", 60)
    monkeypatch.setattr(dataflash, "BLOCK", 90)


def saved(folder: Path, data: object) -> Path:
    path = folder / "log"
    path.write_bytes(bytes(data))
    return path


def singly(path: Path) -> list[Sample]:
    """Samples of pieces, those of blocks one by one."""
    pieces = open_recording(path).pieces()
    return [
        s for piece in pieces for s in (piece.samples() if isinstance(piece, Block) else (piece,))
    ]


def in_blocks(path: Path) -> int:
    return sum(len(p) for p in open_recording(path).pieces() if isinstance(p, Block))


def assert_same(path: Path) -> None:
    recording = open_recording(path)
    assert [repr(s) for s in singly(path)] == [repr(s) for s in recording.samples()]
    alone, together = Recorded(watched=True), Recorded(watched=True)
    one = read([replace(recording, gather=None)], alone)
    other = read([recording], together)
    assert not differing(alone, together)
    assert repr(one.vehicle.counts) == repr(other.vehicle.counts)


def flown(
    change: Callable[[TelemetryWriter, int, float], None] = lambda log, k, t: None,
    clock: Callable[[float], float] = lambda t: t,
    seconds: int = 12,
    *,
    highres: bool = False,
) -> TelemetryWriter:
    """A straight flight with two accelerometers; something is done to it every 20 ms."""
    log, r = TelemetryWriter(), random.Random(7)
    log.add(heartbeat(armed=True))
    for k in range(50 * seconds):
        t = clock(30.0 + 0.02 * k)
        us, ms = round(t * 1e6), round(t * 1e3) % 2**32
        six = [r.randrange(-3000, 3000) for _ in range(6)]
        log.add(mavlink.MAVLink_raw_imu_message(us, *six, 0, 0, 0, 0, 4000 + k))
        log.add(mavlink.MAVLink_scaled_imu2_message(ms, *six[::-1], 0, 0, 0, -k))
        log.add(mavlink.MAVLink_attitude_message(ms, r.gauss(0, 0.1), 0.02, 1.5, 0, 0, 0))
        if highres:
            log.add(mavlink.MAVLink_highres_imu_message(
                us, *(1e-2 * x for x in six), 0, 0, 0, 0, 0, 0, 0, 0xFFFF))  # fmt: skip
        if k % 10 == 0:
            log.add(mavlink.MAVLink_gps_raw_int_message(
                us, 3, 450000000 + round(900 * 0.02 * k), 80000000, 500000, 80, 100, 1000, 0, 12,
                vel_acc=300))  # fmt: skip
        if k % 25 == 0:
            log.add(heartbeat(armed=True))
            log.add(mavlink.MAVLink_vfr_hud_message(10.0, 10.0, 0, 40, 100.0, 0.0))
            log.add(mavlink.MAVLink_vibration_message(us, 0.1, 0.2, 0.3, 0, 0, k))
            log.add(mavlink.MAVLink_system_time_message(0, ms))
        change(log, k, t)
    return log


def test_what_is_many_goes_in_blocks(tmp_path):
    path = saved(tmp_path, flown())
    assert_same(path)
    assert in_blocks(path) > 0.9 * len(singly(path))


def at(
    k: int, *messages: Callable[[float], object]
) -> Callable[[TelemetryWriter, int, float], None]:
    """Add messages once."""

    def change(log: TelemetryWriter, now: int, t: float) -> None:
        if now == k:
            for message in messages:
                log.add(message(t))

    return change


def scaled(t: float, *six: int) -> object:
    return mavlink.MAVLink_scaled_imu2_message(round(t * 1e3) % 2**32, *(six or (1,) * 6), 0, 0, 0)


def attitude(t: float, roll: float = 0.1) -> object:
    return mavlink.MAVLink_attitude_message(round(t * 1e3) % 2**32, roll, 0.0, 0.0, 0, 0, 0)


UNIX_US = 1_700_000_000_000_000


def us(t: float) -> int:
    return round(t * 1e6)


def parameter(name: bytes, value: float) -> object:
    return lambda t: mavlink.MAVLink_param_value_message(name, value, 9, 1, 0)


def highres_imu(x: float, fields: int) -> object:
    return lambda t: mavlink.MAVLink_highres_imu_message(
        us(t), x, 2, 3, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, fields
    )


def fix_at(t_us: int) -> object:
    return lambda t: mavlink.MAVLink_gps_raw_int_message(
        t_us, 3, 450005400, 80000000, 500000, 80, 100, 1000, 0, 12
    )


def raw(t_us: int, number: int = 0) -> object:
    return mavlink.MAVLink_raw_imu_message(t_us, *(9,) * 6, 0, 0, 0, number)


def absent(log: TelemetryWriter, k: int, t: float) -> None:
    log.add(mavlink.MAVLink_scaled_imu3_message(round(t * 1e3), *(0,) * 9))


def others(log: TelemetryWriter, k: int, t: float) -> None:
    for system, component in ((2, 1), (1, 100), (255, 190)):
        log.add(scaled(t, 7, 7, 7, 7, 7, k), system=system, component=component)


CHANGES = {
    "a stray stamp": at(300, lambda t: scaled(5.0)),
    "two stray stamps": at(300, lambda t: scaled(5.0), lambda t: scaled(5.02)),
    "one stray stamp, and another": lambda log, k, t: k in (200, 300) and log.add(scaled(5.0)),
    "a stray vibration": at(
        300, lambda t: mavlink.MAVLink_vibration_message(us(5.0), 0, 0, 0, 0, 0, 0)
    ),
    "late": at(300, lambda t: scaled(t - 1.0), lambda t: attitude(t - 2.0)),
    "ahead": at(300, lambda t: attitude(t + 7.0)),
    "Unix time": at(300, lambda t: raw(UNIX_US)),
    "absent": absent,
    "another number": at(300, lambda t: raw(us(t), 2)),
    "no angle": at(300, lambda t: attitude(t, math.nan)),
    "zero angles": at(300, lambda t: attitude(t, 0.0)),
    "no force": at(300, highres_imu(math.nan, 0xFFFF)),
    "force not told": at(300, highres_imu(1.0, 0x38)),
    "rate not told": at(300, highres_imu(1.0, 0x07)),
    "parameter": at(300, parameter(b"INS_ACCSCAL_X", 1.05)),
    "board": at(300, parameter(b"AHRS_ORIENTATION", 2.0)),
    "disarmed": at(300, lambda t: heartbeat(armed=False)),
    "others": others,
    "fix without a time": at(300, fix_at(0)),
    "fix in Unix time": at(300, fix_at(UNIX_US)),
}
CLOCKS = {
    "reboot": lambda t: t if t < 36.0 else t - 30.0,
    "forward": lambda t: t if t < 36.0 else t + 100.0,
    "back a little": lambda t: t if t < 36.0 else t - 2.0,
    "wrap": lambda t: t + WRAP_S - 36.0,
    "near the wrap": lambda t: t + WRAP_S - 100.0,
    "silence": lambda t: t if t < 36.0 else t + 4.0,
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("highres", [False, True])
def test_telemetry_with_one_thing_in_it(tmp_path, change, highres):
    assert_same(saved(tmp_path, flown(CHANGES[change], highres=highres)))


@pytest.mark.parametrize("clock", CLOCKS)
@pytest.mark.parametrize("highres", [False, True])
def test_telemetry_of_any_clock(tmp_path, clock, highres):
    assert_same(saved(tmp_path, flown(clock=CLOCKS[clock], highres=highres)))


@pytest.mark.parametrize("version", [1, 2])
def test_telemetry_of_both_versions(tmp_path, version):
    log = telemetry(seconds=3, system=7, version=version)
    assert_same(saved(tmp_path, telemetry(seconds=5, system=9, writer=log, version=version)))


def test_nothing_is_taken_before_the_first_heartbeat(tmp_path):
    log = TelemetryWriter()
    for k in range(200):
        log.add(scaled(10.0 + 0.02 * k, 1, 2, 3, 4, 5, 6))
    flown_later = bytes(log) + bytes(flown())
    path = saved(tmp_path, flown_later)
    assert_same(path)
    assert min(s.t for s in singly(path) if isinstance(s, ImuSample)) == 30.0


def test_without_a_heartbeat(tmp_path):
    log = TelemetryWriter()
    for k in range(500):
        log.add(scaled(10.0 + 0.02 * k, 1, 2, 3, 4, 5, k))
    path = saved(tmp_path, log)
    assert_same(path)
    assert in_blocks(path) == 500


@pytest.mark.parametrize("seed", range(12))
def test_damaged_telemetry(tmp_path, seed):
    data, r = bytearray(bytes(flown(seconds=6))), random.Random(seed)
    for _ in range(12):
        begin = r.randrange(len(data))
        if seed % 3 == 0:
            data[begin] ^= 1 << r.randrange(8)
        elif seed % 3 == 1:
            del data[begin : begin + r.randrange(1, 400)]
        else:
            part = data[begin : begin + 3000]
            data[r.randrange(len(data)) :] += part
    assert_same(saved(tmp_path, data))


def test_what_is_refused_is_counted_alike():
    log = flown(CHANGES["absent"], seconds=2)
    octets = np.frombuffer(bytes(log), np.uint8)
    at_ = np.array(log.places) + 8
    alone, together = Decoder(1, 1), Decoder(1, 1)
    for message in Unpacker()(octets, at_):
        alone.decode(message)
    assert PacketBlocks(octets, together, Unpacker())(at_) is not None
    assert together.refused == alone.refused == {"SCALED_IMU: absent": 100}
    assert together.clock.latest == alone.clock.latest


@pytest.mark.parametrize("log", [modern_log, old_log])
def test_logs(tmp_path, log):
    path = saved(tmp_path, log(12))
    assert_same(path)
    assert in_blocks(path) > 300


def test_an_attitude_that_is_laid_out_twice(tmp_path):
    assert_same(saved(tmp_path, bytes(modern_log(3)) + bytes(old_log(3)) + bytes(modern_log(3))))


@pytest.mark.parametrize("seed", range(12))
def test_damaged_logs(tmp_path, seed):
    data, r = bytearray(bytes(modern_log(12))), random.Random(seed)
    for _ in range(20):
        data[r.randrange(2000, len(data))] ^= 1 << r.randrange(8)
    assert_same(saved(tmp_path, data))


def test_numbers_that_are_none(tmp_path):
    log = DataflashWriter()
    log.format(10, "IMU", "QQfffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,T")
    for k in range(300):
        number = (0, 1, 4, 5, 2**64 - 1)[k % 5]
        heat = (0.0, 41.0, math.nan)[k % 3]
        log.add("IMU", 10_000_000 + 20_000 * k, number, 0.1, 0.2, 0.3, 1.0, 2.0, -9.0, heat)
    path = saved(tmp_path, log)
    assert_same(path)
    assert {s.imu for s in singly(path)} == {1, 2, 5}


@pytest.mark.slow
@pytest.mark.recordings
@pytest.mark.parametrize(
    "name", ["sitl/a01.tlog", "sitl/c01.BIN", "real/real-quad-07.BIN",
             "real/real-quad-12-gpsglitch.BIN", "real/real-quad-16-gaps.BIN"],
)  # fmt: skip
def test_recordings(recordings, monkeypatch, name):
    monkeypatch.undo()
    assert_same(recordings / name)
