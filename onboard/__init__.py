"""In-flight calibration of the accelerometers of MAVLink autopilots.

Vocabulary, used in every module and not explained again:

Frames
    ``b``  body, x forward, y right, z down (FRD); what MAVLink messages carry
    ``s``  sensor, the accelerometer's own axes: ``x_b = R_bs x_s`` (AHRS_ORIENTATION)
    ``n``  navigation, local north, east, down (NED)

Symbols
    ``f``    specific force (what an accelerometer measures), m/s^2
    ``w``    angular rate, rad/s
    ``v``    velocity over ground, m/s
    ``R_nb`` rotation that takes body components to NED, ``R = Rz(yaw) Ry(pitch) Rx(roll)``
    ``t``    time on the autopilot's boot clock, s

Calibration
    ArduPilot's convention, in the sensor frame: ``f = scale * (raw - offset)``, offset in
    m/s^2.  Estimates, sums and sigmas are those of this ``scale`` and ``offset``.

Units are SI and radians everywhere inside; temperatures are degrees Celsius; other
units exist only where a message or a person needs them and carry it in their name
(``delay_ms``).  Arrays of three are ordered x, y, z (or north, east, down).

Notebooks and programs have ``onboard.calibrate``, ``onboard.explain`` and ``onboard.match``
(:mod:`onboard.api`, docs/python.md).  They are looked up when they are first asked for: the service
and the commands import this package too, and need none of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from onboard.api import (
        Accelerometer,
        Arrays,
        Attitude,
        CalibrationResult,
        Effect,
        ExplanationResult,
        Inertial,
        MatchResult,
        OnboardError,
        Quantity,
        Told,
        Velocity,
        calibrate,
        explain,
        match,
    )

__all__ = [
    "Accelerometer",
    "Arrays",
    "Attitude",
    "CalibrationResult",
    "Effect",
    "ExplanationResult",
    "Inertial",
    "MatchResult",
    "OnboardError",
    "Quantity",
    "Told",
    "Velocity",
    "calibrate",
    "explain",
    "match",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module  # noqa: PLC0415 - whoever asks for a name pays for it

    found: object = getattr(import_module("onboard.api"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
