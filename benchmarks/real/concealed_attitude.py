"""Errors of the recorded attitude; and rotations, which are this package's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from benchmarks.real.concealed_kind import About, Array, Kind, Lay
from onboard.core.inputs.samples import AttitudeSample, Sample


def _each(change: Callable[[AttitudeSample], AttitudeSample]) -> Lay:
    """Lay a change into every recorded attitude."""

    def lay(samples: Sequence[Sample], _: About) -> Iterator[Sample]:
        return (change(s) if isinstance(s, AttitudeSample) else s for s in samples)

    return lay


def heading(by: float) -> Kind:
    """The recorded yaw is ``by`` rad too large."""
    return Kind(
        f"heading {np.degrees(by):+.0f} deg",
        ("heading_error",),
        _each(lambda s: replace(s, yaw=_wrapped(s.yaw + by))),
        lambda before, _: {"heading": before["heading"] + by},
    )


def tilted(by: float) -> Kind:
    """The recorded attitude is turned about the body's x axis by ``by`` rad too much."""
    return Kind(
        f"attitude tilted {np.degrees(by):+.0f} deg",
        ("mount_tilt",),
        _each(lambda s: _turned_attitude(s, about_x(by))),
        lambda before, _: {"tilt_roll": before["tilt_roll"] + by},
    )


def attitude_late(by: float) -> Kind:
    """The recorded attitude is stamped ``by`` seconds later."""
    return Kind(
        f"attitude later {1e3 * by:.0f} ms",
        ("imu_delay",),
        _each(lambda s: replace(s, t=s.t + by)),
        lambda before, _: {"imu_delay": before["imu_delay"] + by},
    )


def _turned_attitude(s: AttitudeSample, by: Array) -> AttitudeSample:
    R = from_angles(s.roll, s.pitch, s.yaw) @ by
    return replace(
        s,
        roll=float(np.arctan2(R[2, 1], R[2, 2])),
        pitch=float(-np.arcsin(np.clip(R[2, 0], -1.0, 1.0))),
        yaw=float(np.arctan2(R[1, 0], R[0, 0])),
    )


def about_x(angle: float) -> Array:
    """(3, 3) turn about x."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]])


def from_angles(roll: float, pitch: float, yaw: float) -> Array:
    """(3, 3) body axes to NED of the usual angles, rad: yaw, then pitch, then roll."""
    (cr, sr), (cp, sp), (cy, sy) = ((np.cos(a), np.sin(a)) for a in (roll, pitch, yaw))
    return np.array(
        [
            [cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy],
            [cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy],
            [-sp, sr * cp, cr * cp],
        ]
    )


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))
