"""What the learner has to know of the rest of the service before it takes the next batch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from onboard.daemon.learning.identity import Identity
from onboard.daemon.pushing.parameters import ParameterWatch
from onboard.daemon.pushing.proposals import Proposals
from onboard.daemon.pushing.witness import Witness
from onboard.mavlink.autopilot import AutopilotState
from onboard.mavlink.board import Board
from onboard.mavlink.link import Link
from onboard.push.policy import Mode


@dataclass(frozen=True, slots=True)
class Situation:
    """Looks at the parts that know; what :class:`onboard.daemon.learning.handover.There` asks."""

    link: Link
    board: Board
    watch: ParameterWatch
    witness: Witness
    proposals: Proposals

    @property
    def identity(self) -> Identity | None:
        """Who is there now, None while nobody is heard."""
        autopilot = self.link.autopilot
        if autopilot is None or self.link.state is not AutopilotState.PRESENT:
            return None
        return Identity(autopilot.system, autopilot.firmware_name, self.board.uid)

    @property
    def introduced(self) -> bool:
        """Whether it has said which board it is and what its messages mean."""
        told = self.watch.complete or not self.watch.enabled
        return told and self.board.answered

    @property
    def parameters(self) -> Mapping[str, float]:
        """All that it has told of them, by name."""
        return self.watch.values

    @property
    def judging(self) -> frozenset[str]:
        """Pushes that wait for the flight that judges them, by transaction."""
        return self.witness.waiting

    @property
    def in_flight(self) -> bool:
        """Whether values may be written in flight."""
        return self.proposals.settings.mode is Mode.IN_FLIGHT
