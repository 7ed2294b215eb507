"""What a diagnosis says: frozen records behind ``onboard explain`` (effects.md's document).

The words are the controlled vocabulary of effects; numbers are SI; times are seconds since the
first inertial sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from onboard.core.estimate.result import Calibration, Estimate, Six, Status
from onboard.core.maths.arrays import Array
from onboard.core.physics.finding import NAN, Finding, Where


class Verdict(Enum):
    """The answer in one word."""

    CLEAN = "clean"
    EXPLAINED = "explained"
    PARTLY_EXPLAINED = "partly_explained"
    UNEXPLAINED = "unexplained"
    INSUFFICIENT = "insufficient"


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

    Both are of the same ``fixes``, out of ``believed``: those that were to be used, or contradict
    each other.  ``leaps`` is at how many of them the recorded attitude had leapt against the
    gyroscope.
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
    leaps: int = 0

    @property
    def supported(self) -> bool:
        """Whether most fixes that were to be used could be, and the attitude at most of them.

        Of a flight of which more than half is refused nobody can say which half is false: no
        estimate withstands more (the breakdown point; Donoho and Huber 1983).
        """
        return self.fit and not self.leaping

    @property
    def fit(self) -> bool:
        """Whether most fixes that were to be used could be."""
        return not self.believed or self.fixes >= 0.5 * self.believed

    @property
    def leaping(self) -> bool:
        """Whether the recorded attitude had leapt at most of them."""
        return self.leaps > 0.5 * self.fixes


REPEATED = "imu_stuck"
"""Why flight was not used whose accelerometer repeated one reading."""


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
class Inconstant:
    """What a flight is taken to have one of, and has not.

    ``effect`` is what it is a size of.  ``contradicts`` if the flight contradicts its model by it:
    not where the model has how it changes, nor where it is only doubtful that it is the same.
    """

    effect: str
    words: str
    contradicts: bool = True


@dataclass(frozen=True, slots=True)
class Unseen:
    """An effect that was looked for and not found, and how large it would have had to be.

    ``smallest`` are sizes by name of unknown, each alone, that this flight shows as often as not.
    """

    name: str
    smallest: dict[str, float]
    unit: str


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
    None where nothing was found that is not in every model.  ``split`` says in words why the
    recordings are no one flight; empty where they are.
    """

    imu: int
    verdict: Verdict
    calibration: Calibration
    timing: dict[str, Estimate]
    mismatch: Mismatch
    effects: tuple[Finding, ...]
    ambiguous: tuple[Ambiguity, ...]
    not_testable: tuple[NotTestable, ...]
    ladder: tuple[Rung, ...]
    regimes: tuple[RegimeResidual, ...]
    series: Series
    note: str
    plain: Plain | None = None
    unused: tuple[Unused, ...] = ()
    unseen: tuple[Unseen, ...] = ()
    inconstant: tuple[Inconstant, ...] = ()
    split: str = ""

    @property
    def silent(self) -> bool:
        """Whether the flight says nothing: neither what is missing, nor what the six are."""
        too_little = self.verdict is Verdict.INSUFFICIENT
        return too_little and self.calibration.status is not Status.CALIBRATED
