"""Contact with the autopilot: who it is, when it is silent or reboots, and what follows."""

from __future__ import annotations

import logging
from collections import Counter
from dataclasses import dataclass, field

from onboard.daemon.process import limits
from onboard.daemon.process.parts import Parts
from onboard.mavlink.autopilot import (
    Autopilot,
    AutopilotFound,
    AutopilotRebooted,
    AutopilotReturned,
    AutopilotSilent,
    ConnectionChanged,
    ConnectionRestored,
    ConnectionTrouble,
    LinkEvent,
    RivalHeard,
)
from onboard.mavlink.decode import Decoder
from onboard.outage import Outage

logger = logging.getLogger(__name__)


@dataclass(slots=True)
class Life:
    """How far the service is in its life, and what it may do, for the snapshot.

    ``phase`` is starting, searching, running, stopping or stopped; ``mode`` active or advise_only.
    """

    phase: str = "starting"
    mode: str = "active"
    mode_reason: str = ""
    counters: Counter[str] = field(default_factory=Counter)


class Contact:
    """Tells parts and people what happens to the autopilot and the connections; ``now`` in s."""

    def __init__(self, parts: Parts, life: Life) -> None:
        self._parts = parts
        self._life = life
        self._silence, self._reboots = Outage(), Outage()
        self._yields = self._two = False
        self._disk = ""
        self._next_kept = 0.0

    def on_link_event(self, now: float, event: LinkEvent) -> None:
        """Take note of what happened to the autopilot or a connection."""
        post, counters = self._parts.notices.post, self._life.counters
        match event:
            case AutopilotFound(autopilot):
                self._found(autopilot)
            case AutopilotSilent(silence):
                counters["autopilot_silent"] += 1
                self._nothing_is_known()
                if self._silence.lost("no heartbeat", now - silence):
                    post("autopilot_silent", f"no heartbeat for {silence:.0f} s", warning=True)
            case AutopilotReturned():
                self._nothing_is_known()
                self._silence.works(now)
            case RivalHeard(armed):
                self._parts.observed.rival(now, armed=armed)
            case AutopilotRebooted(unseen=unseen):
                counters["autopilot_rebooted"] += 1
                self._nothing_is_known(rebooted=unseen)
                if self._reboots.lost("rebooted", now):
                    if unseen:
                        text = "the autopilot rebooted while it was silent"
                        post("autopilot_rebooted", text, warning=True)
                    else:
                        post("autopilot_rebooted", "the autopilot rebooted", warning=True)
                self._reboots.works(now)
            case ConnectionTrouble(endpoint, reason):
                text = f"{endpoint}: {reason}; tried again until it answers"
                post("connection_lost", text, warning=True)
            case ConnectionRestored(endpoint, over):
                post("connection_back", f"{endpoint}: back after {over}")
            case ConnectionChanged(endpoint, state, reason):
                logger.debug("%s: %s%s", endpoint, state.value, f" ({reason})" if reason else "")
        self._parts.pusher.on_event(now, event)

    def heartbeat(self, now: float, said: float, *, armed: bool) -> None:
        """Take the vehicle's HEARTBEAT: one that contradicts those before it stops a push.

        Args:
            now: s.
            said: when it was sent, as far as that is known, s.
            armed: what it says.
        """
        if self._parts.observed.heartbeat(said, armed=armed):
            self._life.counters["heartbeats_contradict"] += 1
            self._parts.pusher.stop("heartbeats say armed and disarmed at the same time", now)

    def look_around(self, now: float) -> None:
        """Tell what on the wire is not as it should be, and draw the consequences."""
        parts = self._parts
        parts.vigilance.tell(now)
        if parts.handover.repetitions.contradictions:
            parts.proposals.doubt = "samples contradict each other: find out who sends, then reset"
        parts.board.confirm(now)
        yields, two = not parts.link.twins.first(now), parts.company.are_two(now)
        if two and not self._two:
            parts.pusher.stop("two autopilots answer as one system", now)
        if two:
            doubt = "two autopilots have spoken as one system: reset, then fly again"
            parts.proposals.doubt = doubt
        parts.ledger.tend(now, doubted=bool(parts.handover.unsaved))
        disk = parts.ledger.trouble
        if self._disk and not disk:
            parts.notices.post("journal_back", "the disk takes the journal again")
        if (yields, two, disk) != (self._yields, self._two, self._disk):
            self._yields, self._two, self._disk = yields, two, disk
            self._decide()
        if now >= self._next_kept:
            self._next_kept = now + limits.SIGNING_KEPT_S
            parts.keep_signing(limits.SIGNING_KEPT_S)

    def _decide(self) -> None:
        """Whether anything is written to whoever is there."""
        autopilot = self._parts.link.autopilot
        foreign = autopilot is not None and not autopilot.is_ardupilot
        if autopilot is not None and foreign:
            self._advise_only(
                f"the autopilot is {autopilot.firmware_name}, not ArduPilot: "
                "nothing is written to it"
            )
        elif autopilot is not None and self._two:
            self._advise_only(
                f"two autopilots answer as system {autopilot.system}: give each an id of its own"
            )
        elif self._yields:
            self._advise_only("another onboard service was there first")
        elif self._disk:
            self._advise_only(f"nothing is written without a journal: {self._disk}")
            self._parts.proposals.forbidden = ""  # what is open on the disk is still undone
        else:
            self._life.mode, self._life.mode_reason = "active", ""
            self._parts.proposals.forbidden = ""
        self._parts.parameters.enabled = not foreign

    def tell_of_recovery(self, now: float) -> None:
        """Say that heartbeats are back, and how often it rebooted, once it has settled."""
        post = self._parts.notices.post
        over = self._silence.over(now)
        if over is not None:
            post("autopilot_returned", f"heartbeats are back after {over}")
        times = self._reboots.times
        if self._reboots.over(now) is not None and times > 1:
            post(
                "autopilot_runs",
                f"the autopilot rebooted {times} times in a row; now it keeps running",
            )

    def _found(self, autopilot: Autopilot) -> None:
        parts = self._parts
        if self._life.phase == "running":  # another one before
            self._nothing_is_known()
        who = f"{autopilot.firmware_name} {autopilot.vehicle}, system {autopilot.system}"
        parts.notices.post("autopilot_found", who)
        parts.handover.decoder = Decoder(
            autopilot.system, autopilot.component, clock=parts.link.boot_clock
        )
        self._life.phase = "running"
        self._decide()

    def _advise_only(self, reason: str) -> None:
        self._parts.notices.post("advise_only", f"advise-only: {reason}", warning=True)
        self._life.mode, self._life.mode_reason = "advise_only", reason
        self._parts.proposals.forbidden = reason

    def _nothing_is_known(self, *, rebooted: bool = False) -> None:
        """Another autopilot, or another state of it, may be there when it is heard again."""
        self._parts.observed.forget()
        self._parts.handover.gap(rebooted=rebooted)
