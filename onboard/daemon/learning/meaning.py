"""What the messages of a board mean: the parameters in force, carried from estimator to estimator.

An estimator knows the parameters that it was told (:attr:`Calibrator.parameters`), and on the
learner's thread it is the only one that does.  When another estimator takes its place, or flies
beside it to judge a push, what matters is handed on here.
"""

from __future__ import annotations

from collections.abc import Mapping

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Six
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ParameterValue
from onboard.core.maths.accelerometer import parameter_names
from onboard.mavlink.parameter_messages import to_float32

CARRIED = ("INS", "AHRS", "GPS", "ARMING")
"""Beginnings of the names that change what an estimator makes of the messages."""
IMUS = range(1, 6)


def matters(name: str) -> bool:
    """Whether a parameter changes what an estimator makes of the messages."""
    return name.startswith(CARRIED)


def carried(parameters: ParametersInForce) -> dict[str, float]:
    """What the next estimator has to be told, by name."""
    return {name: value for name, value in parameters.values.items() if matters(name)}


def hand_on(values: Mapping[str, float], calibrator: Calibrator) -> None:
    """Tell an estimator the parameters in force, before its first sample."""
    for name, value in values.items():
        calibrator.feed(ParameterValue(name, value))


def in_force(values: Mapping[str, float], imu: int) -> Six | None:
    """The six as they were reported, rounded to float32; None if one was not.

    Args:
        values: parameters by name.
        imu: number of the accelerometer, from 1.
    """
    six = [values.get(name) for name in parameter_names(imu).six]
    if any(value is None for value in six):
        return None
    a, b, c, d, e, f = (to_float32(value) for value in six if value is not None)
    return a, b, c, d, e, f


def all_in_force(values: Mapping[str, float]) -> dict[int, Six | None]:
    """:func:`in_force` of every accelerometer that ArduPilot has names for."""
    return {imu: in_force(values, imu) for imu in IMUS}
