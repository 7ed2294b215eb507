"""Which is turned against which: accelerometer, gyroscope, recorded attitude, airframe.

Four triads, three small turns between them, all fixed in the body (ArduPilot 4.7, EKF3):

accelerometer against gyroscope
    Regressors of :class:`MountTilt`.  The attitude is integrated from the gyroscope and held
    upright by GPS, so in flight it is right: what the accelerometer reads askew goes into the EKF's
    accelerometer bias (``g`` times the tilt at level).  No parameter turns one of the two alone:
    board orientation and custom rotations turn both, INS_ACCOFFS holds ``g`` times the tilt only as
    long as the force stays where it is at level.  **AHRS_TRIM makes it worse**: what is reported,
    and what is steered by, is the EKF's attitude *less* AHRS_TRIM (getEulerAngles in
    AP_NavEKF3_Outputs.cpp), so it turns an attitude that is right.  Levelling on the ground (also
    the first pose of a six-position calibration: INS_TRIM_OPTION) does just that: it takes
    gravity's direction in the accelerometer for the board's tilt
    (``AP_InertialSensor::_calculate_trim``: ``trim = (atan2(-f_y, -f_z), atan2(f_x, ...))``), which
    is *minus* the unknowns here.
board against airframe
    Both sensors alike.  The board's attitude fits the board's accelerometer, so that velocity
    residuals do not show it.  This is what AHRS_TRIM is for, and a trim that is set says nothing
    of what is missing: it is put back into the recorded attitude
    (:mod:`onboard.core.inputs.assembly`) and the flight is judged in the board's axes.
recorded attitude against both sensors
    Unknowns ``tilt_roll``, ``tilt_pitch`` of every model.  An EKF that integrates the gyroscope is
    not off like that for long, but one that levels with an accelerometer (DCM; an EKF that
    has not learned) is off by the tilt that the accelerometer's error makes at level; so is the
    attitude of another board's sensors, or a trim that the recording does not tell.

An attitude that reads ``tilt`` too large turns the force by ``tilt`` too much; the accelerometer's
own rotation by minus ``tilt`` does the same to the force.  They differ in what the gyroscope sees
of a turn.  Where the accelerometer is turned against the gyroscope, an attitude that is off
beside is its consequence: both are one effect, ``mount_tilt``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.maths.arrays import Array
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.regressors import Unknown
from onboard.core.physics.effect import SURE, Bearing, Cure, NuisanceFit, Origin
from onboard.core.physics.finding import Finding, Quantity
from onboard.core.physics.proportional import Turning
from onboard.core.physics.wording import DEGREE, each

LEAST_RAD = float(np.deg2rad(1.0))
"""What a user can see on a horizon; less is within what an EKF's mean attitude may be off by."""
EKF_SIGMA_RAD = (0.003, 0.006)
"""What an EKF's mean roll and pitch are off by without anything being wrong: ArduPlane's mean pitch
was off by up to 0.011 (0.007 RMS) in ten simulated flights, its roll by up to 0.0025 [tuned;
to be derived]."""

TRIM_RAD = float(np.deg2rad(0.5))
"""A trim worth a word, and what levelling by hand is good for (a bubble's width, 0.09 m/s^2 of
offset).  A board that sits up to 2 deg askew, anyhow, comes as near to a given tilt or its
negative one time of eight; the price is a trim offered that a hover shows to be wrong."""

ALONE = "replace the sensor or its board, no parameter turns an accelerometer against its gyroscope"
LEAVE = "leave AHRS_TRIM and do not level on the ground: the attitude is right in flight"
TAKE_OUT = "AHRS_TRIM was set for this tilt: take it out, the attitude in flight is right without"
IF_LEVELLED = "if AHRS_TRIM is from levelling on the ground, it holds this tilt, too; without it:"


class MountTilt(Turning):
    """Accelerometer turned against gyroscope and attitude: ``measured = exp(tilt x) true``.

    The unknowns are by how much the attitude is too large *for the accelerometer*: minus the angles
    by which it is turned itself.  As unknowns of every model they are those of the recorded
    attitude.
    """

    name = "force_tilt"
    effect = "mount_tilt"
    code = 6
    title = "The accelerometer is tilted against the attitude"
    sentence = "the accelerometer is tilted by {degrees:.2g} deg against the attitude"
    meaning = (
        "`roll`, `pitch`, rad: by how much the attitude is too large for the accelerometer, "
        "with `AHRS_TRIM` put back. See [below](#tilt-and-ahrs_trim)"
    )
    bearing = Bearing.BESIDE
    source = "small rotation about x and y, fixed in the body"
    cure = ALONE
    apart = "turn through all headings with bank and pitch"
    keys = ("roll", "pitch")
    plausible = (0.3, 0.3)
    unknowns = (
        Unknown("force_tilt_roll", "rad", 0.0, 0.15),
        Unknown("force_tilt_pitch", "rad", 0.0, 0.15),
    )
    in_every_model: ClassVar[tuple[str, ...]] = ("tilt_roll", "tilt_pitch")

    def __init__(self, origin: Origin) -> None:
        """Take the trim that is in force."""
        super().__init__(origin)
        # Levelling takes the first accelerometer's word: no trim is another one's tilt.
        self._trim = np.array(origin.trim[:2] if origin.imu == 1 else (0.0, 0.0))

    @classmethod
    def measured(cls, nuisances: NuisanceFit) -> tuple[dict[str, Quantity], Cure] | None:
        """The constant error of the recorded attitude, as it is and as it is reported."""
        at = [nuisances.index[name] for name in cls.in_every_model]
        tilt = nuisances.point.tilt + nuisances.theta[at]
        sigma = np.hypot(nuisances.sigma[at], EKF_SIGMA_RAD)
        # As it is reported: a trim that makes it right again is its cure, whatever was meant by it.
        reported = tilt - np.array(nuisances.parameters.trim[:2])
        if min(np.hypot(*tilt), np.hypot(*reported)) <= LEAST_RAD:
            return None
        if float(np.max(np.abs(tilt) / sigma)) <= SURE:
            return None
        size = {
            key: Quantity(float(value), float(s), "rad")
            for key, value, s in zip(cls.keys, tilt, sigma, strict=True)
        }
        return size, attitude_cure(tilt, nuisances.theta[:6], nuisances.parameters, nuisances.imu)

    @classmethod
    def absent(cls, point: Linearisation, told: float) -> dict[str, float]:  # noqa: ARG003
        """An attitude that fits both sensors."""
        return {"tilt_roll": -point.tilt[0], "tilt_pitch": -point.tilt[1]}

    def cured(self, values: Mapping[str, float]) -> Cure:
        """To leave AHRS_TRIM alone, or to take out of it what was put there for this tilt.

        A trim of this tilt comes from levelling on the ground (minus the unknowns), or from a
        mistaken cure (the unknowns): the attitude in flight is right without either.
        """
        tilt, trim = np.array([values["roll"], values["pitch"]]), self._trim
        if np.hypot(*trim) <= TRIM_RAD:
            return Cure(f"{ALONE}; {LEAVE}")
        if min(np.hypot(*(trim - tilt)), np.hypot(*(trim + tilt))) < TRIM_RAD:
            return Cure(f"{ALONE}; {TAKE_OUT}", {"AHRS_TRIM_X": 0.0, "AHRS_TRIM_Y": 0.0})
        return Cure(f"{ALONE}; {IF_LEVELLED} {_pair(trim + tilt)}")

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by roll 2.1, pitch −1.3°``."""
        return f"by {each(found.unknowns, 1.0 / DEGREE, '°')}"


def attitude_cure(extra: Array, six: Array, parameters: ParametersInForce, imu: int) -> Cure:
    """What to do about a recorded attitude that is off by ``extra`` against both sensors.

    Args:
        extra: (2,) roll, pitch, rad, by which it is too large with AHRS_TRIM put back.
        six: (6,) scale and ``beta = -scale * offset`` that were found.
        parameters: in force when it was recorded.
        imu: which accelerometer.
    """
    if np.hypot(*(extra - levelled(six, parameters, imu))) < 0.5 * np.hypot(*extra):
        return Cure("set the calibration that was found: the autopilot levels with this sensor")
    if imu != 1:
        return Cure(
            "mount the boards alike: the recorded attitude is that of another board's sensors"
        )
    if "AHRS_TRIM_X" not in parameters.values:
        return Cure(f"nothing, if AHRS_TRIM is {_pair(-extra)}: the recording does not have it")
    trim = np.array(parameters.trim[:2])
    if np.hypot(*trim) > TRIM_RAD:
        return Cure(f"if AHRS_TRIM holds the board's tilt alone, set {_pair(trim + extra)} in all")
    x, y = (float(a) for a in trim + extra)
    return Cure("take it off the attitude with AHRS_TRIM", {"AHRS_TRIM_X": x, "AHRS_TRIM_Y": y})


def levelled(six: Array, parameters: ParametersInForce, imu: int) -> Array:
    """(2,) roll, pitch, rad, that an autopilot at level reads off its accelerometer.

    Args:
        six: (6,) what is true of the sensor; what is in force differs from it.
        parameters: in force.
        imu: which accelerometer.
    """
    R_bs, force = parameters.R_bs, parameters.six(imu)
    raw = (R_bs.T @ np.array([0.0, 0.0, -STANDARD_GRAVITY]) - six[3:]) / six[:3]
    f_b = R_bs @ (np.array(force.scale) * (raw - np.array(force.offset)))
    return np.array([-f_b[1], f_b[0]]) / STANDARD_GRAVITY


def trim_in_words(parameters: ParametersInForce) -> str:
    """That a trim worth a word was put back into the recorded attitude; else nothing."""
    trim = np.array(parameters.trim[:2])
    if np.hypot(*trim) <= TRIM_RAD:
        return ""
    return f"AHRS_TRIM ({_pair(trim)} rad) was put back into the recorded attitude."


def _pair(angles: Array) -> str:
    x, y = (round(float(a), 3) + 0.0 for a in angles)  # no minus before a zero
    return f"X {x:.3f}, Y {y:.3f}"
