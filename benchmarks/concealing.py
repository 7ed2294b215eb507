"""What the sealed challenge conceals: effects, sizes, pairs, controls, and what has no name.

Sizes count in *units*: what clean flights of the same kind say five sigma of that unknown are
(rounded, four minutes of the simulated vehicles' random manoeuvres).  ``small`` is about one
unit: it need not be found, but must not be given a wrong name.  ``medium`` and ``large`` are to be
found.  What a flight cannot show by nature is declared here, before any recording is made:

* gravity beside a z offset takes steep turns for minutes: a unit is more than any place on earth;
* curvature of the scale and a bending mount need load factors: a copter flies near one;
* an offset along z that goes with the throttle is a scale of z to a copter, whose force along z the
  throttle makes (five sigma are 3.5 m/s^2);
* a multicopter's drag changes how it flies, not what its sensors read.

Apart from that challenge there is one of what it has not got (:class:`Harder`): offsets that follow
the temperature along a curve, alone and beside another effect, and clipping beside another effect.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any, Literal

import numpy as np

from sitl.builtin import effects as concealed
from sitl.builtin.effects import TemperatureDrift
from sitl.builtin.truth import GpsTruth, random_imus
from sitl.builtin.world import Vehicle
from sitl.recording import FlightSpec

Rng = np.random.Generator
Level = Literal["small", "medium", "large"]
LEVELS: dict[Level, tuple[float, float]] = {
    "small": (0.7, 1.2),
    "medium": (2.0, 3.0),
    "large": (4.0, 6.0),
}
NET_DELAY = (0.0, 0.03)
"""Every receiver is a little late: below the size from which it is called an effect."""
STAMPED_EARLY = 0.02
SHAKEN = (4.0, 4.0, 6.0)
"""Motor tone in recordings of vibration's own effect: no vibration, nothing to rectify."""

CONCEALED = {kind.name: kind for kind in concealed.ALL if kind.units}
UNITS: dict[str, Mapping[str, Mapping[str, float]]] = {n: k.units for n, k in CONCEALED.items()}
"""Sizes of one unit by effect, vehicle and unknown, as the concealed effects state them."""
HALF_WARMED_K = 15.0
"""Half of the range of temperatures of most flights: beyond 35 degC they warm up by as much."""
RAILS: dict[Level, tuple[float, float]] = {
    "small": (13.0, 14.0),
    "medium": (11.6, 12.0),
    "large": (11.0, 11.5),
}
"""Limits of a clipping accelerometer, m/s^2; the higher, the less there is to clip."""
NAMELESS: dict[str, tuple[float, float, float]] = {
    "dynamic_pressure": (0.12, 0.12, 0.1),
    "roll_rate": (0.3, 0.3, 0.3),
    "swing": (0.3, 0.3, 0.3),
    "climb_rate": (0.15, 0.15, 0.15),
}
"""Terms outside the catalogue and their sizes, per unit of the signal."""


@dataclass(frozen=True, slots=True)
class Secret:
    """One recording to be made: what is in it is drawn from the seed."""

    seed: int
    vehicle: Vehicle
    kind: Literal["control", "single", "pair", "nameless"]
    names: tuple[str, ...] = ()
    level: Level = "medium"
    curved: bool = False

    @property
    def described(self) -> tuple[str, ...]:
        """Effects that no more than describe what is concealed: an offset that swings wanders."""
        return ("offset_wander",) if self.names == ("swing",) else ()

    @property
    def testable(self) -> bool:
        """Whether the effects are of a size that must be found."""
        return self.kind in ("single", "pair") and self.level != "small"

    def spec(self) -> FlightSpec:
        """The flight with everything drawn."""
        rng = np.random.default_rng([self.seed, 977])
        duration = float(rng.uniform(150.0, 300.0))
        delay = STAMPED_EARLY + float(rng.uniform(*NET_DELAY))
        straight = [n for n in self.names if not (self.curved and n == TemperatureDrift.name)]
        effects = tuple(self._effect(name, rng, duration) for name in straight)
        warming = {
            "temperature_start": float(rng.uniform(5.0, 30.0)),
            "temperature_end": float(rng.uniform(40.0, 55.0)),
            "temperature_time": float(rng.uniform(0.15, 0.4) * duration),
        }
        if self.curved:
            effects = (*effects, self._curve(warming["temperature_start"]))
        imus = tuple(replace(imu, **warming) for imu in random_imus(self.seed))
        if "vibration_rectification" in self.names:
            imus = tuple(replace(imu, vibration=SHAKEN) for imu in imus)
        return FlightSpec(
            vehicle=self.vehicle,
            seed=self.seed,
            duration=duration,
            imus=imus,
            gps=GpsTruth(delay=delay, stamped_early=STAMPED_EARLY),
            effects=effects,
        )

    def _curve(self, cold: float) -> concealed.TemperatureDrift:
        """Each axis off by about what a straight drift makes of it, by any of three powers."""
        rng = np.random.default_rng([self.seed, 978])
        units, reach = (
            UNITS[TemperatureDrift.name][self.vehicle],
            TemperatureDrift().reference - cold,
        )
        powers = []
        for unit in units.values():
            shares = rng.dirichlet((1.0, 1.0, 1.0)) * rng.choice([-1.0, 1.0], 3)
            most = unit * float(rng.uniform(*LEVELS[self.level]))
            powers.append(most * shares / max(reach, HALF_WARMED_K) ** np.arange(3))
        (x, y, z), square, cube = np.array(powers).T.tolist()
        return TemperatureDrift(x=x, y=y, z=z, square=tuple(square), cube=tuple(cube))

    def _effect(self, name: str, rng: Rng, duration: float) -> concealed.Effect:
        if self.kind == "nameless":
            signs = rng.choice([-1.0, 1.0], 3)
            x, y, z = (float(s * v) for s, v in zip(signs, NAMELESS[name], strict=True))
            return concealed.Nameless(term=name, x=x, y=y, z=z)
        if name == "rotor_drag":
            return concealed.RotorDrag(x=0.3, y=0.3)
        units = UNITS[name][self.vehicle]
        if name == "saturation":
            return concealed.Saturation(limit=float(rng.uniform(*RAILS[self.level])))
        sizes = _sizes(rng, units, self.level, name)
        if name == "bias_step":
            sizes["time"] = float(rng.uniform(0.3, 0.7) * duration)
        if name == "gps_fault":
            sizes["start"] = float(rng.uniform(0.3, 0.6) * duration)
            sizes["end"] = sizes["start"] + float(rng.uniform(8.0, 25.0))
        return CONCEALED[name](**sizes)


def _sizes(rng: Rng, units: Mapping[str, float], level: Level, name: str) -> dict[str, float]:
    """Every unknown by its own unit and sign; now and then only one of several."""
    keys = list(units)
    if len(keys) > 1 and rng.random() < 0.3:
        keys = [keys[int(rng.integers(len(keys)))]]
    out = {}
    for key in keys:
        size = units[key] * float(rng.uniform(*LEVELS[level]))
        sign = 1.0 if CONCEALED[name].positive else float(rng.choice([-1.0, 1.0]))
        out[key] = sign * min(size, CONCEALED[name].most)
    return out


@dataclass(frozen=True, slots=True)
class Challenge:
    """How many recordings of each kind; the whole of it is past 200."""

    first: int
    controls: int = 44
    pairs: int = 40
    nameless: int = 16
    levels: tuple[Level, ...] = ("small", "medium", "large")
    vehicles: tuple[Vehicle, ...] = field(default=("copter", "plane"))

    def secrets(self) -> list[Secret]:
        """All of them, shuffled: any part of the list is a fair sample."""
        out = []
        for i, (kind, vehicle, names, level) in enumerate(self._kinds()):
            out.append(Secret(self.first + i, vehicle, kind, names, level))
        rng = np.random.default_rng([self.first, 5])
        return [out[i] for i in rng.permutation(len(out))]

    def _kinds(self) -> Iterator[tuple[Any, Vehicle, tuple[str, ...], Level]]:
        for i in range(self.controls):
            yield "control", self.vehicles[i % 2], ("rotor_drag",) if i % 11 == 10 else (), "medium"
        for name, units in UNITS.items():
            for vehicle in self.vehicles:
                if vehicle in units:
                    for level in self.levels:
                        yield "single", vehicle, (name,), level
        rng = np.random.default_rng([self.first, 6])
        for i in range(self.pairs):
            vehicle = self.vehicles[i % 2]
            able = [n for n in UNITS if vehicle in UNITS[n] and not CONCEALED[n].alone]
            couples = [p for p in combinations(able, 2) if not _alike(*p)]
            yield "pair", vehicle, couples[int(rng.integers(len(couples)))], "large"
        for i in range(self.nameless):
            names = list(NAMELESS)
            yield (
                "nameless",
                self.vehicles[(i // len(names)) % 2],
                (names[i % len(names)],),
                "large",
            )


@dataclass(frozen=True, slots=True)
class Harder:
    """What :class:`Challenge` has not got, so many recordings of each kind."""

    first: int
    curves: int = 12
    curved_pairs: int = 16
    clipped_pairs: int = 16
    clipped_curves: int = 4
    levels: tuple[Level, ...] = ("small", "medium", "large")
    vehicles: tuple[Vehicle, ...] = field(default=("copter", "plane"))

    def secrets(self) -> list[Secret]:
        """All of them, shuffled: any part of the list is a fair sample."""
        rng = np.random.default_rng([self.first, 7])
        curve, clips = TemperatureDrift.name, concealed.Saturation.name
        counts = (self.curves, self.curved_pairs, self.clipped_pairs, self.clipped_curves)
        kinds = ((curve,), (curve, ""), (clips, ""), (clips, curve))
        out = []
        for names, count in zip(kinds, counts, strict=True):
            for i in range(count):
                vehicle = self.vehicles[i % len(self.vehicles)]
                level = self.levels[(i // len(self.vehicles)) % len(self.levels)]
                able = [n for n in UNITS if vehicle in UNITS[n] and not CONCEALED[n].alone]
                beside = [n for n in able if n != curve and not _alike(n, names[0])]
                other = beside[int(rng.integers(len(beside)))]
                out.append(
                    Secret(
                        self.first + len(out),
                        vehicle,
                        "single" if len(names) == 1 else "pair",
                        tuple(n or other for n in names),
                        level,
                        curve in names,
                    )
                )
        return [out[i] for i in rng.permutation(len(out))]


def _alike(one: str, other: str) -> bool:
    """Two effects of one kind at once are one effect of that kind to any single flight."""
    kind = CONCEALED[one].kind
    return bool(kind) and kind == CONCEALED[other].kind
