"""What the bytes look like if they are right, and the words that they are made of."""

from __future__ import annotations

import json
import tempfile
from dataclasses import asdict
from pathlib import Path

import msgspec
import numpy as np

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.saving import SavedEngine, dump
from onboard.core.filter.noise import NoiseLevels
from onboard.core.maths.blocks import Block, Seconds
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import Linearisation
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.daemon.learning.flight import Judged, JudgedFlight, encode
from onboard.daemon.learning.store import Store
from onboard.daemon.view.history import Kept, Ring, Row
from onboard.mavlink.codec import Codec
from onboard.mavlink.dialect import mavlink
from onboard.push.diagnosed import Diagnosed
from onboard.push.entries import (
    Closed,
    Found,
    Planned,
    ReadBack,
    Refused,
    Result,
    Support,
    Undoing,
    Verdict,
    Watched,
    Writing,
)
from tests.daemon.daemons import calibration
from tests.mavlink.mavlink_peer import attitude, heartbeat, raw_imu
from tests.push.pushing import make_plan
from tests.recordings.dataflash_writer import modern_log, old_log
from tests.recordings.table_writer import MAP, MOTORS
from tests.recordings.telemetry_writer import px4_log, telemetry

ROOT = Path(__file__).resolve().parents[2]

_sender = Codec(system=3, component=1)
_frames = [
    _sender.encode(message)
    for message in (
        heartbeat(),
        attitude(5),
        raw_imu(7),
        mavlink.MAVLink_statustext_message(6, b"hello"),
        mavlink.MAVLink_param_value_message(b"INS_ACCSCAL_X", 1.01, 9, 1, 0),
    )
]
STREAMS = (b"".join(_frames), b"\xfe\xfc\xfe\xff" * 200, b"\xfd" * 500 + _frames[0])
PAYLOADS = (bytes(range(256)) * 2, bytes(600), b"\xff" * 600)
FRAME_TOKENS = (b"\xfd\x09\x00\x00\x00\x00\x00\xee\xee\x7e", b"\xfe\x1e", *_frames[:2])
TLOGS = (bytes(telemetry(1)), bytes(telemetry(1, version=1)))
DATAFLASHES = (bytes(modern_log(1)), bytes(old_log(1)))
DATAFLASH_TOKENS = (b"\xa3\x95", b"\xa3\x95\x80", b"QBfeLZaN", b"TimeUS", b"header", b",", b"IMU\0")
ULOGS = (px4_log(1),)
ULOG_TOKENS = (
    b"\x2f\x73\x13\x20\x25\x0c\xbb\x12",
    b"sensor_combined",
    b"[99]",
    b"[65535]",
    b"uint64_t timestamp;",
    b"double",
    b"float",
    b":",
    b";",
    b"D",
    b"A",
    b"F",
)
RECORDINGS = (*TLOGS, *DATAFLASHES, *ULOGS)
CONFIGURATIONS = (
    (ROOT / "systemd" / "onboard.toml").read_bytes(),
    b"[link]\nendpoints = ['udpin:127.0.0.1:1', 'serial:/dev/x:57600']\n[push]\nimus = [1, 2]\n",
    b'[http]\naddress = "0.0.0.0"\ntoken = "x"\n[mqtt]\nenabled = true\ntls = true\n',
)
TOML_TOKENS = (
    b"[link]", b"[http]", b"inf", b"-inf", b"nan", b"1e999", b"0x", b"[", b"]", b"{", b"}", b'"""',
    b"\\u0000", b"'", b"=", b".", b"\n", b"9" * 400, b"1979-05-27", b"udpin:", b"[::1]:",
)  # fmt: skip
FRAMES = (
    json.dumps(asdict(CopterAirframe())).encode(),
    json.dumps(asdict(PlaneAirframe())).encode(),
    b'{"mass": 2.5, "moment_of_inertia": [1, 2, 3], "mdrag_coef": 0}',
)
MAP_ENDS = b"\n=====\n"
"""Between a column map and its table."""


def _table() -> bytes:
    rows = [
        {"t_ms": 40.0 * k, "qw": 1.0, "qx": 0.0, "qy": 0.0, "qz": 0.01 * k, "ax": 0.0, "ay": 0.1}
        | {"az": 1.0, "gx": 0.0, "gy": 0.0, "gz": 1.0, "ve": 0.1 * k, "vn": 0.0, "vu": 0.0}
        | {"e": 0.002 * k * k, "n": 0.0, "u": 1.0, "m1": 1500, "m2": 1500, "m3": 1500, "m4": 1500}
        | {"mv": 12000}
        for k in range(60)
    ]
    head = ",".join(rows[0])
    return "\n".join([head, *(",".join(map(str, row.values())) for row in rows)]).encode()


TABLES = (
    MAP.encode() + MAP_ENDS + _table(),
    (MAP + MOTORS).encode() + MAP_ENDS + _table(),
)
SECRETS = (b"open sesame\n", b"\n", "wörter\r\nzwei".encode())


def _states() -> tuple[bytes, ...]:
    with tempfile.TemporaryDirectory() as name:
        store = Store(Path(name))
        store.save(1, b'{"version": 4, "engines": []}', version="1.0", saved_at=1.0, flight=b"\x80")
        saved = store.path(1).read_bytes()
    row = Row(1.0, 2.0, (1.0,) * 6, (0.1,) * 6, (None,) * 6)
    kept = msgspec.msgpack.encode(Kept(imus={1: Ring(rows=[row, row], trusted_s=9.0)}))
    return saved, kept


STATES = _states()


def _sums() -> bytes:
    m = 12
    rng = np.random.default_rng(1)
    rows = rng.normal(size=(50, m))
    square = rows.T @ rows
    block = Block(0.0, 9.0, NormalSums(square, rows.sum(axis=0), 0.1 * square, 60.0, 50.0, 1.0))
    point = Linearisation(
        scale=(1.0, 1.0, 1.0), beta=(0.0, 0.0, 0.0), delay=0.1, window=0.0, attitude_delay=0.0
    )
    prior = (1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
    engine = SavedEngine(
        1, 5.0, prior, point, (0.0, 0.0, 0.0), NoiseLevels(), Seconds(9.0, 9.0), (block,) * 2
    )
    return dump([engine])


SUMS = (Calibrator().to_bytes(), _sums())
_support = Support("flight", 1.0, "0a", 200.0)
_diagnosed = Diagnosed(
    imu=1,
    verdict="clean",
    effects=(),
    calibration=calibration(1),
    missing="",
    modelled=False,
    document={"schema": "onboard.explain/1"},
)
FLIGHTS = (encode(JudgedFlight(_support, {1: Judged(1.0, (1.0,) * 3 + (0.0,) * 3, _diagnosed)})),)
JSON_TOKENS = (
    b"null", b"true", b"1e999", b"-1", b"NaN", b"[", b"]", b"{", b"}", b'"', b",", b":", b"\\ud800",
    b"9" * 400, b'"imus"', b'"type"', b"#,", b"\n",
)  # fmt: skip


def _journal() -> bytes:
    plan = make_plan()
    name = plan.names[0]
    entries = (
        Planned("a", plan, support=_support),
        Writing("a", name, 1.0, 1.01),
        ReadBack("a", name, 1.01, saved=True),
        Undoing("b", "armed", "x"),
        Closed("a", Result.COMPLETED, "none", "done", plan.wanted),
        Watched("a", Verdict.KEPT, "fine", 1.0, None),
        Found("f", 1, "clean", ("gps_latency",), ""),
        Refused("r", 1, "no"),
    )
    return b"".join(
        b'{"schema":1,"at":1.0,"check":#,"entry":%s}\n' % msgspec.json.encode(entry)
        for entry in entries
    )


JOURNALS = (_journal(),)
REQUESTS = (
    b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"GET /api/snapshot HTTP/1.1\r\nHost: [::1]:8191\r\nOrigin: http://[::1]:8191\r\n\r\n",
    b"GET /static/main.js HTTP/1.1\r\nHost: x\r\nRange: bytes=0-5\r\nIf-Range: Sat\r\n\r\n",
    (
        b"POST /api/approve HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer open\r\n"
        b"Content-Type: application/json\r\nContent-Length: 13\r\n\r\n"
        b'{"imus": [1]}'
    ),
    (
        b"POST /api/reject HTTP/1.1\r\nHost: x\r\nAuthorization: Bearer open\r\n"
        b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
        b"2\r\n{}\r\n0\r\n\r\n"
    ),
    (
        b"GET /api/live HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        b"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        b"\x81\x85\x00\x00\x00\x00hello"
    ),
)
HTTP_TOKENS = (
    b"\r\n", b"\r\n\r\n", b"Host: ", b"Origin: ", b"Content-Length: -1", b"HTTP/9.9", b"%00",
    b"%2e%2e/", b"[::1", b"Expect: 100-continue\r\n", b"Content-Encoding: gzip\r\n",
    b"\xff", b"chunked", b"..",
)  # fmt: skip
COMMANDS = (
    b"approve",
    b'{"command": "rollback", "imus": [1, 2], "id": "x"}',
    b'{"command":"reset"}',
)
