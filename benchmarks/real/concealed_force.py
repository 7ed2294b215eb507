"""Errors of an accelerometer, put into what it reads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.real.concealed_attitude import about_x
from benchmarks.real.concealed_kind import LETTERS, About, Array, Kind, Numbers, added, unit
from onboard.core.inputs.samples import ImuSample, Sample

REFERENCE_DEGC = 35.0
"""ArduPilot's: where a temperature law is nothing."""
WARMS_BY_K = 3.0
"""Less warming than this in flight shows no temperature law."""


def _of_force(
    samples: Iterable[Sample], imu: int, change: Callable[[ImuSample, Array], Array]
) -> Iterator[Sample]:
    """Change what one accelerometer reads, body axes, as corrected by the autopilot, m/s^2."""
    for s in samples:
        if isinstance(s, ImuSample) and s.imu == imu:
            x, y, z = change(s, np.array(s.f_b)).tolist()
            yield replace(s, f_b=(x, y, z))
        else:
            yield s


def offset(axis: int, size: float) -> Kind:
    """One axis reads ``size``, m/s^2, too much."""

    def truth(before: Numbers, ground: About) -> dict[str, float]:
        name = f"{LETTERS[axis]} offset"
        return {name: before[name] + size / float(ground.in_force[axis])}

    return Kind(
        f"offset {LETTERS[axis]} {size:+g}",
        (),
        lambda s, g: _of_force(s, g.imu, lambda _, f: f + unit(axis, size)),
        truth,
    )


def scale(axis: int, factor: float) -> Kind:
    """One axis reads the force divided by ``factor``: its scale is so much larger."""

    def truth(before: Numbers, ground: About) -> dict[str, float]:
        a, old = LETTERS[axis], float(ground.in_force[3 + axis])
        return {
            f"{a} scale": before[f"{a} scale"] * factor,
            f"{a} offset": old + (before[f"{a} offset"] - old) / factor,
        }

    by = np.ones(3)
    by[axis] = 1.0 / factor
    return Kind(
        f"scale {LETTERS[axis]} {factor:g}",
        (),
        lambda s, g: _of_force(s, g.imu, lambda _, f: f * by),
        truth,
    )


def step(axis: int, size: float) -> Kind:
    """From half of the flight on an axis reads ``size``, m/s^2, too much."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        return _of_force(
            samples,
            ground.imu,
            lambda s, f: f + unit(axis, size) if s.t >= ground.moment else f,
        )

    key = LETTERS[axis]
    return Kind(f"step {key} {size:+g}", ("bias_step",), lay, added("bias_step", key, size))


def ramp(axis: int, rate: float) -> Kind:
    """An axis reads more and more too much, m/s^3."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        return _of_force(
            samples, ground.imu, lambda s, f: f + unit(axis, rate * (s.t - ground.start))
        )

    key = LETTERS[axis]
    return Kind(f"ramp {key} {rate:+g}/s", ("bias_ramp",), lay, added("bias_ramp", key, rate))


def warmed(axis: int, slope: float) -> Kind:
    """An axis reads too much by ``slope``, m/s^2/K, about 35 degC."""

    def lay(samples: Sequence[Sample], ground: About) -> Iterator[Sample]:
        def change(s: ImuSample, f: Array) -> Array:
            warm = REFERENCE_DEGC if s.temperature is None else s.temperature
            return f + unit(axis, slope * (warm - REFERENCE_DEGC))

        return _of_force(samples, ground.imu, change)

    key = LETTERS[axis]
    return Kind(
        f"temperature {key} {slope:+g}/K",
        ("temperature_drift",),
        lay,
        added("temperature_drift", key, slope),
        lambda ground: ground.warms_by >= WARMS_BY_K,
    )


def crossed(axis: int, other: int, share: float) -> Kind:
    """An axis reads a share of another one too much."""

    def change(_: ImuSample, f: Array) -> Array:
        return f + unit(axis, share * float(f[other]))

    key = LETTERS[axis] + LETTERS[other]
    return Kind(
        f"cross {key} {share:+g}",
        ("cross_axis",),
        lambda s, g: _of_force(s, g.imu, change),
        added("cross_axis", key, share),
    )


def turned(angle: float) -> Kind:
    """The accelerometer, not the gyroscope, is turned about x by ``angle``, rad."""
    R = about_x(angle)
    return Kind(
        f"accelerometer turned {np.degrees(angle):+.0f} deg",
        ("mount_tilt",),
        lambda s, g: _of_force(s, g.imu, lambda _, f: R.T @ f),
        added("mount_tilt", "roll", -angle),
    )
