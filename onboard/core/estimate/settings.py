"""Settings of the estimator: every number that a user may want to change, with its reason."""

from __future__ import annotations

from dataclasses import dataclass, field

from onboard.core.estimate.observability import Needs
from onboard.core.gps.limits import TrustLimits
from onboard.core.inputs.assembly import AssemblySettings


@dataclass(frozen=True, slots=True)
class CalibratorSettings:
    """How the calibrator works.

    Attributes:
        buffer_s: flight that is kept for re-linearisation, s; older flight stays in the sums.
        memory_s: time constant with which older flight is forgotten once the buffer is full, s
            (an accelerometer's offset wanders with temperature and age).
        refine_at_s: trusted seconds after which timing and noise are estimated anew, as soon as the
            flight is not calibrated without that.
        refine: estimate timing and noise at all; False where a diagnosis will do it itself.
        at_once: go through flight as it comes; False where nobody asks before a diagnosis, which
            goes through it by itself.
        minimum_s: trusted seconds below which nothing is called calibrated: noise levels are not
            looked for earlier than after the first of ``refine_at_s``.
        coast_s: longest segment without an accepted fix that is bridged inertially, s.
        brisk_speed: m/s; a hover wanders slower.
        brisk_s: seconds faster than that which are enough however long the vehicle hovered.
        brisk_share: share of a shorter flight that is enough.
        assembly: how samples become batches.
        needs: what was known before and what is needed.
        trust: limits of the trust window.
    """

    buffer_s: float = 300.0
    memory_s: float = 1800.0
    refine_at_s: tuple[float, ...] = (30.0, 120.0, 480.0)
    refine: bool = True
    at_once: bool = True
    minimum_s: float = 30.0
    coast_s: float = 30.0
    brisk_speed: float = 1.5
    brisk_s: float = 30.0
    brisk_share: float = 0.1
    assembly: AssemblySettings = field(default_factory=AssemblySettings)
    needs: Needs = field(default_factory=Needs)
    trust: TrustLimits = field(default_factory=TrustLimits)
