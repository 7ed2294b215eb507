"""A heading that is wrong by the same angle all the time."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from onboard.core.model.linearisation import Linearisation
from onboard.core.physics import danger
from onboard.core.physics.effect import SURE, Bearing, Cure, Effect, NuisanceFit
from onboard.core.physics.finding import Finding, Quantity
from onboard.core.physics.wording import DEGREE, first, measured

LEAST_RAD = float(np.deg2rad(2.5))
"""A compass that is calibrated well is off by less."""
EKF_SIGMA_RAD = 0.005
"""What an EKF's mean heading is off by without anything being wrong [tuned: ten flights of
ArduPlane's SITL; to be derived]."""


class HeadingError(Effect):
    """Recorded yaw is too large by a constant."""

    effect = "heading_error"
    code = 7
    title = "The heading is off"
    sentence = "the heading is off"
    meaning = "`yaw`, rad"
    bearing = Bearing.HARMLESS
    source = "small rotation about down, fixed to north"
    cure = "calibrate the compass; check COMPASS_DEC and COMPASS_ORIENT"
    apart = "accelerate hard on several headings"
    of_attitude = True
    in_every_model: ClassVar[tuple[str, ...]] = ("heading",)
    lasts = True

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:
        """By how much the recorded yaw is too large."""
        at = nuisances.index["heading"]
        heading = nuisances.point.heading + float(nuisances.theta[at])
        sigma = float(np.hypot(nuisances.sigma[at], EKF_SIGMA_RAD))
        if abs(heading) <= LEAST_RAD or abs(heading) <= SURE * sigma:
            return None
        return {"yaw": Quantity(heading, sigma, "rad")}, Cure(cls.cure)

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:  # noqa: ARG003
        """True north."""
        return {"heading": -point.heading}

    @classmethod
    def danger(cls, found: Finding) -> str:
        """By the constant error alone."""
        return danger.of_heading(first(found.unknowns).value)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by 4.1 ± 0.3°``."""
        return f"by {measured(first(found.unknowns), 1.0 / DEGREE, '°')}"
