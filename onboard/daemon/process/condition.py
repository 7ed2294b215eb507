"""The vehicle's condition as the push policy needs it, from the samples that tell of it."""

from __future__ import annotations

import math

from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.samples import EkfHealth, Sample, VehicleState
from onboard.daemon.process import limits
from onboard.push.policy import VehicleCondition


class Flips:
    """Whether armed and disarmed are said so fast after each other that two must be speaking.

    The vehicle says it once a second.  Whatever somebody else puts between two of its HEARTBEATs
    therefore lasts for less than their interval.
    """

    def __init__(self) -> None:
        self._armed: bool | None = None
        self._since = -math.inf
        self._contradicted_at = -math.inf

    def take(self, now: float, *, armed: bool) -> None:
        """The next HEARTBEAT."""
        if self._armed is not None and armed != self._armed:
            if now - self._since < limits.CONTRADICTION_S:
                self._contradicted_at = now
            self._since = now
        self._armed = armed

    def contradict(self, now: float) -> bool:
        """Whether that was so of late."""
        return now - self._contradicted_at <= limits.CONTRADICTED_FOR_S


class Observed:
    """How old the autopilot's last word on each flag is; ``now`` is a monotonic clock, s."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The autopilot rebooted or is another one: nothing is known."""
        self._flips = Flips()
        self._rival_armed_at = -math.inf
        self._ground = Ground()
        self._armed_at = -math.inf
        self._disarmed_since: float | None = None
        self._landed_at = -math.inf
        self._ekf: int | None = None
        self._ekf_at = -math.inf

    def feed(self, sample: Sample, now: float) -> None:
        """Take a sample of any kind."""
        match sample:
            case VehicleState(armed=armed, landed=landed):
                self._ground.feed(sample)
                if armed is not None:
                    if armed:
                        self._disarmed_since = None
                    elif self._disarmed_since is None or now - self._armed_at > limits.STALE_S:
                        self._disarmed_since = now
                    self._armed_at = now
                if landed is not None:
                    self._landed_at = now
            case EkfHealth(_, flags):
                self._ekf, self._ekf_at = flags, now
            case _:
                pass

    def heartbeat(self, now: float, *, armed: bool) -> bool:
        """Take the vehicle's HEARTBEAT; whether it begins to contradict those before it."""
        before = self._flips.contradict(now)
        self._flips.take(now, armed=armed)
        return self._flips.contradict(now) and not before

    def rival(self, now: float, *, armed: bool) -> None:
        """Take one in the vehicle's name that came another way: armed is believed of anybody."""
        if armed:
            self._rival_armed_at = now

    def contradicted(self, now: float) -> bool:
        """Whether HEARTBEATs say armed and disarmed at the same time."""
        return self._flips.contradict(now)

    def condition(self, now: float) -> VehicleCondition:
        """What is known now; what is stale counts as unknown."""
        armed = self._ground.armed if now - self._armed_at <= limits.STALE_S else None
        if now - self._rival_armed_at <= limits.STALE_S:
            armed = True
        since = self._disarmed_since
        return VehicleCondition(
            armed=armed,
            disarmed_for=now - since if armed is False and since is not None else 0.0,
            landed=self._ground.landed if now - self._landed_at <= limits.STALE_S else None,
            ekf_flags=self._ekf if now - self._ekf_at <= limits.STALE_S else None,
            contradicted=self._flips.contradict(now),
        )
