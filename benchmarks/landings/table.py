"""What a soak has shown, for people."""

from __future__ import annotations

from benchmarks.landings.checker import Push
from benchmarks.landings.room import EPOCH
from benchmarks.landings.story import Landed, Story

RULES = {
    1: "of the board that is there, and right",
    2: "supported by a flight or a person, which the journal names",
    3: "not while armed",
    4: "nothing that somebody else set is overwritten",
    5: "not before all accelerometers are diagnosed",
}


def table(story: Story) -> str:
    """Landings, each with its writes and what was held back; pushes; rules."""
    lines = ["landing  board  flown      at  before it; held back after it"]
    lines += [_landing(landed) for landed in story.landings]
    lines += ["", "      at  board  IMU  what       writes  result        support"]
    lines += [_push(push) for push in story.checker.pushes.values()]
    lines += ["", "rule  checked  broken"]
    for rule, text in RULES.items():
        broken = sum(fault.startswith(f"({rule})") for fault in story.checker.faults)
        lines.append(f"{rule:4d}  {story.checker.checked[rule]:7d}  {broken:6d}  {text}")
    return "\n".join(lines)


def _landing(landed: Landed) -> str:
    flight = landed.flight
    before = ", ".join(incident.name.lower() for incident in landed.incidents) or "-"
    held = ", ".join(sorted(landed.held_back)) or "-"
    return (
        f"{flight.number:7d}  {flight.board.name:>5}  {flight.seconds:4.0f}s  "
        f"{flight.landed - EPOCH:6.0f}  {before}; {held}"
    )


def _push(push: Push) -> str:
    return (
        f"{push.at - EPOCH:8.0f}  {push.board.name:>5}  {push.imu:3d}  {push.purpose:9}  "
        f"{push.writes:6d}  {push.result:12}  {push.support}"
    )
