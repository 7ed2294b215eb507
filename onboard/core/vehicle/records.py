"""What a match says: frozen records behind ``onboard match`` and everything a report draws.

Numbers are SI, times are seconds on the recording's clock unless they are said to be since its
start; names are the controlled vocabulary of effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from onboard.core.diagnosis.records import Ambiguity, NotTestable, Verdict
from onboard.core.maths.arrays import Array
from onboard.core.physics.finding import NAN, Where

EMPTY = np.zeros(0)
__all__ = ["Ambiguity", "NotTestable", "Verdict"]


@dataclass(frozen=True, slots=True)
class Compared:
    """One number: as the simulation has it, as the recording has it, and how sure that is.

    ``sigma`` is that of the recording's, or of the difference where both are measured; differences
    below ``floor`` do not matter.
    """

    simulation: float
    real: float
    sigma: float
    unit: str
    floor: float = 0.0


@dataclass(frozen=True, slots=True)
class Difference:
    """One effect that was found.

    ``held_out_*`` is the RMS of the force that the model leaves on flight that was not used,
    without and with the effect, m/s^2 (whitened RMS for effects of the sensor level).
    """

    name: str
    level: str
    values: Mapping[str, Compared]
    share: float = NAN
    where: tuple[Where, ...] = ()
    rivals: tuple[str, ...] = ()
    held_out_before: float = NAN
    held_out_after: float = NAN


@dataclass(frozen=True, slots=True)
class WindEstimate:
    """Wind of the real flight at its mean height, towards north and east, m/s.

    ``series_*`` are estimates of blocks of flight: times (b,) s since the start, heights above
    ground (b,) m, components (b, 2) and their sigmas (b, 2); ``ekf`` (b, 2) is the autopilot's own
    (NaN where it has none), ``law`` (b, 2) what one wind and its profile are there.  ``change`` is
    the RMS of a wind that became another about its mean, m/s; zero where it did not.
    """

    north: float
    east: float
    sigma_north: float
    sigma_east: float
    height: float
    profile_exponent: float | None = None
    turbulence_rms: float | None = None
    series_t: Array = field(default_factory=lambda: EMPTY)
    series_height: Array = field(default_factory=lambda: EMPTY)
    series: Array = field(default_factory=lambda: np.zeros((0, 2)))
    series_sigma: Array = field(default_factory=lambda: np.zeros((0, 2)))
    ekf: Array = field(default_factory=lambda: np.zeros((0, 2)))
    law: Array = field(default_factory=lambda: np.zeros((0, 2)))
    change: float = 0.0

    @property
    def speed(self) -> float:
        """m/s."""
        return math.hypot(self.north, self.east)

    @property
    def sigma_along(self) -> float:
        """Of the speed, m/s; of a calm that of either component at its largest."""
        return sigma_along(self.north, self.east, self.sigma_north, self.sigma_east)

    @property
    def sigma_across(self) -> float:
        """Of what turns it, m/s."""
        return sigma_along(-self.east, self.north, self.sigma_north, self.sigma_east)


def sigma_along(north: float, east: float, sigma_north: float, sigma_east: float) -> float:
    """Along (north, east), of two components that err each by itself; of nothing the larger."""
    length = math.hypot(north, east)
    if length == 0.0:
        return max(sigma_north, sigma_east)
    return math.hypot(north * sigma_north, east * sigma_east) / length


@dataclass(frozen=True, slots=True)
class Curve:
    """A law with the data that it was found from.

    ``x`` (k,) in ``x_unit``; ``data`` (k,) and its scatter ``spread`` (k,), ``fitted`` (k,) and
    ``nominal`` (k,) in ``y_unit``; ``points`` (p, 2) are single steps of the flight, x and data.
    """

    name: str
    x_label: str
    x_unit: str
    y_label: str
    y_unit: str
    x: Array
    data: Array
    spread: Array
    fitted: Array
    nominal: Array
    points: Array = field(default_factory=lambda: np.zeros((0, 2)))


@dataclass(frozen=True, slots=True)
class ForceSeries:
    """Force along body axes at ``t`` (n,) s since the start: (n, k) each, m/s^2.

    ``after`` is predicted by unknowns of the other parts of the flight; ``speed`` (n,) is that over
    ground, m/s, or empty.
    """

    t: Array
    axes: tuple[str, ...]
    measured: Array
    before: Array
    after: Array
    speed: Array = field(default_factory=lambda: EMPTY)


@dataclass(frozen=True, slots=True)
class Alone:
    """RMS of the velocity error at ``t`` (k,) s after the model was left alone, m/s: (k,) each."""

    t: Array
    before: Array
    after: Array


@dataclass(frozen=True, slots=True)
class AxisMismatch:
    """RMS on flight not used in the fit, m/s^2: of the nominal model, and of what was found."""

    before: float
    after: float


@dataclass(frozen=True, slots=True)
class Aside:
    """A further flight whose vehicle is another than that of the flights that count.

    Attributes:
        number: of the flight, 0 being the first.
        against: number of the flight that it contradicts.
        name: effect that differs most.
        shown: the number of it that is told.
        its: what this flight alone says of it.
        theirs: what the other one says.
        mass: over that of the other, if another mass is all that differs; else None.
    """

    number: int
    against: int
    name: str
    shown: str
    its: Compared
    theirs: Compared
    mass: Compared | None = None


@dataclass(frozen=True, slots=True)
class VehicleMatch:
    """The vehicle level of one recording against an airframe.

    Attributes:
        vehicle: ``copter`` or ``plane``.
        effects: found, the strongest first.
        wind: of the flight; None where nothing could be said.
        other_winds: of the other flights of the vehicle that were matched with it.
        aside: those of them that contradict it or each other, and were not used.
        mismatch: by axis.
        alone_before: RMS of the velocity that the nominal model gains or loses in ten seconds
            alone, m/s.
        alone_after: the same of the model that was found.
        alone: how the two grow over these ten seconds; None where no stretch is that long.
        ambiguous: what cannot be told apart.
        not_testable: what this flight could not have shown.
        numbers: every unknown of the model, ``effect.unknown`` to value, sigma and nominal.
        frame: keys for the simulator's frame or coefficient file.
        curves: drag, thrust and sag with their data.
        series: forces over time.
        seconds: of flight that was used.
        explained: whether what is left is within what the sensors explain.
        unexplained: share of the flight in spans that no effect describes.
        note: a sentence for the reader; may be empty.
        shown: whether this flight would have shown any effect.
    """

    vehicle: str
    effects: tuple[Difference, ...] = ()
    wind: WindEstimate | None = None
    other_winds: tuple[WindEstimate, ...] = ()
    aside: tuple[Aside, ...] = ()
    mismatch: Mapping[str, AxisMismatch] = field(default_factory=dict)
    alone_before: float = NAN
    alone_after: float = NAN
    alone: Alone | None = None
    ambiguous: tuple[Ambiguity, ...] = ()
    not_testable: tuple[NotTestable, ...] = ()
    numbers: Mapping[str, Compared] = field(default_factory=dict)
    frame: Mapping[str, float | list[float]] = field(default_factory=dict)
    curves: tuple[Curve, ...] = ()
    series: ForceSeries | None = None
    seconds: float = 0.0
    explained: bool = True
    unexplained: float = 0.0
    note: str = ""
    shown: bool = True
