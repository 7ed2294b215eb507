"""What the challenge at vehicle level conceals: airframes, winds, and sensors beside them.

Every recording is drawn from its seed.  Sizes are of two levels: ``small`` need not be found, but
must not be given a wrong name; ``large`` is to be found.  What a mission cannot show by nature is
declared here, before any recording is made:

* the ground's cushion takes a hover close above it, which no mission has;
* thinner air is less thrust and less drag at once, and two effects may be said of it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Literal

import numpy as np

from sitl.builtin import effects as sensors
from sitl.builtin.airframe.air import Air
from sitl.builtin.airframe.aircraft import Aircraft
from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.airframe.wing import Wing
from sitl.builtin.trajectory import Environment
from sitl.builtin.truth import GpsTruth, ImuTruth
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec

Rng = np.random.Generator
Kind = Literal["control", "single", "pair", "mixed", "outside"]
Level = Literal["small", "large"]
SMALL = 0.2
"""A small effect is this share of a large one."""
DURATION_S = (120.0, 200.0)
SLOWER = 0.85
"""What the airframe cannot fly is flown again, on another mission and so much slower."""
ATTEMPTS = 4
DRAWS = 5
"""What it cannot fly in so many attempts is no flight that a person would record: drawn again."""
AGAIN = 100_000
ALTITUDE: dict[Vehicle, tuple[float, float]] = {"copter": (0.0, 1000.0), "plane": (0.0, 30.0)}
"""Of the field, m.  ArduPilot's simulated plane takes the equivalent airspeed for the true one;
near sea level both are the same, and its nominal plane is this one."""
STAMPED_EARLY = 0.02
NET_DELAY = (0.09, 0.11)
"""Of every receiver, s: about what ArduPilot's simulated one has, so that none is an effect."""
RESIDUAL_SCALE, RESIDUAL_OFFSET = 0.002, 0.03
"""Every accelerometer is a little wrong after its calibration: 1 and m/s^2, standard deviations."""

COPTER = (
    "wind", "wind_profile", "turbulence", "rotor_drag", "body_drag", "thrust_scale",
    "thrust_curve", "voltage_sag", "motor_lag", "thrust_tilt", "ground_effect", "air_density",
)  # fmt: skip
PLANE = ("wind", "turbulence", "drag", "lift", "side_force", "thrust_scale", "airspeed_scale")
NAMES: dict[Vehicle, tuple[str, ...]] = {"copter": COPTER, "plane": PLANE}
UNSHOWN = ("ground_effect", "air_density")
"""Not counted among what is to be found."""
BLOWING = ("wind_profile", "turbulence")
"""Come with a wind."""
SENSORS = ("accelerometer_offset", "gps_latency", "mount_tilt")
OUTSIDE = ("gust", "payload")
NAMED = {"payload": "mass_change"}
"""What was outside the catalogue when the challenge was drawn up, and has a name since."""
NEARLY = {
    "gust": {"wind", "turbulence", "wind_profile"},
    "payload": {"thrust_scale"},
    "air_density": {"thrust_scale", "rotor_drag", "body_drag"},
    "turbulence": set[str](),
}
"""Names that are no error when these are concealed."""


@dataclass(frozen=True, slots=True)
class Secret:
    """One recording to be made: what is in it is drawn from the seed."""

    seed: int
    vehicle: Vehicle
    kind: Kind
    names: tuple[str, ...] = ()
    level: Level = "large"
    lasting_s: tuple[float, float] = DURATION_S

    @property
    def wanted(self) -> set[str]:
        """Catalogue names that are concealed."""
        if self.kind in ("control", "outside"):
            return {NAMED[n] for n in self.names if n in NAMED}
        out = set(self.names) - {"accelerometer_offset"}
        return out | {"wind"} if out & set(BLOWING) else out

    @property
    def allowed(self) -> set[str]:
        """Names that are no error."""
        near = set[str]().union(*(NEARLY.get(name, set()) for name in self.names))
        return self.wanted | near

    @property
    def testable(self) -> bool:
        """Whether the effects are of a kind and a size that must be found."""
        return bool(self.wanted) and self.level == "large" and not self.wanted & set(UNSHOWN)

    def spec(self, attempt: int = 0) -> FlightSpec:
        """The flight with everything drawn; a later attempt flies another mission, slower.

        After every ``ATTEMPTS`` all sizes are drawn anew.
        """
        draw, slower = divmod(attempt, ATTEMPTS)
        rng = np.random.default_rng([self.seed, 983, draw] if draw else [self.seed, 983])
        duration = float(rng.uniform(*self.lasting_s))
        imu = ImuTruth(
            scale=_three(1.0 + RESIDUAL_SCALE * rng.standard_normal(3)),
            offset=_three(RESIDUAL_OFFSET * rng.standard_normal(3)),
        )
        delay = STAMPED_EARLY + float(rng.uniform(*NET_DELAY))
        aircraft = Aircraft(
            craft=Wing() if self.vehicle == "plane" else Airframe(),
            air=Air(seed=self.seed),
            fastest=float(rng.uniform(9.0, 12.0)) * SLOWER**slower,
        )
        share = SMALL if self.level == "small" else 1.0
        extra: list[sensors.Effect] = []
        for name in sorted((self.wanted - set(NAMED.values())) | set(self.names)):
            if name in SENSORS:
                imu, effects = _sensor(name, rng, imu)
                extra += effects
            else:
                aircraft = _concealed(name, aircraft, rng, share, duration)
        return FlightSpec(
            vehicle=self.vehicle,
            seed=self.seed + AGAIN * attempt,
            duration=duration,
            imus=(imu,),
            gps=GpsTruth(delay=delay, stamped_early=STAMPED_EARLY),
            effects=tuple(extra),
            environment=Environment(altitude=float(rng.uniform(*ALTITUDE[self.vehicle]))),
            aircraft=aircraft,
        )


def _three(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _sensor(name: str, rng: Rng, imu: ImuTruth) -> tuple[ImuTruth, list[sensors.Effect]]:
    """An error of the sensors, beside the vehicle's."""
    sign = rng.choice([-1.0, 1.0], 3)
    if name == "accelerometer_offset":
        return replace(imu, offset=_three(sign * rng.uniform(0.15, 0.35, 3))), []
    if name == "gps_latency":
        return imu, [sensors.GpsLatency(delay=float(rng.uniform(0.08, 0.16)))]
    roll, pitch = (float(x) for x in sign[:2] * rng.uniform(0.03, 0.06, 2))
    return imu, [sensors.MountTilt(roll=roll, pitch=pitch)]


def _either(rng: Rng, share: float, low: tuple[float, float], high: tuple[float, float]) -> float:
    """A factor below or above one, its distance from one times the share."""
    factor = float(rng.uniform(*(low if rng.random() < 0.5 else high)))
    return 1.0 + share * (factor - 1.0)


def _concealed(name: str, aircraft: Aircraft, rng: Rng, share: float, duration: float) -> Aircraft:
    """The aircraft with one more effect."""
    air = _air(name, aircraft, rng, share, duration)
    if air is not None:
        return replace(aircraft, air=air)
    craft = aircraft.craft
    if isinstance(craft, Wing):
        return replace(aircraft, craft=_wing(name, craft, rng, share))
    return replace(aircraft, craft=_frame(name, craft, rng, share, duration))


def _air(name: str, aircraft: Aircraft, rng: Rng, share: float, duration: float) -> Air | None:
    air = aircraft.air
    plane = isinstance(aircraft.craft, Wing)
    match name:
        case "wind":
            speed = share * float(rng.uniform(4.0, 8.0) if plane else rng.uniform(3.0, 7.0))
            blown = Air.from_settings(speed, float(rng.uniform(0.0, 360.0)))
            return replace(air, north=blown.north, east=blown.east)
        case "wind_profile":
            return replace(
                air, exponent=0.5 if rng.random() < 0.6 else float(rng.uniform(0.2, 0.6))
            )
        case "turbulence":
            sigma = float(rng.uniform(0.3, 0.6) if plane else rng.uniform(0.6, 1.2))
            time = float(rng.uniform(1.0, 3.0))
            return replace(air, turbulence=share * sigma, turbulence_time=time)
        case "air_density":
            return replace(air, density_ratio=_either(rng, share, (0.84, 0.9), (0.84, 0.9)))
        case "gust":
            north, east = rng.uniform(3.0, 5.0, 2) * rng.choice([-1.0, 1.0], 2)
            begin = float(rng.uniform(0.3, 0.6)) * duration
            end = begin + float(rng.uniform(5.0, 10.0))
            return replace(
                air, gust_north=float(north), gust_east=float(east), gust_start=begin, gust_end=end
            )
    return None


def _frame(name: str, frame: Airframe, rng: Rng, share: float, duration: float) -> Airframe:
    match name:
        case "rotor_drag":
            factor = _either(rng, share, (0.3, 0.6), (1.5, 2.2))
            return frame.with_drag(mcoef=factor * frame.mcoef)
        case "body_drag":
            factor = _either(rng, share, (0.3, 0.6), (1.5, 2.0))
            return frame.with_drag(bcoef=frame.bcoef / factor)
        case "thrust_scale":
            factor = _either(rng, share, (0.82, 0.9), (1.12, 1.3))
            return replace(frame, hoverThrOut=frame.hoverThrOut / factor)
        case "thrust_curve":
            far = float(rng.uniform(0.1, 0.4) if rng.random() < 0.7 else rng.uniform(0.85, 0.95))
            return replace(frame, propExpo=0.65 + share * (far - 0.65))
        case "voltage_sag":
            capacity, resistance = float(rng.uniform(4.5, 7.0)), float(rng.uniform(0.012, 0.03))
            return replace(
                frame, battCapacityAh=capacity / share**0.5, refBatRes=resistance * share
            )
        case "motor_lag":
            return replace(frame, motor_lag=share * float(rng.uniform(0.04, 0.1)))
        case "thrust_tilt":
            size, way = float(rng.uniform(0.03, 0.07)), float(rng.uniform(-np.pi, np.pi))
            x, y = share * size * np.cos(way), share * size * np.sin(way)
            return replace(frame, motor_vector=(float(x), float(y), -1.0))
        case "ground_effect":
            return replace(frame, ground_effect=float(rng.uniform(1.0, 2.0)))
        case "payload":
            until = float(rng.uniform(0.4, 0.6)) * duration
            return replace(frame, payload=float(rng.uniform(0.3, 0.6)), payload_until=until)
    raise ValueError(f"no effect of a multicopter's: {name}")


def _wing(name: str, wing: Wing, rng: Rng, share: float) -> Wing:
    match name:
        case "drag":
            return replace(
                wing, c_drag_p=wing.c_drag_p * _either(rng, share, (0.5, 0.7), (1.4, 1.9))
            )
        case "lift":
            if rng.random() < 0.5:
                sign = float(rng.choice([-1.0, 1.0]))
                shift = share * sign * float(rng.uniform(0.12, 0.25))
                return replace(wing, c_lift_0=wing.c_lift_0 + shift)
            return replace(
                wing, c_lift_a=wing.c_lift_a * _either(rng, share, (0.7, 0.82), (1.2, 1.35))
            )
        case "side_force":
            return replace(wing, c_y_b=wing.c_y_b * _either(rng, share, (0.4, 0.6), (1.5, 2.0)))
        case "thrust_scale":
            factor = _either(rng, share, (0.8, 0.88), (1.15, 1.3))
            return replace(wing, hover_throttle=wing.hover_throttle / factor)
        case "airspeed_scale":
            scale = _either(rng, share, (0.86, 0.92), (1.08, 1.15))
            return replace(wing, airspeed_ratio=wing.airspeed_ratio / scale**2)
    raise ValueError(f"no effect of a plane's: {name}")


@dataclass(frozen=True, slots=True)
class Challenge:
    """How many recordings of each kind; the whole of it is past 150."""

    first: int
    controls: int = 50
    repeats: int = 2
    pairs: int = 24
    mixed: int = 16
    outside: int = 8
    levels: tuple[Level, ...] = ("small", "large")
    vehicles: tuple[Vehicle, ...] = field(default=("copter", "plane"))

    def secrets(self) -> list[Secret]:
        """All of them, shuffled: any part of the list is a fair sample."""
        out = [Secret(self.first + i, *what) for i, what in enumerate(self._kinds())]
        rng = np.random.default_rng([self.first, 7])
        return [out[i] for i in rng.permutation(len(out))]

    def _kinds(self) -> Iterator[tuple[Vehicle, Kind, tuple[str, ...], Level]]:
        for i in range(self.controls):
            yield self._vehicle(i), "control", (), "large"
        for vehicle in self.vehicles:
            for name in NAMES[vehicle]:
                for level in self.levels:
                    for _ in range(self.repeats if level == "large" else 1):
                        yield vehicle, "single", (name,), level
        rng = np.random.default_rng([self.first, 8])
        for i in range(self.pairs):
            vehicle = self._vehicle(i)
            couples = list(combinations([n for n in NAMES[vehicle] if n not in UNSHOWN], 2))
            yield vehicle, "pair", couples[int(rng.integers(len(couples)))], "large"
        for i in range(self.mixed):
            vehicle = self._vehicle(i)
            able = [n for n in NAMES[vehicle] if n not in UNSHOWN]
            sensor = SENSORS[(i // len(self.vehicles)) % len(SENSORS)]
            yield vehicle, "mixed", (able[int(rng.integers(len(able)))], sensor), "large"
        for i in range(self.outside):
            able = [n for n in OUTSIDE if self._vehicle(i) == "copter" or n == "gust"]
            yield self._vehicle(i), "outside", (able[(i // 2) % len(able)],), "large"

    def _vehicle(self, i: int) -> Vehicle:
        return self.vehicles[i % len(self.vehicles)]


def gusty_planes(first: int, alone: int = 10, each: int = 3) -> list[Secret]:
    """Planes in turbulence with nothing else, and with each of a plane's effects beside it."""
    others = [name for name in PLANE if name not in ("wind", "turbulence")]
    names = [("turbulence",)] * alone
    names += [(name, "turbulence") for name in others for _ in range(each)]
    kinds: list[Kind] = ["single" if len(n) == 1 else "pair" for n in names]
    return [
        Secret(first + i, "plane", kind, n)
        for i, (kind, n) in enumerate(zip(kinds, names, strict=True))
    ]


def dropped(first: int, count: int = 24) -> list[Secret]:
    """Copters whose payload goes in flight."""
    return [Secret(first + i, "copter", "outside", ("payload",)) for i in range(count)]
