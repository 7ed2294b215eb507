"""Tables as laboratories have them: east-north-up, forward-left-up, quaternions, empty cells."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from onboard.core.inputs.samples import (
    AttitudeSample,
    Battery,
    ImuSample,
    Outputs,
    Sample,
)
from onboard.core.maths.frames import quaternion_from_rotation, rotation_from_euler

COLUMNS = (
    *("t_ms", "qw", "qx", "qy", "qz", "ax", "ay", "az", "gx", "gy", "gz"),
    *("ve", "vn", "vu", "e", "n", "u", "m1", "m2", "m3", "m4", "mv"),
)
MAP = """\
vehicle = "copter"
world = "enu"
body = "flu"

[time]
column = "t_ms"
unit = "ms"

[attitude]
quaternion = ["qw", "qx", "qy", "qz"]

[force]
columns = ["ax", "ay", "az"]
unit = "g"
low_pass = 20

[rates]
columns = ["gx", "gy", "gz"]
unit = "deg/s"
low_pass = 20

[velocity]
columns = ["ve", "vn", "vu"]

[position]
columns = ["e", "n", "u"]
"""
MOTORS = """
[motors]
columns = ["m1", "m2", "m3", "m4"]
range = [1150, 1950]

[voltage]
column = "mv"
unit = "mV"
"""
ENU = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
FLU = np.diag([1.0, -1.0, -1.0])
STANDARD_GRAVITY = 9.80665


def cells(sample: Sample) -> dict[str, float]:
    """One sample as cells of a row."""
    if isinstance(sample, AttitudeSample):
        R = rotation_from_euler(sample.roll, sample.pitch, sample.yaw)
        return dict(zip(("qw", "qx", "qy", "qz"), quaternion_from_rotation(ENU @ R @ FLU),
                        strict=True))  # fmt: skip
    if isinstance(sample, ImuSample):
        f = FLU @ np.array(sample.f_b) / STANDARD_GRAVITY
        out = dict(zip(("ax", "ay", "az"), f, strict=True))
        if sample.w_b is not None:
            w = np.degrees(FLU @ np.array(sample.w_b))
            out |= dict(zip(("gx", "gy", "gz"), w, strict=True))
        return out
    if isinstance(sample, Outputs):
        return dict(zip(("m1", "m2", "m3", "m4"), sample.values, strict=False))
    if isinstance(sample, Battery):
        return {"mv": 1e3 * sample.voltage}
    return {}


def moving(
    t: float, v_n: tuple[float, ...], p_n: tuple[float, ...]
) -> tuple[float, dict[str, float]]:
    """Velocity and place at a time, from north-east-down."""
    names = ("ve", "vn", "vu", "e", "n", "u")
    return t, dict(zip(names, (*(ENU @ np.array(v_n)), *(ENU @ np.array(p_n))), strict=True))


def write_table(rows: Iterable[tuple[float, dict[str, float]]], path: Path) -> None:
    """Times (s) and cells as rows, with empty cells for what a row is not about."""
    lines = [",".join(COLUMNS)]
    for t, its in rows:
        if its:
            every = its | {"t_ms": 1e3 * t}
            lines.append(",".join(f"{every[c]:.9g}" if c in every else "" for c in COLUMNS))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
