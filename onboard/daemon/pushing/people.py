"""People's part: which reasons against a push a person lifts, and how."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from onboard.daemon.view.state import NOTHING_GAINED, landing_lifts

PEOPLE: Final = frozenset({"approval", "refused", "unconfirmed"})
"""Reasons that a person lifts."""
DIAGNOSIS: Final = frozenset({"physics_missing", "imu_stuck", "not_diagnosed"})
"""Reasons that a person lifts by saying so explicitly."""
UNWRITABLE: Final = frozenset({"out_of_bounds", "no_way_back", "zero_offsets", "name_not_allowed"})
"""Reasons against the very values that an approval would be for, or against those of before."""


def approvable(held_back: Mapping[str, str]) -> bool:
    """Whether a person's approval would lift one of the reasons, and something is to be gained.

    Values that are never written are not approved: better ones would wait for them to lapse.
    That this flight is not diagnosed yet, which it will be after the landing, is none of them.
    """
    lifted = [n for n in held_back if n in PEOPLE | DIAGNOSIS and not landing_lifts(n, held_back)]
    return bool(lifted) and not held_back.keys() & (NOTHING_GAINED | UNWRITABLE)


def told(imu: int, held_back: Mapping[str, str]) -> dict[str, str]:
    """The reasons with what a person can do about them: never a command that would be refused."""
    found = dict(held_back)
    despite = " --despite-diagnosis" if held_back.keys() & DIAGNOSIS else ""
    command = f"`onboard approve {imu}{despite}`" if approvable(held_back) else ""
    if "refused" in found and command:
        found["refused"] += f"; {command} lifts that"
    if "unconfirmed" in found:
        found["unconfirmed"] += f": fly, or {command}" if command else ": fly"
    return found


def named(imus: Sequence[int]) -> str:
    """IMU 1, IMU 2."""
    return ", ".join(f"IMU {imu}" for imu in imus)
