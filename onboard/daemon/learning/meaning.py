"""What the messages of a board mean: the parameters in force, carried from estimator to estimator.

An estimator knows the parameters that it was told (:attr:`Calibrator.parameters`), and on the
learner's thread it is the only one that does.  When another estimator takes its place, or flies
beside it to judge a push, what matters is handed on here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.result import Six
from onboard.core.inputs.parameters import ParametersInForce
from onboard.core.inputs.samples import ParameterValue
from onboard.core.inputs.views import ASKED
from onboard.core.maths.accelerometer import parameter_names
from onboard.mavlink.parameter_messages import to_float32

CARRIED = ("INS", "AHRS", "GPS", "ARMING", "EK3_IMU_MASK", "EK3_PRIMARY", *sorted(ASKED))
"""Beginnings of the names that change what an estimator makes of the messages."""
IMUS = range(1, 6)
CORRECTED = 1.0
"""INS_TCALn_ENABLE where raw values are corrected for temperature before all else."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """What an accelerometer's messages are of, as far as it was reported.

    Attributes:
        six: what the autopilot applies, float32; None if one was not reported.
        device_id: of the sensor.
        corrections: parameters of the correction for temperature that comes before it.
    """

    six: Six | None = None
    device_id: float | None = None
    corrections: Mapping[str, float] = field(default_factory=dict)

    def is_of(self, now: Meaning) -> bool:
        """Whether raw values are of the same sensor, corrected alike, for all that is known."""
        ids = {self.device_id, now.device_id} - {None}
        return len(ids) < 2 and not corrected_otherwise(self.corrections, now.corrections)


def meanings(values: Mapping[str, float]) -> dict[int, Meaning]:
    """That of every accelerometer that ArduPilot has names for."""
    return {
        imu: Meaning(
            in_force(values, imu),
            values.get(parameter_names(imu).device_id),
            corrections(values, imu),
        )
        for imu in IMUS
    }


def corrections(values: Mapping[str, float], imu: int) -> dict[str, float]:
    """Parameters of an accelerometer's correction for temperature, as far as they are reported."""
    its = parameter_names(imu)
    begins = f"{its.correction}ACC", f"{its.correction}ENABLE"
    names = [n for n in values if n == its.reference or n.startswith(begins)]
    return {name: values[name] for name in sorted(names)}


def corrected_otherwise(then: Mapping[str, float], now: Mapping[str, float]) -> list[str]:
    """Names by which a correction for temperature differs; none where there is no correction."""
    on = [
        name
        for told in (then, now)
        for name, value in told.items()
        if name.endswith("_ENABLE") and value == CORRECTED
    ]
    return [n for n in then if n in now and now[n] != then[n]] if on else []


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


def same_sensors(before: Mapping[int, Meaning], now: Mapping[int, Meaning]) -> bool:
    """Whether raw values mean what they meant, and the same is made of them."""
    return before.keys() == now.keys() and all(
        its.six == now[imu].six and its.is_of(now[imu]) for imu, its in before.items()
    )
