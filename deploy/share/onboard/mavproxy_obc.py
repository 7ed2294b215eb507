"""MAVProxy's command ``obc``: what onboard knows, and the approval of what it proposes.

Runs in the ground station's MAVProxy, which needs nothing of onboard but this file::

    PYTHONPATH=/usr/share/onboard mavproxy.py --load-module mavproxy_obc

``obc status`` asks for the ``OBC_*`` parameters and shows them as they arrive, ``obc approve``
sets ``OBC_APPROVE``.  Everything goes over MAVLink, to the component of the vehicle's own system.
"""

from __future__ import annotations

import math
from typing import Any

from MAVProxy.modules.lib import mp_module

COMPONENT = 191  # MAV_COMP_ID_ONBOARD_COMPUTER
REAL32 = 9  # MAV_PARAM_TYPE_REAL32
STATES = (
    "no autopilot", "waiting for GPS", "learning", "calibrated", "waits for `obc approve`",
    "writing", "stopping", "half written",
)  # fmt: skip
IMU_STATES = (
    "not heard of", "collecting", "calibrated", "insufficient", "invalid", "approval",
    "held back", "writing", "up to date", "rejected",
    "half written",
)  # fmt: skip
SHOWN = ("OBC_STATE", "OBC_TRUST", "OBC_COVERAGE", "OBC_WAITING")
IMUS = (1, 2, 3)


class OnboardModule(mp_module.MPModule):  # type: ignore[misc]  # MAVProxy has no types
    """The command and what it has heard."""

    def __init__(self, mpstate: object) -> None:
        super().__init__(mpstate, "obc", "in-flight accelerometer calibration")
        self._asked: set[str] = set()
        self.add_command("obc", self.command, "onboard's calibration", ["status", "approve"])

    def command(self, words: list[str]) -> None:
        """``obc status``, ``obc approve``."""
        if words == ["status"]:
            self._asked = {*SHOWN, *(f"OBC_{n}_STAT" for n in IMUS)}
            for name in sorted(self._asked):
                self.master.mav.param_request_read_send(
                    self.target_system, COMPONENT, name.encode(), -1
                )
        elif words == ["approve"]:
            self._asked = {"OBC_APPROVE", "OBC_WAITING"}
            self.master.mav.param_set_send(
                self.target_system, COMPONENT, b"OBC_APPROVE", 1.0, REAL32
            )
        else:
            print("usage: obc status | obc approve")

    def mavlink_packet(self, packet: Any) -> None:  # noqa: ANN401 - MAVProxy's
        """Show what was asked for, once; the service's other announcements are not for us."""
        if packet.get_type() != "PARAM_VALUE" or packet.get_srcComponent() != COMPONENT:
            return
        if packet.get_srcSystem() == self.target_system and packet.param_id in self._asked:
            self._asked.discard(packet.param_id)
            print(f"obc: {self.told(packet.param_id, packet.param_value)}")

    def told(self, name: str, value: float) -> str:
        """A parameter in words; whoever speaks as the component may say anything."""
        number = int(value) if math.isfinite(value) else -1
        if number < 0:
            return f"{name} says nothing ({value:g})"
        if name == "OBC_STATE":
            return STATES[number] if number < len(STATES) else f"state {number}"
        if name.endswith("_STAT"):
            said = IMU_STATES[number] if number < len(IMU_STATES) else f"state {number}"
            return f"accelerometer {name.split('_')[1]}: {said}"
        return {
            "OBC_TRUST": "GPS is trusted" if number else "GPS is not trusted",
            "OBC_COVERAGE": f"{number} % of the six numbers covered",
            "OBC_WAITING": f"{number} accelerometer(s) wait for approval",
            "OBC_APPROVE": "approved, being written" if number else "nothing to approve",
        }[name]


def init(mpstate: object) -> OnboardModule:
    """What MAVProxy calls."""
    return OnboardModule(mpstate)
