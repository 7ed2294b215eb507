"""Telemetry of a simulated flight, lost or changed in part, and what `onboard match` says of it."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from onboard.cli.main import run
from sitl import recording
from sitl.builtin.messages import packed


def matched(
    folder: Path, spec: recording.FlightSpec, heard: Callable[[float, Any], bool]
) -> dict[str, Any]:
    """What ``onboard match --json`` says of a flight.

    Args:
        folder: for the recording.
        spec: the flight.
        heard: of a time since the start, s, and a message, which it may change: whether it is
            recorded.
    """
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    log, answer = folder / "flight.tlog", folder / "answer.json"
    with log.open("wb") as file:
        for unix_us, message in recording.run(spec).messages:
            if heard(1e-6 * (unix_us - spec.start_unix_us), message):
                file.write(struct.pack(">Q", unix_us) + packed(message, packer))
    assert run(["match", str(log), "--json", str(answer)]) == 0
    told: dict[str, Any] = json.loads(answer.read_text())
    return told
