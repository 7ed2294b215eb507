"""Attitude and accelerometer stamped at different times."""

from __future__ import annotations

from typing import ClassVar

from onboard.core.model.linearisation import Linearisation
from onboard.core.physics.effect import SURE, Bearing, Cure, Effect, NuisanceFit
from onboard.core.physics.finding import Finding, Quantity
from onboard.core.physics.wording import first, measured


class ImuDelay(Effect):
    """The recorded attitude is that of another moment than the inertial samples."""

    effect = "imu_delay"
    code = 4
    title = "Attitude and accelerometer are not simultaneous"
    sentence = "attitude and accelerometer are not simultaneous"
    meaning = "`delay`, s, of the attitude; past 30 ms"
    bearing = Bearing.HARMLESS
    source = "R(t - d) R(t)^T = exp(-R w d)"
    cure = "look at the stream set-up and at INS_ACCEL_FILTER"
    apart = "roll and pitch quickly while accelerating"
    of_attitude = True
    in_every_model: ClassVar[tuple[str, ...]] = ("attitude_delay",)
    least: ClassVar[float] = 0.03
    constant = "the delay of the attitude"

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:
        """The delay, late attitude positive."""
        lag = nuisances.timing["imu_delay_s"]
        if abs(lag.value) <= cls.least or abs(lag.value) <= SURE * lag.sigma:
            return None
        return {"delay": Quantity(lag.value, lag.sigma, "s")}, Cure(cls.cure)

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:  # noqa: ARG003
        """Simultaneous."""
        return {"attitude_delay": -point.attitude_delay}

    @classmethod
    def size(cls, found: Finding) -> str:
        """``attitude late by 41 ± 3 ms``."""
        q = first(found.unknowns)
        late = Quantity(abs(q.value), q.sigma, q.unit)
        return f"attitude {'late' if q.value > 0.0 else 'early'} by {measured(late, 1e3, 'ms')}"
