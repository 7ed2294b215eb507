"""Estimator state across restarts of the daemon: the sums and the point they are about.

One JSON document (the sums as base64 of their bytes): a few tens of kilobytes, readable enough to
be looked at, and refused as a whole if anything in it does not fit.
"""

from __future__ import annotations

import base64
import binascii
import json
from dataclasses import asdict, dataclass
from typing import Any

from onboard.core.noise import NoiseLevels
from onboard.core.passes import Linearisation, Portion
from onboard.core.sums import NormalSums
from onboard.errors import StateError

VERSION = 1
MOST_PORTIONS = 16


@dataclass(frozen=True, slots=True)
class SavedEngine:
    """What one accelerometer's engine needs to go on where it stopped.

    ``device_id`` is the autopilot's INS_ACCn_ID, None where it was not known: sums of one sensor
    must never be used for another.
    """

    imu: int
    device_id: float | None
    prior: tuple[float, ...]
    point: Linearisation
    noise: NoiseLevels
    trusted_s: float
    portions: tuple[Portion, ...]


def merged(portions: list[Portion], most: int = MOST_PORTIONS) -> list[Portion]:
    """At most ``most`` portions, neighbours added up."""
    while len(portions) > most:
        pairs = [
            Portion(a.start, b.end, a.sums + b.sums)
            for a, b in zip(portions[::2], portions[1::2], strict=False)
        ]
        portions = pairs + ([portions[-1]] if len(portions) % 2 else [])
    return portions


def dump(engines: list[SavedEngine]) -> bytes:
    """The document."""
    body = [
        {
            "imu": e.imu,
            "device_id": e.device_id,
            "prior": list(e.prior),
            "point": asdict(e.point),
            "noise": asdict(e.noise),
            "trusted_s": e.trusted_s,
            "portions": [
                {
                    "start": p.start,
                    "end": p.end,
                    "sums": base64.b64encode(p.sums.to_bytes()).decode("ascii"),
                }
                for p in e.portions
            ],
        }
        for e in engines
    ]
    return json.dumps({"version": VERSION, "engines": body}).encode()


def load(data: bytes) -> list[SavedEngine]:
    """Inverse of :func:`dump`.

    Raises:
        StateError: damaged, or of another version.
    """
    try:
        document: dict[str, Any] = json.loads(data)
        if document["version"] != VERSION:
            raise StateError(f"saved state is of version {document['version']}, not {VERSION}")
        return [_engine(e) for e in document["engines"]]
    except (KeyError, TypeError, ValueError, UnicodeDecodeError, binascii.Error) as error:
        raise StateError(f"saved state is damaged: {error}") from error


def _engine(e: dict[str, Any]) -> SavedEngine:
    point = e["point"]
    return SavedEngine(
        int(e["imu"]),
        None if e["device_id"] is None else float(e["device_id"]),
        tuple(float(x) for x in e["prior"]),
        Linearisation(
            scale=tuple(point["scale"]),
            beta=tuple(point["beta"]),
            delay=float(point["delay"]),
            window=float(point["window"]),
            attitude_delay=float(point["attitude_delay"]),
        ),
        NoiseLevels(**{k: float(v) for k, v in e["noise"].items()}),
        float(e["trusted_s"]),
        tuple(
            Portion(
                float(p["start"]),
                float(p["end"]),
                NormalSums.from_bytes(base64.b64decode(p["sums"], validate=True)),
            )
            for p in e["portions"]
        ),
    )
