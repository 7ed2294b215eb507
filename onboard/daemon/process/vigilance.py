"""Vigilance: what on the wire is not as it should be, told once and shown while it lasts."""

from __future__ import annotations

from collections.abc import Iterator

from onboard.daemon.learning.handover import Handover
from onboard.daemon.process import limits
from onboard.daemon.process.company import Company
from onboard.daemon.process.condition import Observed
from onboard.daemon.process.hindrance import Hindrance
from onboard.daemon.pushing.ledger import Ledger
from onboard.daemon.view.notices import Notices
from onboard.mavlink.autopilot import AutopilotState
from onboard.mavlink.link import Link
from onboard.mavlink.signing import Signing

UNSIGNED = (
    "anybody on that network can speak as the vehicle; sign the link ([link] signing_key_file)"
)


STOPPED = "learner_stopped"
SAID = frozenset({STOPPED, "not_saved", "no_journal"})
"""What is told elsewhere when it begins, with its cause."""


class Vigilance:
    """Looks at the link and at what it brings; ``now`` is a monotonic clock, s.

    Args:
        link: what is heard, and of whom.
        company: whether two autopilots answer to its name.
        observed: the vehicle's condition.
        signing: the key's bookkeeping, None without a key.
        handover: of the samples to the learner, and whether it and the disk take them.
        hindrance: what keeps us from learning or writing.
        ledger: what is written down.
        notices: where it is told.
    """

    def __init__(
        self,
        link: Link,
        company: Company,
        observed: Observed,
        signing: Signing | None,
        handover: Handover,
        hindrance: Hindrance,
        ledger: Ledger,
        notices: Notices,
    ) -> None:
        self._link = link
        self._company = company
        self._observed = observed
        self._signing = signing
        self._handover = handover
        self._hindrance = hindrance
        self._ledger = ledger
        self._notices = notices
        self._told: set[str] = set()

    def tell(self, now: float) -> None:
        """Say what has begun since the last time."""
        self._hindrance.look(now)
        found = dict(self._found(now))
        for kind, text in found.items():
            if kind not in self._told and kind not in SAID:
                self._notices.post(kind, text, warning=True)
        self._told = set(found)

    def warnings(self, now: float) -> tuple[str, ...]:
        """What is so now, one sentence each."""
        return tuple(text for _, text in self._found(now))

    @property
    def stopped(self) -> str:
        """Why nothing is learned before the next flight, in a sentence; else empty."""
        return self._handover.failures.stopped

    @property
    def disk(self) -> str:
        """Why nothing can be written to the vehicle whatever is learned, in a sentence."""
        trouble = self._ledger.trouble
        return f"nothing is written to the vehicle: {trouble}" if trouble else ""

    def hindered(self, now: float) -> str:
        """What keeps anything from being learned or written now, in a sentence; else empty."""
        return next((text for _, text in self._hindered(now)), "")

    def _hindered(self, now: float) -> Iterator[tuple[str, str]]:
        if text := self._hindrance.unsigned(now):
            yield "unsigned_vehicle", text
        if text := self._hindrance.mute(now):
            yield "unanswered", text
        elif text := self._hindrance.untold(now):
            yield "untold", text
        elif text := self._hindrance.seldom(now):
            yield "seldom", text

    def _found(self, now: float) -> Iterator[tuple[str, str]]:
        if self._signing is None and (open_ones := self._open_to_a_network()):
            yield "unsigned_network", f"{open_ones}: {UNSIGNED}"
        if self.stopped:
            yield STOPPED, self.stopped
        if self.disk:
            yield "no_journal", self.disk
        if self._handover.unsaved:
            yield "not_saved", self._handover.unsaved
        yield from self._hindered(now)
        rivals = self._link.presence.rivals(now)
        if rivals:
            yield "rivals", f"{rivals} more on the link speak as the vehicle; they are not believed"
        yield from self._others(now)
        if self._observed.contradicted(now):
            yield (
                "heartbeats_contradict",
                "heartbeats say armed and disarmed at the same time: nothing is written",
            )
        if self._company.are_two(now) and self._link.autopilot is not None:
            yield (
                "two_vehicles",
                (
                    f"two autopilots answer as system {self._link.autopilot.system}: give each an "
                    "id of its own (MAV_SYSID, SYSID_THISMAV), then reset what was learned"
                ),
            )
        if self._link.twins.there(now):
            yield (
                "twin",
                "another onboard service serves this vehicle; the one that came later yields",
            )
        if self._handover.repetitions.doubtful(now):
            yield (
                "samples_contradict",
                "samples with one time stamp say different things: both are dropped",
            )
        yield from self._clocks()

    def _others(self, now: float) -> Iterator[tuple[str, str]]:
        others, autopilot = self._link.presence.others(now), self._link.autopilot
        if autopilot is None:
            return
        silent = self._link.state is AutopilotState.SILENT
        if silent and self._link.presence.namesake(now):
            yield (
                "another_speaks",
                (
                    f"the vehicle is silent, and another one, by its clock, speaks as system "
                    f"{autopilot.system}, too: a restart of the service takes that one up; "
                    "give each an id of its own"
                ),
            )
        if not others:
            return
        whose = ", ".join(map(str, others))
        if silent:
            yield (
                "another_speaks",
                (
                    f"system {autopilot.system} is silent, but system {whose} speaks: another "
                    "vehicle, or this one with another id; a restart of the service takes it up"
                ),
            )
        elif not self._link.presence.chosen:
            yield (
                "another_vehicle",
                (
                    f"system {whose} is an autopilot on this link, too: the service is for system "
                    f"{autopilot.system}; [link] system_id chooses"
                ),
            )

    def _clocks(self) -> Iterator[tuple[str, str]]:
        signing = self._signing
        if signing is None:
            return
        if signing.behind_s:
            lag = f"signed packets lie {signing.behind_s:.0f} s behind"
            yield "signing_behind", f"{lag}: a repetition, or clocks that differ; not believed"
        if signing.ahead_s > limits.CLOCK_APART_S:
            lag = f"this computer's clock lies {signing.ahead_s:.0f} s behind"
            yield "signing_ahead", f"{lag} the signing's: theirs is used"

    def _open_to_a_network(self) -> str:
        endpoints = (connection.endpoint for connection in self._link.connections)
        return ", ".join(str(endpoint) for endpoint in endpoints if endpoint.is_open_to_a_network)
