"""Who the vehicle is: one source on one way, found, proven, silent, back again, or given up.

**One vehicle is one (system, component, endpoint, address).**  The first HEARTBEAT of an autopilot
is taken up, for without asking it for messages nothing can be proven; it is *pinned* once it has
shown a stream whose time advances.  What speaks as the vehicle on another way is counted and not
handed on.  The pin moves in five cases, and never while it is held (a push is under way):

* the one taken up has proven nothing, and another has, or has not been tried yet;
* it has been silent for a moment, and another way leads to the same boot clock (a second
  endpoint, a router that got another port): that is the same vehicle, nothing has happened;
* it has been silent for a moment, and on the same way another system begins whose boot clock goes
  on where its own has stopped: it has another system id, and is asked anew which board it is;
* it has been silent for as long as counts as lost, and another way claims to be it: that is told
  as a vehicle that is back, which is asked anew which board it is;
* it is lost, nothing was learned of it, and another vehicle is there.

Another vehicle is one with another id, or one of which the boot clock has gone on beside that of
this one: several that fly with the id they were sold with, and come by one port.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeAlias

from onboard.mavlink import limits
from onboard.mavlink.autopilot import (
    Autopilot,
    AutopilotFound,
    AutopilotReturned,
    AutopilotSilent,
    AutopilotState,
    RivalHeard,
)
from onboard.mavlink.claims import Claim, Claims, Source, Way
from onboard.mavlink.decode import is_armed, is_autopilot
from onboard.mavlink.dialect import Message, mavlink

Events: TypeAlias = tuple[AutopilotFound | AutopilotReturned | RivalHeard, ...]
AUTOPILOT1 = int(mavlink.MAV_COMP_ID_AUTOPILOT1)


class Whose(Enum):
    """Whose word a packet is."""

    VEHICLE = auto()
    SOMEBODY = auto()
    STANDBY = auto()
    FOREIGN = auto()


@dataclass(frozen=True, slots=True)
class Heard:
    """What a packet amounts to; ``events`` are to be told before it is handed on."""

    whose: Whose
    events: Events = ()


_OF_VEHICLE, _OF_SOMEBODY = Heard(Whose.VEHICLE), Heard(Whose.SOMEBODY)


class Presence:
    """Settles on one autopilot; ``now`` is the link's clock, s.

    Args:
        system: the only system id that counts; None takes any.
        component: likewise.
    """

    def __init__(self, system: int | None, component: int | None = None) -> None:
        self.autopilot: Autopilot | None = None
        self.state = AutopilotState.SEARCHING
        self.held: Callable[[], bool] = _no
        """Whether a push is under way: the pin stays where it is."""
        self.committed: Callable[[], bool] = _no
        """Whether something was learned of this vehicle, or written to it."""
        self.standby = 0
        self.foreign = 0
        self._system, self._component = system, component
        self._claims = Claims()
        self._pinned: Claim | None = None

    @property
    def way(self) -> Way | None:
        """The way that leads to the vehicle."""
        return None if self._pinned is None else self._pinned.way

    @property
    def source(self) -> Source | None:
        """The vehicle's system and component."""
        return None if self._pinned is None else self._pinned.source

    @property
    def proven(self) -> bool:
        """Whether the vehicle has shown a stream."""
        return self._pinned is not None and self._pinned.proven

    @property
    def chosen(self) -> bool:
        """Whether somebody has said which system it is to be."""
        return self._system is not None

    def rivals(self, now: float) -> int:
        """How many others claim to be this vehicle, with another clock, these seconds.

        One without a clock is none where it comes by another endpoint: nobody has asked there.
        """
        pinned = self._pinned
        if pinned is None:
            return 0
        return sum(
            claim is not pinned
            and claim.source == pinned.source
            and now - claim.heard <= limits.TWIN_S
            and not claim.continues(pinned, now)
            and (claim.boot is not None or claim.way[0] == pinned.way[0])
            for claim in self._claims
        )

    def namesake(self, now: float) -> bool:
        """Whether another vehicle was heard under this one's name these seconds."""
        pinned = self._pinned
        return pinned is not None and any(
            claim is not pinned
            and claim.source == pinned.source
            and claim.is_another
            and now - claim.heard <= limits.TWIN_S
            for claim in self._claims
        )

    def others(self, now: float) -> tuple[int, ...]:
        """System ids of other autopilots that were heard these seconds."""
        pinned = self._pinned
        if pinned is None:
            return ()
        live = (claim for claim in self._claims if now - claim.heard <= limits.TWIN_S)
        return tuple(sorted({claim.source[0] for claim in live} - {pinned.source[0]}))

    def hear(
        self, source: Source, way: Way, message: Message | None, boot: float | None, now: float
    ) -> Heard:
        """Take a packet that counts (of a known kind, signed where that is demanded).

        Args:
            source: its system and component.
            way: where it came from.
            message: None where nobody wants it.
            boot: the boot time that it tells, s; None if none.
            now: the link's clock, s.
        """
        claim = self._claims.get(source, way)
        beats = message is not None and is_autopilot(message) and self._counts(source)
        if message is not None and beats:
            armed = is_armed(message)
            claim = claim or self._claims.make(source, way, message, now)
            if claim is not None:
                claim.note_heartbeat(message, armed=armed, now=now)
        if claim is not None and boot is not None:
            claim.note_stamp(boot, now)
        heard = self._judge(source, way, claim, beats=beats, now=now)
        if claim is not None:
            claim.heard = now
        return heard

    def check(self, now: float) -> AutopilotSilent | None:
        """See whether the autopilot has fallen silent; tell it once."""
        if self._pinned is None or self.state is not AutopilotState.PRESENT:
            return None
        silence = now - self._pinned.beat
        if silence <= limits.HEARTBEAT_TIMEOUT_S:
            return None
        self.state = AutopilotState.SILENT
        return AutopilotSilent(silence)

    # How

    def _counts(self, source: Source) -> bool:
        return self._system in (None, source[0]) and self._component in (None, source[1])

    def _judge(
        self, source: Source, way: Way, claim: Claim | None, *, beats: bool, now: float
    ) -> Heard:
        pinned = self._pinned
        if pinned is None:
            if claim is None or not beats:
                return _OF_SOMEBODY
            return Heard(Whose.VEHICLE, self._take(claim, now))
        if claim is pinned:
            return Heard(Whose.VEHICLE, self._back()) if beats else _OF_VEHICLE
        if claim is not None and not self.held() and self._better(claim, pinned, now, beats=beats):
            return Heard(Whose.VEHICLE, self._take(claim, now))
        if source != pinned.source:
            self.foreign += claim is not None
            return _OF_SOMEBODY
        if claim is not None and claim.boot_at == now:
            claim.note_beside(pinned, now)
        other = way[0] != pinned.way[0]
        self.standby += other
        self.foreign += not other
        events: Events = ()
        if claim is not None and beats:
            events = (RivalHeard(claim.armed, same_clock=claim.continues(pinned, now)),)
        return Heard(Whose.STANDBY if other else Whose.FOREIGN, events)

    def _better(self, claim: Claim, pinned: Claim, now: float, *, beats: bool) -> bool:
        """Whether this claim is to be believed instead of the one that is."""
        if claim.continues(pinned, now):
            return now - pinned.heard > limits.FAILOVER_S
        if claim.is_renamed(pinned, now):
            return beats and now - pinned.heard > limits.FAILOVER_S
        lost = self.state is AutopilotState.SILENT
        same = claim.source == pinned.source and not claim.is_another
        if same and claim.proven and (lost or not pinned.proven):
            return beats
        if same and lost:  # perhaps it was not asked for anything yet, or somebody only beats
            configured = claim.way[0] != pinned.way[0]
            return beats and (configured or now - pinned.beat > limits.GIVEN_UP_S)
        if self.committed():
            return False
        if not pinned.proven and claim.proven:
            return True
        if lost and beats:
            return True
        if claim.proven and pinned.proven:  # both are: the autopilot's own component
            same_system = claim.source[0] == pinned.source[0]
            return same_system and claim.source[1] == AUTOPILOT1 != pinned.source[1]
        waited = now - (pinned.tried or 0.0)
        turn = claim is self._claims.least_tried(now)
        return not pinned.proven and beats and waited > limits.PROOF_S and turn

    def _take(self, claim: Claim, now: float) -> Events:
        """This is the vehicle from here on."""
        before, self._pinned = self._pinned, claim
        if before is not None and claim.is_renamed(before, now):
            self._claims.drop(before)
        claim.tried = now
        self._claims.keep(claim)
        if before is not None and before.source == claim.source:
            if claim.continues(before, now) and self.state is AutopilotState.PRESENT:
                claim.beat = max(claim.beat, before.beat)
                return ()
            self.state = AutopilotState.PRESENT
            return (AutopilotReturned(),)
        self.autopilot = Autopilot(*claim.source, claim.vehicle_type, claim.firmware)
        self.state = AutopilotState.PRESENT
        return (AutopilotFound(self.autopilot),)

    def _back(self) -> Events:
        if self.state is not AutopilotState.SILENT:
            return ()
        self.state = AutopilotState.PRESENT
        return (AutopilotReturned(),)


def _no() -> bool:
    return False
