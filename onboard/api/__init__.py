"""The Python API: what ``import onboard`` offers, for notebooks and programs.

``calibrate``, ``explain`` and ``match`` take what the commands of the same names take (the first is
``onboard replay``) and :class:`Arrays`, and give small frozen results: numbers in numpy arrays,
``rows()`` for tables, ``plot()``, ``report(path)``, and the document of the command, ``to_json()``.
"""

from onboard.api.accelerometer import Accelerometer, Effect
from onboard.api.arrays import Arrays
from onboard.api.calibration import CalibrationResult, calibrate
from onboard.api.explanation import ExplanationResult, explain
from onboard.api.matching import MatchResult, match
from onboard.api.streams import Attitude, Inertial, Told, Velocity
from onboard.core.physics.finding import Quantity
from onboard.errors import OnboardError

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
