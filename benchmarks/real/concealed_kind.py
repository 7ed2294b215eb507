"""One error of one size to be put into a recording, and what has to be known of the flight."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from benchmarks.real.concealed_response import at_once
from onboard.core.inputs.samples import FIX_3D, GpsFix, ImuSample, ParameterValue, Sample

Array = NDArray[np.float64]
X, Y, Z = 0, 1, 2
LETTERS = "xyz"
MOVING_M_S = 1.5
"""Faster than this a vehicle flies."""


@dataclass(frozen=True, slots=True)
class About:
    """What a flight without the error is known to be like.

    Attributes:
        imu: accelerometer into which errors are put.
        in_force: (6,) its scale and offset as the autopilot applies them.
        start: of its samples, s, boot clock.
        moment: half of the moving flight, s, boot clock.
        warms_by: range of its temperature in moving flight, K; 0 where it has none.
        fix_step: between fixes, s.
        late: of the GPS against its stamps, s, as the untouched flight says.
        response: (2, K) moments about that, s, and how the receiver weighs them, likewise.
        heading: (2, K) times, s, boot clock, and the vehicle's heading there, rad, likewise;
            without any it is as recorded.
    """

    imu: int
    in_force: Array
    start: float
    moment: float
    warms_by: float
    fix_step: float
    late: float = 0.0
    response: Array = field(default_factory=at_once)
    heading: Array = field(default_factory=lambda: np.zeros((2, 0)))


Lay = Callable[[Sequence[Sample], About], Iterable[Sample]]
Numbers = Mapping[str, float]
Truth = Callable[[Numbers, About], dict[str, float]]
"""From what the untouched flight gave to what the other one should give, those that change."""


@dataclass(frozen=True, slots=True)
class Kind:
    """One error of one size.

    Attributes:
        name: with its size.
        wanted: names of effects that may be said of it, the first must; none: the six take it.
        lay: puts it into samples.
        truth: what it should change.
        applies: whether the flight can have it.
    """

    name: str
    wanted: tuple[str, ...]
    lay: Lay
    truth: Truth
    applies: Callable[[About], bool] = lambda _: True


def about(samples: Sequence[Sample], imu: int) -> About:
    """What the samples say of themselves.

    Raises:
        ValueError: no inertial samples, no moving flight, or a board that is not along the body.
    """
    parameters: dict[str, float] = {}
    for s in samples:
        if isinstance(s, ParameterValue):
            parameters.setdefault(s.name, s.value)
    if parameters.get("AHRS_ORIENTATION", 0.0) != 0.0:
        raise ValueError("the board is turned in the body")
    rows = [s for s in samples if isinstance(s, ImuSample) and s.imu == imu]
    fixes = [s for s in samples if isinstance(s, GpsFix) and s.fix_type >= FIX_3D]
    moving = [f.t for f in fixes if np.hypot(f.v_n, f.v_e) > MOVING_M_S]
    if not rows or len(moving) < 2:
        raise ValueError("no moving flight")
    degrees = [
        s.temperature for s in rows if s.temperature is not None and moving[0] <= s.t <= moving[-1]
    ]
    prefix = "INS_ACC" if imu == 1 else f"INS_ACC{imu}"
    six = [parameters.get(f"{prefix}SCAL_{a}") or 1.0 for a in "XYZ"]
    six += [parameters.get(f"{prefix}OFFS_{a}", 0.0) for a in "XYZ"]
    return About(
        imu,
        np.array(six),
        rows[0].t,
        0.5 * (moving[0] + moving[-1]),
        max(degrees) - min(degrees) if degrees else 0.0,
        float(np.median(np.diff([f.t for f in fixes]))),
    )


def unit(axis: int, size: float) -> Array:
    """(3,) along one axis."""
    out = np.zeros(3)
    out[axis] = size
    return out


def added(name: str, key: str, size: float) -> Truth:
    """One unknown of an effect is larger by ``size``: nothing counts as zero."""
    number = f"{name}.{key}"
    return lambda before, _: {number: before.get(number, 0.0) + size}
