"""GPS velocities that are averages."""

from __future__ import annotations

from typing import ClassVar

from onboard.core.model.linearisation import SHAPES, Linearisation
from onboard.core.physics.effect import SURE, Bearing, Cure, Effect, NuisanceFit
from onboard.core.physics.finding import Finding, Quantity
from onboard.core.physics.wording import first, measured


class GpsSmoothing(Effect):
    """The receiver reports the mean over a span of time."""

    effect = "gps_smoothing"
    code = 2
    title = "GPS averages its velocity"
    sentence = "GPS averages its velocity"
    meaning = (
        "`window`, s; past 150 ms. On a copter an antenna 24/g of its square (4 cm of 0.3 s) "
        "higher looks much the same: then it is said"
    )
    bearing = Bearing.HARMLESS
    source = "mean of v over the span, about the time of the fix"
    cure = "set the receiver's dynamic model to airborne and raise its rate"
    apart = "accelerate and brake hard and often; a lever arm needs turns instead"
    in_every_model: ClassVar[tuple[str, ...]] = ("window_squared", *SHAPES)
    least: ClassVar[float] = 0.15
    constant = "the receiver's averaging"

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:
        """The span, where it is longer than most receivers'."""
        window = nuisances.timing["gps_smoothing_window_s"]
        if window.value <= cls.least or window.value <= SURE * window.sigma:
            return None
        return {"window": Quantity(window.value, window.sigma, "s")}, Cure(cls.cure)

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:  # noqa: ARG003
        """No averaging at all, in no shape; the unknown is the square of the span."""
        shapes = {name: -share for name, share in zip(SHAPES, point.shapes, strict=True)}
        return {"window_squared": -(point.window**2), **shapes}

    @classmethod
    def size(cls, found: Finding) -> str:
        """``over 210 ± 9 ms``."""
        return f"over {measured(first(found.unknowns), 1e3, 'ms')}"
