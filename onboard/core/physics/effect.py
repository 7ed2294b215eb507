"""What every effect states about itself, beside its columns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.model.quadrature import Signals
from onboard.core.model.regressors import Family, Unknown

AXES = "xyz"
REFERENCE_DEGC = 35.0
"""Temperature at which a drift with it is nothing: ArduPilot's."""


@dataclass(frozen=True, slots=True)
class Origin:
    """What effects count from: times, temperatures; places and trim as the autopilot has them."""

    t0: float
    temperature: float = REFERENCE_DEGC
    antenna: tuple[float, float, float] = (0.0, 0.0, 0.0)
    trim: tuple[float, float, float] = (0.0, 0.0, 0.0)
    imu: int = 1


class EffectColumns(Family):
    """An effect of the catalogue.

    Attributes:
        effect: name in the controlled vocabulary; several column sets may stand for one effect.
        plausible: (k,) sizes beyond which the explanation is not believed.
        needs: slow signals that the columns use.
        source: where the formula is from.
        cure: what a user does about it.
        apart: the manoeuvre that tells it from what looks alike.
        tilts_ekf: whether it changes the offset in flight, which an EKF takes for tilt at first.
        of_attitude: whether it is the recorded attitude that is wrong.
    """

    effect: str = ""
    plausible: tuple[float, ...] = ()
    needs: tuple[str, ...] = ()
    source: str = ""
    cure: str = ""
    apart: str = "fly banked turns both ways, climbs, and hard accelerations"
    keys: tuple[str, ...] = ()
    tilts_ekf: bool = False
    of_attitude: bool = False

    def available(self, nodes: Signals) -> bool:
        """True if every signal it needs is in the recording."""
        return all(nodes.slow(name) is not None for name in self.needs)

    def parameters(self, values: Mapping[str, float]) -> dict[str, float]:  # noqa: ARG002
        """ArduPilot parameters that cure it, by the values of its unknowns."""
        return {}

    def advice(self, values: Mapping[str, float]) -> tuple[str, dict[str, float]]:
        """What to do about it, in words and in parameters, by the values of its unknowns."""
        return self.cure, self.parameters(values)

    def _three(self, unit: str, bound: float) -> None:
        """Unknowns x, y, z of one unit, bounded alike."""
        self.keys = tuple(AXES)
        self.plausible = (bound,) * 3
        self.unknowns = tuple(Unknown(f"{self.name}_{a}", unit, 0.0, bound) for a in AXES)


def on_axes(amount: Array) -> Array:
    """Columns ``-amount_i e_i``: what each axis reads too much, taken off.

    Args:
        amount: (..., 3).

    Returns:
        (..., 3, 3) with column i along axis i.
    """
    out: Array = -amount[..., None, :] * np.eye(3)
    return out
