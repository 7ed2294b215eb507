"""What every effect states about itself, and the ways in which one can be looked for.

An effect is a class in a file of its own in :mod:`onboard.core.physics.effects`; the catalogue
finds it there.  Everything that is said or decided about it anywhere (terminal, page, messages,
policy, manuals) is read from its statements, none of which has a default: a class that leaves one
out cannot be imported.

It is looked for in one of three ways, or in two at once:

with regressors of its own
    ``unknowns`` and how they enter what is measured (:class:`Family`); selected by evidence;
as unknowns that are in every model
    :attr:`Effect.in_every_model`; estimated anyway, and an effect from a size on;
in the data themselves
    :attr:`Effect.excluded`; what it has spoiled is left out of the fit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import ClassVar, Self

import numpy as np

from onboard.core.estimate.gps_clock import FixClock
from onboard.core.estimate.limits import BEYOND
from onboard.core.estimate.result import Estimate
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.segments import Batch
from onboard.core.maths.arrays import Array
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Family, Unknown
from onboard.core.physics import danger
from onboard.core.physics.finding import Finding, Quantity, ResponseCurve
from onboard.core.physics.response_curves import Response
from onboard.core.physics.wording import each

AXES = "xyz"
REFERENCE_DEGC = 35.0
"""Temperature at which a drift with it is nothing: ArduPilot's."""
SURE = 4.0
"""Sigmas from which an unknown of every model is reported: 6e-5 come so far by chance."""
STATEMENTS = (
    *("effect", "code", "title", "sentence", "meaning"),
    *("bearing", "source", "cure", "apart"),
)


class Bearing(Enum):
    """What a found effect means for the calibration that was found beside it."""

    HARMLESS = "harmless"
    """In every calibration, or taken out of it: worth knowing, forbids nothing."""
    BESIDE = "beside"
    """Geometry, modelled beside the calibration: where it moves a number, a person decides."""
    WITHIN = "within"
    """Part of what the sensor reads: where it moves a number, the calibration is withdrawn."""
    NO_ONE_NUMBER = "no_one_number"
    """The calibration is not the same for all of the flight: it is withdrawn."""


@dataclass(frozen=True, slots=True)
class Origin:
    """What effects count from: times, temperatures; places and trim as the autopilot has them.

    Attributes:
        t0: first sample, s on the boot clock.
        temperature: degC.
        antenna: from the IMU, body axes, m.
        trim: AHRS_TRIM, rad.
        imu: which accelerometer, from 1.
        receiver: of GPS, from 1.
        latency_growth: by how much a latency can grow by the stamps of the fixes, a sigma, s a
            second; None where nobody knows.
    """

    t0: float
    temperature: float = REFERENCE_DEGC
    antenna: tuple[float, float, float] = (0.0, 0.0, 0.0)
    trim: tuple[float, float, float] = (0.0, 0.0, 0.0)
    imu: int = 1
    receiver: int = 1
    latency_growth: float | None = None


@dataclass(frozen=True, slots=True)
class Cure:
    """What to do about an effect: in words, and the autopilot's parameters to set by name."""

    words: str
    parameters: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class NuisanceFit:
    """The unknowns of every model as one fit has them.

    Attributes:
        timing: delays and averaging in all, s, by the names of the report.
        theta: (m,) unknowns, ``sigma`` (m,) theirs, ``index`` their places by name.
        point: what they are counted from.
        parameters: the autopilot's, in force.
        imu: which accelerometer.
        clock: what the recording's fixes are stamped with.
    """

    timing: Mapping[str, Estimate]
    theta: Array
    sigma: Array
    index: Mapping[str, int]
    point: Linearisation
    parameters: ParametersInForce
    imu: int
    clock: FixClock


class Effect(Family):
    """An effect of the catalogue: statements first, then how it is looked for, then its words.

    Attributes:
        effect: name in the controlled vocabulary.
        code: number in ``OBC_FINDING``; never given to another effect.
        title: a short sentence, as a heading.
        sentence: the same as part of one, ``{size}`` and ``{degrees}`` filled in.
        meaning: what its unknowns are, for the manual.
        bearing: what it means for the calibration.
        source: where the formula is from.
        cure: what a user does about it.
        apart: the manoeuvre that tells it from what looks alike.
        needs: slow signals of the recording that it follows.
        keys: names of the sizes in a finding, in the order of the unknowns, which begin with them.
            Unknowns that follow are *shapes*: how it acts and not how much.  They are estimated and
            charged for like the sizes, whose sigmas hold them that way, and are not reported.
        plausible: sizes beyond which the explanation is not believed, in the order of ``keys``.
        positive: none of its sizes can be negative, by a law of nature: what surely has one is
            something else, and is not said by this name.
        response: how it goes with one signal; None if with no single one.
        tilts_ekf: it changes the offset in flight, which an EKF takes for tilt at first.
        in_proportion: its regressors are those of the force that was measured without it.
        room_for: effects that are this one with fewer unknowns: they are what is said where the
            rest of it matters nothing.
        changes_force: what others in proportion to the force act on is without it.
        of_attitude: it is the recorded attitude that is wrong.
        trades: it looks much like a nuisance of every model, and one grows with the other.
        in_every_model: its unknowns that are estimated anyway.
        lasts: a nuisance of every model errs slowly as it does: it is told beside as little of that
            as was seen.
        least: size of a timing unknown from which it counts, s; None for what is no timing.
        constant: what it is a size of, in words, where that is one and the same all flight long;
            empty where nothing is asked of that.
        of_flight: another flight of the vehicle has another size of it, or none.
        excluded: it is seen in the data themselves; what it spoils is left out of the fit.
        treated: what becomes of what is excluded, as part of a sentence.
        named: False for a description without a physical name.
        untestable: why no recording can show it; empty if one can.
        bent_by_clipping: why it cannot be asked for beside clipping; empty if it can.
        onset: when it began, s on the boot clock; None if it was always there.
        onset_sigma: of that, s.
    """

    effect: ClassVar[str]
    code: ClassVar[int]
    title: ClassVar[str]
    sentence: ClassVar[str]
    meaning: ClassVar[str]
    bearing: ClassVar[Bearing]
    source: ClassVar[str]
    cure: ClassVar[str]
    apart: ClassVar[str]

    needs: ClassVar[tuple[str, ...]] = ()
    response: ClassVar[Response | None] = None
    tilts_ekf: ClassVar[bool] = False
    in_proportion: ClassVar[bool] = False
    room_for: ClassVar[tuple[str, ...]] = ()
    changes_force: ClassVar[bool] = False
    of_attitude: ClassVar[bool] = False
    positive: ClassVar[bool] = False
    in_every_model: ClassVar[tuple[str, ...]] = ()
    trades: ClassVar[bool] = False
    lasts: ClassVar[bool] = False
    least: ClassVar[float | None] = None
    constant: ClassVar[str] = ""
    of_flight: ClassVar[bool] = False
    excluded: ClassVar[bool] = False
    treated: ClassVar[str] = "those samples were left out of the fit"
    named: ClassVar[bool] = True
    untestable: ClassVar[str] = ""
    bent_by_clipping: ClassVar[str] = ""

    keys: tuple[str, ...] = ()
    plausible: tuple[float, ...] = ()
    onset: float | None = None
    onset_sigma: float = math.nan

    def __init_subclass__(cls, *, abstract: bool = False) -> None:
        """Refuse an effect that leaves a statement out: none of them has a safe default."""
        super().__init_subclass__()
        cls.abstract = abstract
        left_out = [s for s in STATEMENTS if s not in cls.__dict__]
        if left_out and not abstract:
            raise TypeError(f"{cls.__name__} does not state its {', '.join(left_out)}")
        if not abstract and "name" not in cls.__dict__:
            cls.name = cls.effect

    abstract: ClassVar[bool] = True

    def __init__(self, origin: Origin) -> None:
        """Take what it counts from."""
        self.origin = origin

    def take_axes(self, unit: str, bound: float) -> None:
        """Take unknowns x, y, z of one unit; ``bound`` is plausible and the prior's sigma."""
        self.keys = tuple(AXES)
        self.plausible = (bound,) * 3
        self.unknowns = tuple(Unknown(f"{self.name}_{a}", unit, 0.0, bound) for a in AXES)

    def take_shapes(self, names: Sequence[str], unit: str, sigma: float) -> None:
        """Take shapes after the sizes, of one unit and with one sigma of the prior about zero."""
        self.unknowns += tuple(Unknown(f"{self.name}_{n}", unit, 0.0, sigma) for n in names)

    @property
    def never_negative(self) -> tuple[str, ...]:
        """Names of the sizes, if none of them can be negative."""
        sizes = self.unknowns[: len(self.keys)]
        return tuple(u.name for u in sizes) if self.positive else ()

    @property
    def misleads_ekf(self) -> bool:
        """Whether its size, as far as it was taken off the samples, is past what an EKF learns."""
        taken = np.zeros(1) if self.taken_off is None else self.taken_off
        return bool(np.max(np.abs(taken)) > danger.BIAS_M_S2)

    @property
    def shaped(self) -> bool:
        """Whether it has unknowns of its shape."""
        return len(self.unknowns) > len(self.keys)

    def there(self, value: Array, sigma: Array) -> bool:
        """Whether it has a size, of either sign: of what is never negative, shapes share it.

        Args:
            value: (k,) sizes, without shapes.
            sigma: (k,) theirs.
        """
        return not (self.positive and self.shaped) or bool(np.any(np.abs(value) > BEYOND * sigma))

    # -- how it is looked for -------------------------------------------------------------------

    def about(self, size: Array, beside: Sequence[tuple[Effect, Array]] = ()) -> Self:  # noqa: ARG002
        """The effect for a next linearisation, about its own size and those of others.

        Args:
            size: (k,) its unknowns, shapes among them.
            beside: others that change the force, with theirs.
        """
        return self

    def told_by(self, batches: Sequence[Batch]) -> Self:  # noqa: ARG002
        """The effect with as much of its law as these batches of flight can show."""
        return self

    def simpler(self) -> tuple[Self, ...]:
        """Itself with its first unknowns only: hypotheses of their own, simplest first."""
        return ()

    def opened(self) -> Self:
        """Itself, once it stands, with what its law leaves open of the numbers beside it.

        No more than that need be found: what a flight does not tell is in their sigmas.
        """
        return self

    def bent(self, line: ResponseCurve, theta: Array, covariance: Array) -> ResponseCurve:  # noqa: ARG002
        """The response with its shapes: ``line`` has the sizes alone.

        Args:
            line: the curve by the sizes.
            theta: (k,) its unknowns.
            covariance: (k, k) of them.
        """
        return line

    def sized(self, theta: Array, covariance: Array) -> dict[str, Quantity]:
        """What is said of its size, by :attr:`keys`: there are none for the shapes after them.

        Args:
            theta: (k,) its unknowns.
            covariance: (k, k) of them.
        """
        sigma = np.sqrt(np.diag(covariance))
        return {
            key: Quantity(float(theta[i]), float(sigma[i]), self.unknowns[i].unit)
            for i, key in enumerate(self.keys)
        }

    def unsteady(self) -> Array:
        """(3,) variance by which offsets of another flight differ, body axes, (m/s^2)^2."""
        return np.zeros(3)

    def formula(self, sizes: Sequence[float]) -> str:  # noqa: ARG002 - only nameless ones have one
        """What is written where there is no name; empty otherwise."""
        return ""

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:  # noqa: ARG003
        """Its size and cure by the unknowns of every model; None while too small or not sure."""
        return None

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:  # noqa: ARG003
        """Values of :attr:`in_every_model` that mean: it is not there.

        Args:
            point: what the unknowns are counted from.
            told: latency that the autopilot was told, s.
        """
        return dict.fromkeys(cls.in_every_model, 0.0)

    def cured(self, values: Mapping[str, float]) -> Cure:  # noqa: ARG002 - most need no sizes
        """What to do about it, by the values of its unknowns."""
        return Cure(self.cure)

    # -- its words ------------------------------------------------------------------------------

    @classmethod
    def size(cls, found: Finding) -> str:
        """The size in a few words: ``by 259 ± 8 ms``."""
        return each(found.unknowns)

    @classmethod
    def danger(cls, found: Finding) -> str:
        """Why one should not fly with it before it is cured, in words; empty if one may."""
        return danger.of_response(found)

    @classmethod
    def condition(cls, found: Finding, offset: float, change: float) -> str:  # noqa: ARG003
        """When an offset holds that was found beside it; empty if always.

        Args:
            found: the effect.
            offset: of one axis, as the autopilot would be told, m/s^2.
            change: of that offset by one unit of the effect.
        """
        return ""


def on_axes(amount: Array) -> Array:
    """Regressors ``-amount_i e_i``: what each axis reads too much, taken off.

    Args:
        amount: (..., 3), or (..., 1) where it is the same on every axis.

    Returns:
        (..., 3, 3) with regressor i along axis i.
    """
    out = np.zeros((*amount.shape[:-1], 3, 3))
    out.reshape(*out.shape[:-2], 9)[..., ::4] = -amount
    return out
