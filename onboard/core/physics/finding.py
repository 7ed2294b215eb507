"""One effect that was found in a recording, with its evidence: what every reader of it is given.

Numbers are SI; times are seconds since the first inertial sample.
"""

from __future__ import annotations

from dataclasses import dataclass

from onboard.core.maths.arrays import Array

NAN = float("nan")
"""What was not measured."""


@dataclass(frozen=True, slots=True)
class Where:
    """A place where the mismatch lives: interval, axis, flight regime, share of the whole."""

    start_s: float
    end_s: float
    axis: str
    regime: str
    share: float


@dataclass(frozen=True, slots=True)
class Quantity:
    """One unknown of an effect: value, sigma, unit."""

    value: float
    sigma: float
    unit: str


@dataclass(frozen=True, slots=True)
class Confounder:
    """Another effect that could stand for this one, and how much worse it does."""

    name: str
    delta_bic: float


@dataclass(frozen=True, slots=True)
class Imprint:
    """What an effect makes of the velocity, and what data say of it; m/s, (n,), NaN where unused.

    ``left`` is what the model leaves with this effect alone taken out, along the earth ``axis``;
    ``made`` is what the effect says should be left.  ``t`` is a segment where it does most.
    """

    axis: str
    t: Array
    left: Array
    made: Array


@dataclass(frozen=True, slots=True)
class ResponseCurve:
    """How a quantity goes with a signal, over the range that was flown: ``x`` (n,).

    ``y`` and ``sigma`` have a curve (n,) for each unknown, by its name.
    """

    signal: str
    unit: str
    quantity: str
    quantity_unit: str
    x: Array
    y: dict[str, Array]
    sigma: dict[str, Array]


@dataclass(frozen=True, slots=True)
class Finding:
    """One accepted effect with its evidence.

    ``parameters`` are the autopilot parameters to set and their values; ``cure`` says in words what
    to do where no parameter helps.  ``held_out_velocity_*`` are the held-out residual in m/s.
    """

    name: str
    unknowns: dict[str, Quantity]
    share_of_mismatch: float
    delta_bic: float
    held_out_before: float
    held_out_after: float
    parameters: dict[str, float]
    cure: str
    where: tuple[Where, ...] = ()
    confounders: tuple[Confounder, ...] = ()
    intervals: tuple[tuple[float, float], ...] = ()
    formula: str = ""
    held_out_velocity_before: float = NAN
    held_out_velocity_after: float = NAN
    imprint: Imprint | None = None
    response_curve: ResponseCurve | None = None
