"""What a diagnosis says: frozen records behind ``onboard explain`` (effects.md's document).

The words are the controlled vocabulary of effects; numbers are SI; times are seconds since the
first inertial sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from onboard.core.result import Calibration, Estimate, Six

Array = NDArray[np.float64]

NAN = float("nan")
"""What was not measured."""


class Verdict(Enum):
    """The answer in one word."""

    CLEAN = "clean"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    INSUFFICIENT = "insufficient"


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
class Rival:
    """Another effect that could stand for this one, and how much worse it does."""

    name: str
    delta_bic: float


@dataclass(frozen=True, slots=True)
class Imprint:
    """What an effect makes of the velocity, and what data say of it; m/s, (n,), NaN where unused.

    ``left`` is what the model leaves with this effect alone taken out, along the earth ``axis``;
    ``made`` is what the effect says should be left.  ``t`` is a stretch where it does most.
    """

    axis: str
    t: Array
    left: Array
    made: Array


@dataclass(frozen=True, slots=True)
class Law:
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
class Effect:
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
    rivals: tuple[Rival, ...] = ()
    intervals: tuple[tuple[float, float], ...] = ()
    formula: str = ""
    held_out_velocity_before: float = NAN
    held_out_velocity_after: float = NAN
    imprint: Imprint | None = None
    law: Law | None = None


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """Effects that this flight cannot tell apart, and the manoeuvre that would."""

    names: tuple[str, ...]
    tell_apart: str


@dataclass(frozen=True, slots=True)
class NotTestable:
    """An effect that this recording cannot speak about, and why."""

    name: str
    why: str


@dataclass(frozen=True, slots=True)
class Rung:
    """One step of the ladder of models: what was added, and its residuals.

    ``whitened_rms`` and ``held_out`` are in units of the noise, the velocities in m/s.
    """

    name: str
    whitened_rms: float
    held_out: float
    velocity_rms: float = NAN
    held_out_velocity: float = NAN


@dataclass(frozen=True, slots=True)
class Mismatch:
    """The residual of the six numbers and timing thresholds alone, and after all effects.

    Both are of the same ``fixes``, out of ``believed``: those that were to be used.
    """

    detected: bool
    whitened_rms_before: float
    whitened_rms_after: float
    p_value: float
    velocity_rms_before: float
    velocity_rms_after: float
    held_out_before: float
    held_out_after: float
    where: tuple[Where, ...] = ()
    held_out_velocity_before: float = NAN
    held_out_velocity_after: float = NAN
    fixes: int = 0
    believed: int = 0

    @property
    def supported(self) -> bool:
        """Whether most fixes that were to be used could be.

        Of a flight of which more than half is refused nobody can say which half is false: no
        estimate withstands more (the breakdown point; Donoho and Huber 1983).
        """
        return not self.believed or self.fixes >= 0.5 * self.believed


@dataclass(frozen=True, slots=True)
class Unused:
    """Flight whose fixes were not used: why, and whether inertia contradicts them.

    ``reason`` is the trust window's; ``contradicted`` is None where there was nothing to compare.
    """

    start_s: float
    end_s: float
    reason: str
    contradicted: bool | None = None


@dataclass(frozen=True, slots=True)
class Series:
    """Time series for plots, epochs in order: velocity residual NED (m/s) before and after.

    ``t`` (n,) s since the first inertial sample; ``before`` and ``after`` (n, 3), NaN where a
    component was not measured; ``refused`` (n,) True where the fix was not used.
    """

    t: Array
    before: Array
    after: Array
    refused: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class RegimeResidual:
    """Residual in one flight regime, before and after: whitened, and of the velocity in m/s."""

    regime: str
    seconds: float
    rms_before: float
    rms_after: float
    velocity_before: float = NAN
    velocity_after: float = NAN


@dataclass(frozen=True, slots=True)
class Plain:
    """What the same sums say of the six without the effects that were found.

    ``value`` and ``sigma`` are scale and offset in the order of SIX_NAMES.  Timing and constant
    attitude errors are in it: they are in every model.
    """

    value: Six
    sigma: Six


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """Everything about one accelerometer's recording.

    ``calibration`` is that of the model with what was found in it; ``plain`` is the one without,
    None where nothing was found that is not in every model.
    """

    imu: int
    verdict: Verdict
    calibration: Calibration
    timing: dict[str, Estimate]
    mismatch: Mismatch
    effects: tuple[Effect, ...]
    ambiguous: tuple[Ambiguity, ...]
    not_testable: tuple[NotTestable, ...]
    ladder: tuple[Rung, ...]
    regimes: tuple[RegimeResidual, ...]
    series: Series
    note: str
    plain: Plain | None = None
    unused: tuple[Unused, ...] = ()
