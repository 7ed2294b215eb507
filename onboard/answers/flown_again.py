"""What the simulator makes of a recording that it flies again with the settings found.

The same velocity and heading, once by the nominal airframe in still air and once by what the match
handed back: the recorded force and tilt are compared side by side, and the second flight is matched
like the first.  Nothing here flies; the command line does.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from onboard.answers.match import SAME, Match
from onboard.answers.sensor_level import SIMULATED_PERIOD_S
from onboard.core.inputs.samples import FIX_3D, AttitudeSample, GpsFix, ImuSample
from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.wind_profile import LOWEST_M, TOP_M
from onboard.core.vehicle.limits import APART
from onboard.core.vehicle.records import AxisMismatch
from onboard.errors import RecordingError
from onboard.recordings.opening import open_recording

STEP_S: Final = SIMULATED_PERIOD_S
"""What is compared are means over so long, s: the simulator's receiver says no more of the motion
between two fixes [data sheet]."""
FINE: Final = 10
"""Steps of the grid in such a mean: 0.02 s of turning at 100 deg/s are a third of a typical
difference of tilt [tuned]."""
LEAST_OVERLAP: Final = 0.6
"""Share of the shorter flight that must lie beside the other: short of what it flies, standing
before one flight beside standing after the other would fit best [tuned]."""
MOVING_M_S: Final = 1.0
"""Speed from which a step counts as motion, m/s: three times what a receiver may say of a vehicle
that stands [data sheet]."""
FLOORS = {"wind": 0.15, "thrust_tilt": 0.005, "motor_lag": 0.01, "wind_profile": 0.05}
"""Differences that do not matter, in the unit of the effect's unknowns [use]."""
AIR = ("wind", "wind_profile", "turbulence")
BUILT_IN: Final = "built-in"
ARDUPILOT: Final = "ArduPilot"
Part: TypeAlias = tuple[float, float]
"""From when to when, s on the clock of a recording."""


@dataclass(frozen=True, slots=True)
class Twice:
    """One unknown as the recording has it, and as the flight of the simulator has it.

    ``again`` is NaN where that flight does not tell it.
    """

    real: float
    again: float
    sigma: float
    unit: str
    agrees: bool


@dataclass(frozen=True, slots=True)
class FlownAgain:
    """The second flight beside the first.

    Attributes:
        numbers: of the effects that were found, by ``effect.number``.
        mismatch: RMS between the recording and the simulator's flight, by the nominal airframe in
            still air and by what was handed back: ``x``, ``y``, ``z`` of the recorded force, m/s^2,
            and ``tilt``, degrees.
        left: effects of the airframe that the second flight has and the first had not, or not
            of this size.
        simulator: which one flew.
        untold: why the second flight tells nothing; empty where it does.
    """

    numbers: Mapping[str, Twice]
    mismatch: Mapping[str, AxisMismatch]
    left: tuple[str, ...]
    simulator: str = BUILT_IN
    untold: str = ""

    @property
    def agrees(self) -> bool:
        """Whether the simulator flies like the recording: it says so, and of every number."""
        return not self.untold and all(n.agrees for n in self.numbers.values())

    @property
    def sentence(self) -> str:
        """That for people, without its full stop."""
        if self.untold:
            return f"the {self.simulator} simulator could not fly it as it was: {self.untold}"
        said = "flies like the recording" if self.agrees else "does not fly like the recording yet"
        return f"the {self.simulator} simulator {said}"


@dataclass(frozen=True, slots=True)
class Courses:
    """Means over STEP_S, FINE of them in it: v (n, 3) NED, f (n, 3) body, roll and pitch (n, 2).

    ``start`` is the time of the first, s on the recording's clock.
    """

    v_n: Array
    f_b: Array
    tilt: Array
    start: float = 0.0

    def between(self, part: Part | None) -> Courses:
        """What lies in a part of the recording; all of it for None."""
        if part is None:
            return self
        begin, end = (max(round((t - self.start) * FINE / STEP_S), 0) for t in part)
        its = slice(begin, end)
        start = self.start + begin * STEP_S / FINE
        return Courses(self.v_n[its], self.f_b[its], self.tilt[its], start)


def flown_again(
    first: Match,
    second: Match,
    real: str | Path,
    nominal: str | Path,
    found: str | Path,
    *,
    simulator: str = BUILT_IN,
    parts: tuple[Part | None, Part | None] = (None, None),
) -> FlownAgain:
    """The record of a verification.

    Args:
        first: match of the recording.
        second: match of what the simulator recorded, with the frame that was handed back.
        real: the recording.
        nominal: the simulator's recording with the nominal airframe in still air.
        found: the simulator's recording with what was handed back.
        simulator: which one flew.
        parts: of the simulator's two recordings that follow the real one; all of them for None.

    Raises:
        RecordingError: a file that cannot be used, or flights that do not fit together.
    """
    course = courses(real)
    before, after = (
        beside(course, courses(path).between(part))
        for path, part in zip((nominal, found), parts, strict=True)
    )
    numbers = numbers_twice(first, second)
    told = {key.partition(".")[0] for key in numbers}
    apart = {key.partition(".")[0] for key, n in numbers.items() if not n.agrees}
    same = {*AIR, *(told - apart)}
    return FlownAgain(
        numbers,
        {key: AxisMismatch(before[key], after[key]) for key in before},
        tuple(d.name for d in second.vehicle.effects if d.name not in same),
        simulator,
        second.vehicle.note if second.vehicle.series is None else "",
    )


def numbers_twice(first: Match, second: Match) -> dict[str, Twice]:
    """Numbers of the effects that were found, as they are told, from both flights.

    What the second does not tell is not found again.
    """
    out: dict[str, Twice] = {}
    for effect in first.vehicle.effects:
        for name in effect.values:
            key = f"{effect.name}.{name}"
            value, other = first.vehicle.numbers.get(key), second.vehicle.numbers.get(key)
            if value is None:
                continue
            if other is None:
                out[key] = Twice(value.real, math.nan, value.sigma, value.unit, agrees=False)
                continue
            if effect.name == "thrust_scale" and first.vehicle.vehicle == "copter":
                # Of the frame that was handed back, which has the first flight's thrust.
                other = replace(other, real=value.real * other.real, sigma=value.real * other.sigma)
            if effect.name == "wind":
                other = replace(other, real=_at_one_height(first, second) * other.real)
            sigma = math.hypot(value.sigma, other.sigma)
            most = max(APART * sigma, SAME * abs(value.real), FLOORS.get(effect.name, 0.0))
            agrees = abs(value.real - other.real) <= most
            out[key] = Twice(value.real, other.real, sigma, value.unit, agrees)
    return out


def _at_one_height(first: Match, second: Match) -> float:
    """What a wind at the second flight's mean height is to be multiplied by for the first's."""
    one, other = first.vehicle.wind, second.vehicle.wind
    if one is None or other is None or other.profile_exponent is None:
        return 1.0
    heights = (min(max(w.height, LOWEST_M), TOP_M) for w in (one, other))
    ours, theirs = heights
    return float((ours / theirs) ** other.profile_exponent)


def courses(path: str | Path) -> Courses:
    """What a recording says of its motion, on an even grid, as it was recorded.

    Raises:
        RecordingError: a file that cannot be used, or one without motion.
    """
    fixes, imu, attitude = [], [], []
    for s in open_recording(path).samples():
        if isinstance(s, GpsFix) and s.fix_type >= FIX_3D:
            fixes.append((s.t, s.v_n, s.v_e, s.v_d or 0.0))
        elif isinstance(s, ImuSample) and s.imu == 1:
            imu.append((s.t, *s.f_b))
        elif isinstance(s, AttitudeSample):
            attitude.append((s.t, s.roll, s.pitch))
    if min(len(fixes), len(imu), len(attitude)) < 2:
        raise RecordingError(f"{path}: no motion to lay side by side")
    v, f, a = (np.array(rows) for rows in (fixes, imu, attitude))
    start = max(x[0, 0] for x in (v, f, a))
    n = int((min(x[-1, 0] for x in (v, f, a)) - start) / STEP_S) * FINE
    if n < 2 * FINE:
        raise RecordingError(f"{path}: no motion to lay side by side")
    t = start + STEP_S / FINE * np.arange(n)
    return Courses(_means(t, v), _means(t, f), _means(t, a), start)


def _means(t: Array, rows: Array) -> Array:
    """(n - FINE, k) means of straight lines between rows, over the STEP_S that begin at t (n,)."""
    even = np.column_stack([np.interp(t, rows[:, 0], x) for x in rows[:, 1:].T])
    sums = np.cumsum(even, axis=0)
    out: Array = (sums[FINE:] - sums[:-FINE]) / FINE
    return out


def beside(real: Courses, simulated: Courses) -> dict[str, float]:
    """RMS between two flights of one motion while they move: force by axis, m/s^2, tilt, deg.

    Raises:
        RecordingError: they are not of one motion.
    """
    shift = _shift(real, simulated)
    i, j = max(shift, 0), max(-shift, 0)
    n = min(len(real.v_n) - i, len(simulated.v_n) - j)
    one, other = slice(i, i + n), slice(j, j + n)
    moving = np.linalg.norm(real.v_n[one], axis=1) > MOVING_M_S
    if not moving.any():
        raise RecordingError("the flights do not move together")
    force = (real.f_b[one] - simulated.f_b[other])[moving]
    # Accelerometers have offsets of their own, which are not the airframe's.
    tilt = np.degrees(real.tilt[one] - simulated.tilt[other])[moving]
    tilt = (tilt + 180.0) % 360.0 - 180.0
    out = {axis: _rms(force[:, k]) for k, axis in enumerate("xyz")}
    out["tilt"] = math.sqrt(float(np.mean(np.sum(tilt**2, axis=1))))
    return out


def _shift(real: Courses, simulated: Courses) -> int:
    """Steps of the grid that one flight is ahead of the other.

    Found by the velocity, which is anywhere what was flown, and then by the tilt, which no receiver
    makes late.
    """
    a, b = real.v_n[::FINE, :2], simulated.v_n[::FINE, :2]
    least = int(LEAST_OVERLAP * min(len(a), len(b)))
    shifts = range(least - len(b), len(a) - least + 1)
    roughly = FINE * min(shifts, key=lambda s: _apart(a, b, s))
    near = range(roughly - 2 * FINE, roughly + 2 * FINE + 1)
    return min(near, key=lambda s: _apart(real.tilt, simulated.tilt, s))


def _apart(a: Array, b: Array, shift: int) -> float:
    """Mean square of what two flights differ by while they overlap."""
    i, j = max(shift, 0), max(-shift, 0)
    n = min(len(a) - i, len(b) - j)
    return float(np.mean((a[i : i + n] - b[j : j + n]) ** 2)) if n > 0 else math.inf


def _rms(x: Array) -> float:
    return float(np.sqrt(np.mean(x**2)))
