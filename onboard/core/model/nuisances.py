"""Regressors that are always there: calibration parameters, timing, and their nuisances."""

from __future__ import annotations

import numpy as np

from onboard.core.maths.arrays import Array, Vector2, Vector4
from onboard.core.maths.earth import STANDARD_GRAVITY
from onboard.core.maths.frames import cross
from onboard.core.model.around import Around
from onboard.core.model.linearisation import SHAPES
from onboard.core.model.quadrature import Intervals, OfSensors, Signals
from onboard.core.model.regressors import Direct, Family, Unknown

AXIS = "xyz"
SHAPE = 1.0
"""Prior sigma of the share that is not an even mean: the whole."""
ANTENNA_SIGMA = 0.05
"""Prior sigma of an error of the lever arm, m.  A person with a ruler knows neither where in its
housing an antenna receives nor where on its board a sensor is to better than 2 or 3 cm; where
nothing is configured, the two are a hand's breadth apart even on a small vehicle.  What is more is
an effect.  On flights with turns 2 cm and 15 cm give the calibration parameters the same sigmas
within a few per cent."""


class Six(Family):
    """Scale and ``beta = -scale * offset`` of the accelerometer: ``f_s = scale raw + beta``."""

    name = "six"
    is_averaged = False

    def __init__(
        self,
        scale: Array | None = None,
        beta: Array | None = None,
        scale_sigma: float = 0.03,
        beta_sigma: float = 0.5,
    ) -> None:
        """Take the prior: a factory-calibrated MEMS has 2-3 % and 0.5 m/s^2 (method.md, 4)."""
        centre = np.ones(3) if scale is None else scale
        shift = np.zeros(3) if beta is None else beta
        self.unknowns = tuple(
            Unknown(f"scale_{a}", "1", float(centre[i]), scale_sigma) for i, a in enumerate(AXIS)
        ) + tuple(
            Unknown(f"beta_{a}", "m/s^2", float(shift[i]), beta_sigma) for i, a in enumerate(AXIS)
        )

    def acceleration(self, nodes: Signals) -> Array:
        """``R_bs e_j raw_j`` and ``R_bs e_j``."""
        out = np.empty((*nodes.t.shape, 3, 6))
        out[..., :3] = nodes.R_bs * nodes.raw_s[..., None, :]
        out[..., 3:] = nodes.R_bs
        return out

    def gained(self, intervals: Intervals, of: OfSensors) -> Array:  # noqa: ARG002
        """Of :meth:`acceleration`."""
        return np.concatenate([of.raw, of.axes @ of.R_bs], axis=-1)


class GpsLatency(Family):
    """How late the receiver's velocity is: ``V(t - delay)``, first order about the delay taken."""

    name = "gps_latency"

    def __init__(self, taken: float, sigma: float = 0.5) -> None:
        """Take the delay (s) of the linearisation, which is also the prior's centre."""
        self.unknowns = (Unknown("gps_delay", "s", 0.0, sigma),)
        self.taken = taken

    def velocity(self, around: Around) -> Direct:
        """``-a = -(R f + g)``, at the antenna, averaged as the velocity is."""
        body = -around.f_mean[..., None]
        ned = np.zeros_like(body)
        ned[:, 2, 0] = -STANDARD_GRAVITY
        return Direct(body=body, ned=ned)

    def position(self, around: Around) -> Direct:
        """``-v``."""
        return Direct(along_velocity=-np.ones((len(around.now.t), 1)))


class HeightLatency(Family):
    """Additional lateness of the reported height: receivers smooth positions by themselves."""

    name = "height_latency"

    def __init__(self, sigma: float = 0.1) -> None:
        """Take the prior sigma, s."""
        self.unknowns = (Unknown("height_delay", "s", 0.0, sigma),)

    def position(self, around: Around) -> Direct:
        """``-v``, for the height only."""
        return Direct(along_velocity=-np.ones((len(around.now.t), 1)))


class GpsSmoothing(Family):
    """Averaging span of the receiver, and how it weighs what is in it.

    The first unknown is ``window^2`` less that taken: twelve times the variance of the response.
    The others are how much of it is two moments an epoch apart, of which the newer or the older
    weighs more (a receiver that interpolates between its own epochs, as ArduPilot's simulator
    does), how much two moments lean besides, which is linear where their weights are not (about
    halves), and how much is a first-order lag (one that filters), instead of an even mean.  All
    spread alike, so that without a span there are no shapes.

    Where one shape is held for another, quick manoeuvres and slow ones want another span, and
    scale and offset of z make up for it: by seven sigma on the simulator's planes.
    """

    name = "gps_smoothing"

    def __init__(
        self, taken: float, sigma: float = 0.2, shapes: Vector4 = (0.0, 0.0, 0.0, 0.0)
    ) -> None:
        """Take window (s) and shapes of the linearisation; ``sigma`` is of ``window^2``, s^2."""
        self.unknowns = (
            Unknown("window_squared", "s^2", -(taken**2), sigma),
            *(
                Unknown(name, "1", -share, SHAPE)
                for name, share in zip(SHAPES, shapes, strict=True)
            ),
        )

    def velocity(self, around: Around) -> Direct:
        """Slope of the response to ``window^2``; the other shapes less the mean over the span."""
        return Direct(body=np.concatenate([around.slope[..., None], around.shapes], axis=-1))

    def position(self, around: Around) -> Direct:
        """``a / 24``: the mean of a parabola over the span, in whichever shape; and these."""
        body = np.concatenate([around.f_mean[..., None] / 24.0, around.shape_places], axis=-1)
        ned = np.zeros_like(body)
        ned[:, 2, 0] = STANDARD_GRAVITY / 24.0
        return Direct(body=body, ned=ned)


class LeverArmError(Family):
    """Antenna some centimetres away from where it is configured to be: a nuisance.

    Held at nothing, a centimetre ``r`` is taken for something else.  Forwards or sideways, in turns
    at a rate ``w``, its acceleration is that of an offset ``w^2 r``.  Upwards, with the force of a
    hover, its velocity is what the receiver's average makes of ``window^2 = 24 r / g``; scale and
    offset of z then make up for what such a window does where the force is another one.
    """

    name = "antenna_place"

    def __init__(self, sigma: float = ANTENNA_SIGMA) -> None:
        """Take the prior sigma, m."""
        self.unknowns = tuple(Unknown(f"antenna_{a}", "m", 0.0, sigma) for a in AXIS)

    def velocity(self, around: Around) -> Direct:
        """``R (w x e_i)``, the velocity of a point of a rigid body, as the receiver sees it."""
        return Direct(body=around.swing)

    def position(self, around: Around) -> Direct:
        """``R e_i``."""
        body = np.zeros((len(around.now.t), 3, 3))
        body[:] = np.eye(3)
        return Direct(body=body)


class ImuDelay(Family):
    """How late the recorded attitude is stamped against the inertial samples."""

    name = "imu_delay"

    def __init__(self, taken: float = 0.0, sigma: float = 0.2) -> None:
        """Take the delay of the linearisation, s; the prior's centre is none."""
        self.unknowns = (Unknown("attitude_delay", "s", -taken, sigma),)
        self.taken = taken

    def attitude(self, around: Around) -> Direct:
        """``R(t - d) R(t)^T = exp(-R w d)``."""
        return Direct(body=-around.now.w_b[..., None])


class GyroTiming(Family):
    """Remaining delay between gyroscope and accelerometer: their filters need not be alike."""

    name = "gyro_timing"
    is_read = False

    def __init__(self, sigma: float = 0.005) -> None:
        """Take the prior sigma, s: streams send both in one message."""
        self.unknowns = (Unknown("gyro_delay", "s", 0.0, sigma),)

    def acceleration(self, nodes: Signals) -> Array:
        """``R(t + d) f = R f + R (w x f) d``: a late gyroscope gives an attitude of the past."""
        return cross(nodes.w_b, nodes.f_b)[..., None]

    def gained(self, intervals: Intervals, of: OfSensors) -> Array:  # noqa: ARG002
        """Of :meth:`acceleration`."""
        return of.turned


class AttitudeOffset(Family):
    """Constant errors of the recorded attitude: tilt fixed in the body, heading fixed to north."""

    name = "attitude_offset"

    def __init__(
        self,
        heading: float = 0.0,
        tilt: Vector2 = (0.0, 0.0),
        tilt_sigma: float = 0.03,
        heading_sigma: float = 0.1,
    ) -> None:
        """Take the errors of the linearisation, of heading and (2,) tilt, and prior sigmas, rad."""
        self.unknowns = (
            Unknown("tilt_roll", "rad", -tilt[0], tilt_sigma),
            Unknown("tilt_pitch", "rad", -tilt[1], tilt_sigma),
            Unknown("heading", "rad", -heading, heading_sigma),
        )

    def attitude(self, around: Around) -> Direct:
        """``R e_x``, ``R e_y`` and ``e_down``: how much too large the recorded angles are."""
        K = len(around.now.t)
        body, ned = np.zeros((K, 3, 3)), np.zeros((K, 3, 3))
        body[:, 0, 0] = body[:, 1, 1] = 1.0
        ned[:, 2, 2] = 1.0
        return Direct(body=body, ned=ned)
