"""What the core gives: frozen records, one per accelerometer, and how they look as JSON."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any, Self

import numpy as np

from onboard.core.maths.accelerometer import SixParameters
from onboard.core.maths.arrays import Array, Vector3

Six = tuple[float, float, float, float, float, float]
SixFlags = tuple[bool, bool, bool, bool, bool, bool]
SIX_NAMES = ("x scale", "y scale", "z scale", "x offset", "y offset", "z offset")


class Status(Enum):
    """How far a calibration has come.  Only ``CALIBRATED`` may ever be pushed."""

    COLLECTING = "collecting"
    CALIBRATED = "calibrated"
    INSUFFICIENT = "insufficient"
    INVALID = "invalid"


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its standard deviation, both in the same SI unit."""

    value: float
    sigma: float


@dataclass(frozen=True, slots=True)
class Certificate:
    """Uniform bound on the velocity residual from its L2 norm (corrected theorem)."""

    window_s: float
    residual_l2: float
    acceleration_bound: float
    uniform_bound: float
    observed_max: float


@dataclass(frozen=True, slots=True)
class DeadReckoning:
    """Velocity drift of free integration over ``horizon_s``, before and after calibration."""

    horizon_s: float
    drift_before: float
    drift_after: float
    windows: int


@dataclass(frozen=True, slots=True)
class Coverage:
    """How well the flight excites the calibration parameters.

    ``percent`` is that of the weakest; ``per_parameter`` are in percent, in the order of SIX_NAMES.
    """

    percent: float
    per_parameter: Six
    weakest: str
    advice: str


@dataclass(frozen=True, slots=True)
class AtRest:
    """By how much more than gravity an accelerometer reads where its vehicle stands, m/s^2.

    It is no part of the estimate: neither GPS nor attitude, timing or motion are in it.

    Attributes:
        in_force: with the parameters in force.
        estimate: with the estimate.
        sigma: of that, as the estimate claims.
        seconds: that it stood.
    """

    in_force: float
    estimate: float
    sigma: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Together:
    """One accelerometer as all of its vehicle know it, fitting its own gyroscope's axes.

    Attributes:
        imus: whose knowledge it is, its own among them.
        scale: (3,) 1.
        offset: (3,) m/s^2, sensor axes.
        covariance: (6, 6) of both.
    """

    imus: tuple[int, ...]
    scale: Vector3
    offset: Vector3
    covariance: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True)
class Calibration:
    """The answer for one accelerometer.

    ``scale``/``offset`` are absolute, ArduPilot's; the covariance (6x6, row-major tuple of
    tuples) is that of (scale, offset).  ``observable[i]`` is False where the flight does not
    support the number: its value then leans on the prior and its sigma says so.
    ``in_force`` are the parameters that the autopilot used last.  The held-out RMS are of
    whitened residuals on segments that the fit did not see: with the parameters in force and
    with the estimate; ``predictive_gain`` is the logarithm of how much likelier those segments are
    with the estimate.  ``prior_sigma`` (scale, offset) is what was known before the flight;
    ``gyro_sigma`` (likewise) is what of their sigmas comes from the gyroscope's axes: all flights
    with it share that error.  Only a bench sees it, navigation does not
    (:attr:`with_its_gyroscope`).  ``gyro_scale`` is by what share of the rate each axis of the
    gyroscope reads too much, which nobody has a parameter for.
    ``alike_sigma`` (m/s^2, of beta) is what of their sigmas is the same error in all flights of
    the sensor, however many there are.
    ``load_mean`` and ``load_square`` are the means of the raw samples and of their squares, sensor
    axes: the loads that were flown, of which the six should give the force.
    ``believed``: nothing contradicts its sigmas, and there is flight enough.  ``together`` is what
    the vehicle's other accelerometers add (:mod:`onboard.core.estimate.with_others`): only what is
    to be set comes of it.
    """

    imu: int
    status: Status
    scale: Vector3
    offset: Vector3
    scale_sigma: Vector3
    offset_sigma: Vector3
    covariance: tuple[tuple[float, ...], ...]
    observable: SixFlags
    note: str
    in_force_scale: Vector3
    in_force_offset: Vector3
    parameters_known: bool
    timing: dict[str, Estimate]
    trusted_s: float
    rejected: dict[str, int]
    whitened_rms_before: float
    whitened_rms_after: float
    held_out_before: float
    held_out_after: float
    velocity_rms_before: float
    velocity_rms_after: float
    coverage: Coverage
    prior_sigma: Six = (0.03, 0.03, 0.03, 0.5, 0.5, 0.5)
    gyro_sigma: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    gyro_scale: tuple[Estimate, ...] = (Estimate(0.0, math.inf),) * 3
    alike_sigma: Vector3 = (0.0, 0.0, 0.0)
    load_mean: Vector3 = (0.0, 0.0, -9.80665)
    load_square: Vector3 = (1.0, 1.0, 97.0)
    predictive_gain: float = float("nan")
    certificate: Certificate | None = None
    dead_reckoning: DeadReckoning | None = None
    at_rest: AtRest | None = None
    temperature: Estimate | None = None
    believed: bool = False
    together: Together | None = None
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def with_its_gyroscope(self) -> Array:
        """(6, 6) covariance of the six with which the accelerometer fits its gyroscope's axes.

        They are those with which the velocity that the autopilot integrates is right.
        """
        out: Array = np.array(self.covariance, dtype=np.float64)
        out -= np.diag(np.square(self.gyro_sigma))
        return out

    @property
    def best(self) -> tuple[Array, Array]:
        """(6,) and (6, 6) all that is known of the six with its gyroscope: what can be set."""
        if (all_say := self.together) is not None:
            return np.array(all_say.scale + all_say.offset), np.array(all_say.covariance)
        return np.array(self.scale + self.offset), self.with_its_gyroscope

    @property
    def sigma_with_its_gyroscope(self) -> Array:
        """(6,) sigmas of :attr:`with_its_gyroscope`."""
        out: Array = np.sqrt(np.diag(self.with_its_gyroscope))
        return out

    def untold(self, why: str) -> Self:
        """The record of a flight that says nothing of the six: what was known before it.

        Args:
            why: in words, noted first.
        """
        status = Status.INSUFFICIENT if self.status is Status.CALIBRATED else self.status
        scale_sigma, offset_sigma = self.prior_sigma[:3], self.prior_sigma[3:]
        return replace(
            self,
            status=status,
            scale=self.in_force_scale,
            offset=self.in_force_offset,
            scale_sigma=scale_sigma,
            offset_sigma=offset_sigma,
            covariance=tuple(map(tuple, np.diag(np.square(self.prior_sigma)).tolist())),
            observable=(False,) * 6,
            note=f"{why}. {self.note}".rstrip(),
            believed=False,
        )

    @classmethod
    def unanswered(
        cls,
        imu: int,
        in_force: SixParameters,
        note: str,
        *,
        parameters_known: bool,
        coverage: Coverage,
    ) -> Self:
        """The record of an accelerometer of which nobody can say more than what is in force."""
        nan = float("nan")
        return cls(
            imu=imu,
            status=Status.INSUFFICIENT,
            scale=in_force.scale,
            offset=in_force.offset,
            scale_sigma=(nan,) * 3,
            offset_sigma=(nan,) * 3,
            covariance=((nan,) * 6,) * 6,
            observable=(False,) * 6,
            note=note,
            in_force_scale=in_force.scale,
            in_force_offset=in_force.offset,
            parameters_known=parameters_known,
            timing={},
            trusted_s=0.0,
            rejected={},
            whitened_rms_before=nan,
            whitened_rms_after=nan,
            held_out_before=nan,
            held_out_after=nan,
            velocity_rms_before=nan,
            velocity_rms_after=nan,
            coverage=coverage,
        )
