"""Estimator state across restarts of the daemon: the sums and the point they are about.

One JSON document (the sums as base64 of their bytes): a few tens of kilobytes, readable enough to
be looked at, and refused as a whole if anything in it does not fit.
"""

from __future__ import annotations

import base64
import binascii
import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

from onboard.core.filter.limits import LIMITS
from onboard.core.filter.noise import STATED, NoiseLevels
from onboard.core.maths.arrays import Vector3, vector2, vector3, vector4
from onboard.core.maths.blocks import Block, Seconds
from onboard.core.maths.sums import NormalSums
from onboard.core.model.linearisation import Linearisation
from onboard.errors import StateError

VERSION = 7
"""1: sums without the antenna's place among the unknowns.  2: with time on the ground in them.
3: without what an EKF takes the receiver's delay for.  4: without errors of its accelerometer.
6: without the flights that they are of, and the place that the antenna's counts from."""


@dataclass(frozen=True, slots=True)
class SavedEngine:
    """What one accelerometer's engine needs to go on where it stopped.

    ``device_id`` is the autopilot's INS_ACCn_ID, None where it was not known: sums of one sensor
    must never be used for another.  ``told`` is the lever arm that the antenna's place counts from,
    body axes, m.  ``flights`` are those that are in the sums, by what whoever flew them calls them:
    a flight must never be counted twice.
    """

    imu: int
    device_id: float | None
    prior: tuple[float, ...]
    point: Linearisation
    told: Vector3
    noise: NoiseLevels
    seconds: Seconds
    blocks: tuple[Block, ...]
    flights: tuple[str, ...] = ()


def dump(engines: Iterable[SavedEngine]) -> bytes:
    """The document."""
    body = [
        {
            "imu": e.imu,
            "device_id": e.device_id,
            "prior": list(e.prior),
            "point": asdict(e.point),
            "told": list(e.told),
            "noise": asdict(e.noise),
            "seconds": asdict(e.seconds),
            "flights": list(e.flights),
            "portions": [
                {
                    "start": p.start,
                    "end": p.end,
                    "sums": base64.b64encode(p.sums.to_bytes()).decode("ascii"),
                }
                for p in e.blocks
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
    except (
        KeyError,
        TypeError,
        AttributeError,
        ValueError,
        OverflowError,
        RecursionError,
        binascii.Error,
    ) as error:
        raise StateError(f"saved state is damaged: {error}") from error


def _engine(e: dict[str, Any]) -> SavedEngine:
    point = e["point"]
    prior = tuple(_finite(x) for x in e["prior"])
    if len(prior) != 6:
        raise StateError("saved state is damaged: the prior is not six numbers")
    blocks = tuple(
        Block(
            _finite(p["start"]),
            _finite(p["end"]),
            NormalSums.from_bytes(base64.b64decode(p["sums"], validate=True)),
        )
        for p in e["portions"]
    )
    if not blocks:
        raise StateError("saved state is damaged: an accelerometer without sums")
    # One walk for all axes, once, and as strong however much the flight was shaken.
    calm = {name: LIMITS[name][0] for name in ("shaken_walk", "shaken_lift")}
    once = {"lift_walk": e["noise"]["force_walk"], **calm}
    levels = {**once, **e["noise"]}
    noise = NoiseLevels(**{k: _finite(v) for k, v in levels.items()})
    for name, level in asdict(noise).items():
        # Nothing goes with what a receiver states that tells nothing.
        if level < 0.0 or (level == 0.0 and name not in STATED):
            raise StateError("saved state is damaged: noise levels that are not positive")
    return SavedEngine(
        int(e["imu"]),
        None if e["device_id"] is None else _finite(e["device_id"]),
        prior,
        Linearisation(
            scale=vector3(map(_finite, point["scale"])),
            beta=vector3(map(_finite, point["beta"])),
            delay=_finite(point["delay"]),
            window=_finite(point["window"]),
            attitude_delay=_finite(point["attitude_delay"]),
            heading=_finite(point.get("heading", 0.0)),
            tilt=vector2(map(_finite, point.get("tilt", (0.0, 0.0)))),
            antenna=vector3(map(_finite, point.get("antenna", (0.0, 0.0, 0.0)))),
            shapes=vector4(map(_finite, point.get("shapes", (0.0, 0.0, 0.0, 0.0)))),
        ),
        vector3(map(_finite, e["told"])),
        noise,
        Seconds(_finite(e["seconds"]["trusted"]), _finite(e["seconds"]["brisk"])),
        blocks,
        tuple(map(str, e["flights"])),
    )


def _finite(value: float | str) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError("a number that is not finite")
    return number
