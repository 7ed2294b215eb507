"""What a calibrator reports as samples go in."""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.gps.distrust import WindowClosed, WindowOpened


@dataclass(frozen=True, slots=True)
class Restarted:
    """The autopilot's clock began anew after ``t`` (s): inertial states are gone, sums stay."""

    t: float
    reason: str


@dataclass(frozen=True, slots=True)
class Advanced:
    """Flight up to ``t`` (s, boot clock) was processed: calibrations have changed."""

    t: float


@dataclass(frozen=True, slots=True)
class FlightEnded:
    """Disarmed at ``t`` (s, boot clock): the estimates were refined over the whole flight."""

    t: float


Event = WindowOpened | WindowClosed | Restarted | Advanced | FlightEnded
