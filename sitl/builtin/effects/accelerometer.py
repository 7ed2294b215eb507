"""What can be wrong with an accelerometer, or with its mount."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sitl.builtin import rotation
from sitl.builtin.effects.base import Array, Effect, Scene, Sizes, Vector3, turned
from sitl.builtin.trajectory import STANDARD_GRAVITY


@dataclass(frozen=True, slots=True, kw_only=True)
class ByAxis(Effect):
    """What has a size ``x, y, z`` for each axis, on accelerometer ``imu`` (0: on all)."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    imu: int = 0

    @property
    def sizes(self) -> Array:
        """(3,) the sizes of the axes."""
        return np.array((self.x, self.y, self.z))


@dataclass(frozen=True, slots=True, kw_only=True)
class CrossAxis(Effect):
    """``f += M f``, M without diagonal; ``xy`` is what x reads too much per unit along y."""

    name: ClassVar[str] = "cross_axis"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"xy": 0.011, "xz": 0.013, "yx": 0.013, "yz": 0.01, "zx": 0.01, "zy": 0.012},
        "plane": {"xy": 0.036, "xz": 0.017, "yx": 0.026, "yz": 0.014, "zx": 0.016, "zy": 0.024},
    }
    kind: ClassVar[str] = "turn"
    xy: float = 0.0
    xz: float = 0.0
    yx: float = 0.0
    yz: float = 0.0
    zx: float = 0.0
    zy: float = 0.0
    imu: int = 0

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        M = np.array([[0, self.xy, self.xz], [self.yx, 0, self.yz], [self.zx, self.zy, 0]])
        out: Array = scene.f_b @ M.T
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerTilt(Effect):
    """The accelerometers alone are turned: gyroscopes and attitude stay as they are.

    As ArduPilot's SIM_ACC_TRIM of ``(-roll, -pitch)``: the force that is read is the true one
    turned by ``from_euler(-roll, -pitch, 0)`` transposed.  In the catalogue's sign: by how much
    the recorded attitude is too large for the accelerometer (rad).
    """

    name: ClassVar[str] = "mount_tilt"
    roll: float = 0.0
    pitch: float = 0.0

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        out: Array = scene.f_b @ turned(-self.roll, -self.pitch) - scene.f_b
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class TemperatureDrift(ByAxis):
    """``f += (x, y, z) u + square u^2 + cube u^3``, ``u = T - reference``, m/s^2/K and so on."""

    name: ClassVar[str] = "temperature_drift"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.009, "y": 0.009, "z": 0.003},
        "plane": {"x": 0.015, "y": 0.015, "z": 0.006},
    }
    kind: ClassVar[str] = "offset in time"
    reference: float = 35.0
    square: Vector3 = (0.0, 0.0, 0.0)
    cube: Vector3 = (0.0, 0.0, 0.0)

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        u = scene.temperature - self.reference
        out: Array = np.outer(u, self.sizes) + np.outer(u**2, self.square)
        return out + np.outer(u**3, self.cube)


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasRamp(ByAxis):
    """``f += (x, y, z) (t - t0)``, m/s^3, t0 the start of the recording."""

    name: ClassVar[str] = "bias_ramp"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.0006, "y": 0.0006, "z": 0.0002},
        "plane": {"x": 0.0011, "y": 0.0012, "z": 0.0004},
    }
    kind: ClassVar[str] = "offset in time"

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        return np.outer(scene.elapsed, self.sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class BiasStep(ByAxis):
    """``f += (x, y, z)`` from ``time`` seconds after the start of the recording on, m/s^2."""

    name: ClassVar[str] = "bias_step"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.07, "y": 0.07, "z": 0.04},
        "plane": {"x": 0.12, "y": 0.12, "z": 0.06},
    }
    kind: ClassVar[str] = "offset in time"
    time: float

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        return np.outer(scene.elapsed >= self.time, self.sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleStep(ByAxis):
    """``f_i += c_i f_i`` from ``time`` seconds after the start of the recording on."""

    name: ClassVar[str] = "scale_step"
    kind: ClassVar[str] = "offset in time"
    time: float

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        out: Array = (scene.elapsed >= self.time)[:, None] * self.sizes * scene.f_b
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class OffsetWander(ByAxis):
    """Flicker noise of the offset, of bias instability ``(x, y, z)``, m/s^2.

    Relaxations of every octave from 2 s to an hour, each of the variance ``B^2 ln 2 / pi``, have
    together the density of flicker noise (McWhorter).
    """

    name: ClassVar[str] = "offset_wander"
    kind: ClassVar[str] = "offset in time"
    seed: int = 0

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        step = 0.1
        lasting = 2.0 ** np.arange(1, 13)
        kept = np.exp(-step / lasting)[:, None]
        sigma = np.sqrt(np.log(2.0) / np.pi) * self.sizes
        chance = np.random.default_rng(self.seed)
        t = np.arange(scene.elapsed[0], scene.elapsed[-1] + 2.0 * step, step)
        x = sigma * chance.standard_normal((len(lasting), 3))
        rows = []
        for _ in t:
            rows.append(x.sum(axis=0))
            fresh = chance.standard_normal(x.shape)
            x = kept * x + np.sqrt(1.0 - kept**2) * sigma * fresh
        off = np.array(rows)
        return np.stack([np.interp(scene.elapsed, t, off[:, i]) for i in range(3)], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ScaleNonlinearity(ByAxis):
    """``f_i += c_i f_i^2 / g``, c in 1/g."""

    name: ClassVar[str] = "scale_nonlinearity"
    units: ClassVar[Mapping[str, Sizes]] = {"plane": {"x": 0.02, "z": 0.01}}
    most: ClassVar[float] = 0.05
    kind: ClassVar[str] = "offset with the flight"

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        out: Array = self.sizes * scene.f_b**2 / STANDARD_GRAVITY
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationRectification(ByAxis):
    """``f_i += c_i vibe_i^2``, vibe as VIBRATION reports it, c in s^2/m."""

    name: ClassVar[str] = "vibration_rectification"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.006, "y": 0.006, "z": 0.002},
        "plane": {"x": 0.006, "y": 0.006, "z": 0.002},
    }
    kind: ClassVar[str] = "offset with the flight"
    alone: ClassVar[bool] = True

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        out: Array = self.sizes * scene.level**2
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class ThrottleCoupling(ByAxis):
    """``f += (x, y, z) throttle``, m/s^2 at full throttle."""

    name: ClassVar[str] = "throttle_coupling"
    units: ClassVar[Mapping[str, Sizes]] = {
        "copter": {"x": 0.2, "y": 0.2},
        "plane": {"x": 0.3, "y": 0.2, "z": 0.12},
    }
    kind: ClassVar[str] = "offset with the flight"

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        return np.outer(scene.trajectory.throttle, self.sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class Saturation(Effect):
    """The raw sensor clips at ``limit`` m/s^2."""

    name: ClassVar[str] = "saturation"
    units: ClassVar[Mapping[str, Sizes]] = {"copter": {"limit": 13.0}, "plane": {"limit": 13.0}}
    alone: ClassVar[bool] = True
    limit: float
    imu: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadFlex(Effect):
    """Recorded tilt is too large by (roll, pitch) per g of load beyond one (rad)."""

    name: ClassVar[str] = "load_flex"
    units: ClassVar[Mapping[str, Sizes]] = {"plane": {"roll": 0.011, "pitch": 0.015}}
    kind: ClassVar[str] = "turn"
    roll: float = 0.0
    pitch: float = 0.0

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        load = -scene.f_b[:, 2] / STANDARD_GRAVITY - 1.0
        flex = rotation.from_vector(np.outer(load, (self.roll, self.pitch, 0.0)))
        out: Array = rotation.rotate(flex, scene.f_b) - scene.f_b
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class Nameless(ByAxis):
    """Something that no catalogue has: ``f += (x, y, z) s(t)``, for seeing what is said of it.

    ``term`` is the signal ``s``: ``dynamic_pressure`` (airspeed / 10 m/s)^2, ``roll_rate``
    rad/s, ``swing`` sin of 2 pi per 40 s, ``climb_rate`` m/s upwards.
    """

    name: ClassVar[str] = "nameless"
    term: str

    def reads_too_much(self, scene: Scene) -> Array:
        """(n, 3) m/s^2."""
        signals = {
            "dynamic_pressure": (scene.trajectory.airspeed / 10.0) ** 2,
            "roll_rate": scene.trajectory.w_b[:, 0],
            "swing": np.sin(2.0 * np.pi * scene.elapsed / 40.0),
            "climb_rate": -scene.trajectory.v_n[:, 2],
        }
        return np.outer(signals[self.term], self.sizes)


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerResolution(Effect):
    """Readings of whole steps, m/s^2, ``cut`` to them ``toward_zero``, ``down`` or ``nearest``."""

    name: ClassVar[str] = "accelerometer_resolution"
    step: float = 0.1
    cut: str = "toward_zero"
    imu: int = 0

    def spoil(self, readings: Array, chance: np.random.Generator) -> Array:  # noqa: ARG002
        """(n, 3) m/s^2, those that were handed out."""
        whole = {"toward_zero": np.trunc, "down": np.floor, "nearest": np.rint}[self.cut]
        out: Array = whole(readings / self.step) * self.step
        return out


@dataclass(frozen=True, slots=True, kw_only=True)
class AccelerometerSpikes(Effect):
    """Single readings that a bus has spoiled: ``size`` m/s^2 off on every axis, either way."""

    name: ClassVar[str] = "accelerometer_spikes"
    size: float = 9.8
    share: float = 0.01
    imu: int = 0

    def spoil(self, readings: Array, chance: np.random.Generator) -> Array:
        """(n, 3) m/s^2, those that were handed out."""
        spoiled = chance.random(len(readings)) < self.share
        signs = chance.choice([-1.0, 1.0], size=readings.shape)
        out: Array = readings + self.size * spoiled[:, None] * signs
        return out
