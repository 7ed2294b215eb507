"""The sealed challenge: airframes concealed, answers locked away before anything is asked.

The generator (``sitl/builtin/airframe``) solves rigid-body dynamics at 1 kHz and shares no code
with what looks for the effects.  Each recording is a .tlog as a ground station writes it.  Each
answer is hashed, and the hash printed, before ``onboard match`` is started.
"""

from __future__ import annotations

import hashlib
import json
import struct
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as mav

from benchmarks.challenge import answers, kept, parser, summary
from benchmarks.matching.adapter import Asked, MatchError, by_command
from benchmarks.matching.concealing import ATTEMPTS, DRAWS, Challenge, Secret, dropped, gusty_planes
from benchmarks.matching.scoring import LEGEND, Outcome, describe, measured, table
from sitl.builtin.airframe.differences import differences
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.messages import packed
from sitl.recording import Flight, run, truth_record

MOST_SATURATED = 5e-3
"""Share of a flight in which motors may be at their limits; more would be flown slower."""


class NotFlownError(Exception):
    """No vehicle of the kind that was drawn can fly it."""


def made(secret: Secret) -> tuple[Flight, dict[str, Any]]:
    """A flight that its motors and surfaces can fly, and the answer.

    Raises:
        NotFlownError: none was drawn.
    """
    for attempt in range(DRAWS * ATTEMPTS):
        flight = run(secret.spec(attempt))
        if saturated(flight) <= MOST_SATURATED:
            break
    else:
        raise NotFlownError(f"{secret} asks for more than its vehicle has")
    aircraft = flight.spec.aircraft
    assert aircraft is not None
    answer = differences(aircraft, flight.pieces[-1].trajectory)
    record = truth_record(flight.spec)
    for effect in record["effects"]:
        if effect["name"] == "gps_latency":
            answer["gps_latency"] = {"delay": record["net_gps_delay_s"]}
        elif effect["name"] == "mount_tilt":
            answer["mount_tilt"] = {k: effect[k] for k in ("roll", "pitch")}
    return flight, {"vehicle": answer, "record": record, "names": sorted(secret.names)}


def saturated(flight: Flight) -> float:
    """Share of the flight in which forces and outputs do not belong to each other."""
    trajectory = flight.pieces[-1].trajectory
    outputs, aircraft = trajectory.outputs, flight.spec.aircraft
    assert outputs is not None
    assert aircraft is not None
    flying = np.flatnonzero(~trajectory.landed)
    inside = slice(flying[0] + 4000, flying[-1] - 6000)
    pwm = outputs.pwm[inside]
    frame = aircraft.craft
    if isinstance(frame, Airframe):
        span = frame.pwmMax - frame.pwmMin
        low, high = (frame.pwmMin + s * span for s in (frame.spin_min, frame.spin_max))
        at_limit = np.any((pwm <= low + 0.1) | (pwm >= high - 0.1), axis=1)
    else:
        force = outputs.mass[:, None] * trajectory.f_b - outputs.thrust_b - outputs.drag_b
        at_limit = np.max(np.abs(force[inside]), axis=1) > 1e-6
    return float(np.mean(at_limit))


def one(secret: Secret, asked: Asked = by_command) -> Outcome:
    """Draw, record, seal, ask."""
    begun = time.process_time()
    try:
        flight, answer = made(secret)
    except NotFlownError as error:
        return Outcome(secret, "", {}, None, failure=str(error))
    seal = hashlib.sha256(json.dumps(answer, sort_keys=True).encode()).hexdigest()
    with tempfile.TemporaryDirectory(prefix="matching-") as folder:
        path = Path(folder) / "flight.tlog"
        write(flight, path)
        took = time.process_time() - begun
        print(f"  sealed {seal[:16]}", file=sys.stderr, flush=True)
        started = time.monotonic()
        try:
            answered = asked(path)
        except (MatchError, OSError, ValueError, KeyError) as error:
            return Outcome(secret, seal, answer["vehicle"], None, failure=str(error))
        seconds = (took, time.monotonic() - started)
    values = measured(answer["vehicle"], answered)
    return Outcome(secret, seal, answer["vehicle"], answered, values, seconds)


def write(flight: Flight, path: Path) -> None:
    """The .tlog of a flight that has been flown."""
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:
        for unix_us, message in flight.messages:
            file.write(struct.pack(">Q", unix_us) + packed(message, packer))


def main(arguments: list[str] | None = None) -> None:
    """Command line."""
    options = parser("Sealed challenge of concealed airframes.", count=20, first=5000)
    options.add_argument("--vehicle", choices=("copter", "plane"), help="these alone")
    options.add_argument(
        "--name", help="single recordings of this effect alone; with --gusts those with it"
    )
    options.add_argument("--gusts", action="store_true", help="planes in turbulence alone")
    options.add_argument("--payloads", action="store_true", help="copters that drop one alone")
    options.add_argument("--all", action="store_true", help="say what was said of each")
    options.add_argument(
        "--seconds", nargs=2, type=float, help="of each flight, from the launch: least and most"
    )
    chosen = options.parse_args(arguments)
    secrets = Challenge(chosen.first).secrets()
    if chosen.gusts:
        secrets = gusty_planes(chosen.first)
    if chosen.payloads:
        secrets = dropped(chosen.first)
    if chosen.vehicle:
        secrets = [s for s in secrets if s.vehicle == chosen.vehicle]
    if chosen.name:
        beside = {"turbulence"} if chosen.gusts else set()
        secrets = [s for s in secrets if set(s.names) == beside | {chosen.name}]
    secrets = secrets[: chosen.count or len(secrets)]
    if chosen.seconds:
        least, most = chosen.seconds
        secrets = [replace(s, lasting_s=(least, most)) for s in secrets]

    def tell(o: Outcome) -> str:
        missed = o.secret.testable and not o.identified
        wrong = o.false or missed or o.overlooked or o.said is None
        return describe(o) if chosen.all or wrong else ""

    outcomes = kept(answers(one, secrets, chosen.processes), tell, chosen.save)
    print(table(outcomes))
    print(LEGEND)
    print(summary(outcomes, "match"))


if __name__ == "__main__":
    main()
