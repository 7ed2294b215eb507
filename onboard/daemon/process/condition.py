"""The vehicle's condition as the push policy needs it, from the samples that tell of it."""

from __future__ import annotations

import math

from onboard.core.inputs.airborne import Ground
from onboard.core.inputs.samples import EkfHealth, Sample, VehicleState
from onboard.daemon.process import limits
from onboard.push.policy import VehicleCondition


class Observed:
    """How old the autopilot's last word on each flag is; ``now`` is a monotonic clock, s."""

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """The autopilot rebooted or is another one: nothing is known."""
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

    def condition(self, now: float) -> VehicleCondition:
        """What is known now; what is stale counts as unknown."""
        armed = self._ground.armed if now - self._armed_at <= limits.STALE_S else None
        since = self._disarmed_since
        return VehicleCondition(
            armed=armed,
            disarmed_for=now - since if armed is False and since is not None else 0.0,
            landed=self._ground.landed if now - self._landed_at <= limits.STALE_S else None,
            ekf_flags=self._ekf if now - self._ekf_at <= limits.STALE_S else None,
        )
