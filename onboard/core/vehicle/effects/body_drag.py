"""Drag of the body: proportional to the square of the speed through the air."""

from __future__ import annotations

import math
from collections.abc import Sequence

from onboard.core.vehicle.air import Air
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.effects.effect import Effect, Shown, Unknown

PLAUSIBLE = 0.1
"""m^2/kg: ballistic coefficients from 10 kg/m^2 up [physics]."""
FLOOR_SHARE = 0.05
"""Of the nominal value [use]."""

DOUBT = 0.0004
"""What the law is good for, m^2/kg: a per cent of a usual body [physics]."""


class BodyDrag(Effect):
    """``f_i = -(rho / 2) |u_i| u_i / b_i`` on each lateral axis; the unknowns are ``1 / b``."""

    name = "body_drag"
    manoeuvre = "fly straight legs at full speed, forwards and sideways"

    def __init__(self, frame: CopterAirframe) -> None:
        """Nominally the frame's, the same on both axes."""
        nominal = frame.body_drag
        floor = FLOOR_SHARE * max(nominal, 0.02)
        super().__init__(
            [
                Unknown(axis, nominal, PLAUSIBLE, floor, "m^2/kg", DOUBT, least=0.0)
                for axis in ("x", "y")
            ]
        )

    def act(self, air: Air, values: Sequence[float]) -> None:
        """Add the drag."""
        for axis, value in enumerate(values):
            air.force_b[:, axis] -= 0.5 * value * air.rho * air.square_b[:, axis] / air.mass

    def heavier(self, values: Sequence[float], log_ratio: float) -> list[float]:
        """Less area by mass."""
        return [v * math.exp(-log_ratio) for v in values]

    def shown(self, values: Sequence[float], sigmas: Sequence[float]) -> list[Shown]:
        """Ballistic coefficients, as EK3_DRAG_BCOEF_X and _Y; none where there is no drag."""
        out = []
        for unknown, value, sigma in zip(self.unknowns, values, sigmas, strict=True):
            nominal = 1.0 / unknown.nominal if unknown.nominal > 0.0 else float("nan")
            known = value > 2.0 * sigma and value > 0.0
            b = 1.0 / value if known else float("nan")
            its = sigma / value**2 if known else float("nan")
            out.append(Shown(f"bcoef_{unknown.name}", nominal, b, its, "kg/m^2"))
            area = Shown(
                f"area_by_mass_{unknown.name}", unknown.nominal, value, sigma, unknown.unit
            )
            out.append(area)
        return out
