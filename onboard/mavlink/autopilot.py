"""What the link tells about the autopilot: who it is, and what happened to it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Protocol, TypeAlias

from onboard.mavlink.connection import ConnectionState
from onboard.mavlink.dialect import Message, mavlink
from onboard.mavlink.endpoint import Endpoint
from onboard.mavlink.vehicle import kind_of_vehicle
from onboard.outage import Over


class AutopilotState(Enum):
    """Whether an autopilot is heard."""

    SEARCHING = "searching"
    PRESENT = "present"
    SILENT = "silent"


@dataclass(frozen=True, slots=True)
class Autopilot:
    """Who the autopilot is, from its first HEARTBEAT.

    ``vehicle_type`` is a MAV_TYPE, ``firmware`` a MAV_AUTOPILOT.  Only ArduPilot's parameters
    are known to us: with any other firmware the daemon advises and never writes.
    """

    system: int
    component: int
    vehicle_type: int
    firmware: int

    @property
    def is_ardupilot(self) -> bool:
        """Whether the firmware is ArduPilot."""
        return self.firmware == int(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    @property
    def vehicle(self) -> str:
        """copter, plane (VTOL planes, too), rover, boat, submarine, airship or vehicle."""
        return kind_of_vehicle(self.vehicle_type) or "vehicle"

    @property
    def firmware_name(self) -> str:
        """``ardupilot``, ``px4`` or the number."""
        names = {3: "ardupilot", 12: "px4"}
        return names.get(self.firmware, f"autopilot {self.firmware}")


@dataclass(frozen=True, slots=True)
class AutopilotFound:
    """The first HEARTBEAT of an autopilot."""

    autopilot: Autopilot


@dataclass(frozen=True, slots=True)
class AutopilotSilent:
    """No HEARTBEAT for longer than the limit (s)."""

    silence: float


@dataclass(frozen=True, slots=True)
class AutopilotReturned:
    """Heartbeats came again after a silence."""


@dataclass(frozen=True, slots=True)
class AutopilotRebooted:
    """The boot clock began anew; ``count`` reboots since the link started.

    ``unseen``: in a silence, so that its stamps have not gone back.
    """

    count: int
    unseen: bool = False


@dataclass(frozen=True, slots=True)
class RivalHeard:
    """Somebody else, or another way, sent the vehicle's HEARTBEAT.

    ``same_clock``: its time stamps are those of the vehicle, so that it is another way to it.
    """

    armed: bool
    same_clock: bool


@dataclass(frozen=True, slots=True)
class TwinHeard:
    """Another service speaks under our own name; ``earlier``: it was there before us."""

    earlier: bool


@dataclass(frozen=True, slots=True)
class ConnectionChanged:
    """A connection changed its state, and why where there is a reason."""

    endpoint: Endpoint
    state: ConnectionState
    reason: str


@dataclass(frozen=True, slots=True)
class ConnectionTrouble:
    """A connection was lost or cannot be made: once for each reason of an outage."""

    endpoint: Endpoint
    reason: str


@dataclass(frozen=True, slots=True)
class ConnectionRestored:
    """A connection has held again for some seconds."""

    endpoint: Endpoint
    over: Over


LinkEvent: TypeAlias = (
    AutopilotFound
    | AutopilotSilent
    | AutopilotReturned
    | AutopilotRebooted
    | RivalHeard
    | TwinHeard
    | ConnectionChanged
    | ConnectionTrouble
    | ConnectionRestored
)


class Participant(Protocol):
    """A sans-IO protocol that the link drives: streams, parameters, the board's identity.

    The link calls ``start`` when the autopilot is found and again after it rebooted or came
    back, ``feed`` with each message of ``names`` and ``poll`` some times a second; messages
    returned are sent.  ``now`` is the link's monotonic clock, s.
    """

    @property
    def names(self) -> Iterable[str]:
        """Names of the messages to be fed."""

    def start(self, system: int, component: int, now: float) -> None:
        """Begin, or begin again, with this autopilot."""

    def feed(self, message: Message, now: float) -> Sequence[Message]:
        """Take a message; return the answers."""

    def poll(self, now: float) -> Sequence[Message]:
        """Return what is due."""
