"""Faults of a GPS receiver, laid over the samples of any flight.

Each fault takes the samples and the times between which the vehicle moves, and gives samples that
are the same but for the receiver's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.inputs.samples import GpsFix, Sample

METRES_PER_RADIAN = 6.371e6

Change = Callable[[GpsFix, float], GpsFix | None]
"""A fix and the share of the moving flight that has passed, to what the receiver says instead."""


@dataclass(frozen=True, slots=True)
class Fault:
    """What goes wrong, and by which names the estimator may account for it.

    Attributes:
        name: for people.
        change: applied to each fix; None drops it.
        names: keys of ``Calibration.rejected`` or reasons of a closed window, any of which says
            what happened.
    """

    name: str
    change: Callable[[GpsFix, float, float], GpsFix | None]
    names: frozenset[str]

    def laid_over(self, samples: list[Sample], span: tuple[float, float]) -> Iterator[Sample]:
        """The samples with the fault.

        Args:
            samples: in order of arrival.
            span: first and last moment of motion, s.
        """
        begin, end = span
        for sample in samples:
            if not isinstance(sample, GpsFix):
                yield sample
                continue
            fix = self.change(sample, sample.t - begin, end - begin)
            if fix is not None:
                yield fix


def _step(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """1.5 m/s for 25 s, to the north-east; positions follow."""
    since = elapsed - 0.4 * length
    if since < 0.0:
        return fix
    speed = 1.5 / math.sqrt(2.0)
    gone = speed * min(since, 25.0) / METRES_PER_RADIAN
    shifted = replace(
        fix,
        latitude=fix.latitude + gone,
        longitude=fix.longitude + gone / math.cos(fix.latitude),
    )
    if since >= 25.0:
        return shifted
    return replace(shifted, v_n=fix.v_n + speed, v_e=fix.v_e + speed)


def _ramp(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """Grows to 1.5 m/s within 5 s and stays for 20 s, positions as they were."""
    since = elapsed - 0.4 * length
    if not 0.0 <= since < 25.0:
        return fix
    return replace(fix, v_e=fix.v_e + 1.5 * min(1.0, since / 5.0))


def _glitch(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """50 m/s for 3 s, twice."""
    for share in (0.35, 0.7):
        if 0.0 <= elapsed - share * length < 3.0:
            return replace(fix, v_n=50.0, v_e=0.0)
    return fix


def _outliers(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """Every seventh second one fix is off by 2 m/s."""
    if 0.0 < elapsed < length and elapsed % 7.0 < 0.11:
        return replace(fix, v_n=fix.v_n - 2.0)
    return fix


def _height(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """30 m too high for 20 s."""
    if 0.0 <= elapsed - 0.5 * length < 20.0:
        return replace(fix, altitude=fix.altitude + 30.0)
    return fix


def _noise(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """White noise of up to 2.5 m/s on the velocity for 25 s: by chance some fixes are right."""
    if not 0.0 <= elapsed - 0.45 * length < 25.0:
        return fix
    north, east = np.random.default_rng(round(1e3 * elapsed)).uniform(-2.5, 2.5, 2)
    return replace(fix, v_n=fix.v_n + float(north), v_e=fix.v_e + float(east))


def _gaps(fix: GpsFix, elapsed: float, length: float) -> GpsFix | None:
    """Nothing for 5, 20 and 40 s."""
    for share, seconds in ((0.2, 5.0), (0.4, 20.0), (0.65, 40.0)):
        if 0.0 <= elapsed - share * length < seconds:
            return None
    return fix


def _no_fix(fix: GpsFix, elapsed: float, length: float) -> GpsFix:
    """Lost for good: the receiver goes on, and says that it has no fix."""
    return replace(fix, fix_type=1) if elapsed > 0.6 * length else fix


def _silent(fix: GpsFix, elapsed: float, length: float) -> GpsFix | None:
    """Lost for good: the receiver says nothing any more."""
    return None if elapsed > 0.6 * length else fix


FAULTS = (
    Fault("velocity step of 1.5 m/s for 25 s", _step, frozenset({"innovation", "gps_glitch"})),
    Fault("the same, creeping in over 5 s", _ramp, frozenset({"innovation", "gps_glitch"})),
    Fault("50 m/s for 3 s, twice", _glitch, frozenset({"innovation", "gps_glitch"})),
    Fault("every seventh second 2 m/s off", _outliers, frozenset({"innovation", "gps_glitch"})),
    Fault("30 m too high for 20 s", _height, frozenset({"height_innovation", "gps_glitch"})),
    Fault("noise of 2.5 m/s for 25 s", _noise, frozenset({"innovation", "gps_glitch"})),
    Fault("gaps of 5, 20 and 40 s", _gaps, frozenset({"gps_gap"})),
    Fault("lost for good, fix type 1", _no_fix, frozenset({"no_fix"})),
    Fault("lost for good, silent", _silent, frozenset({"gps_gap", "stale"})),
)
