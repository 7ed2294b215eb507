"""The battery: rest voltage over what is left in it, less current times resistance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sitl.builtin.airframe.frame import Airframe
from sitl.builtin.smoothing import DT, Array

# One cell of a lithium polymer battery at rest: per cent left, V.
_LEFT = (
    0.0, 1.0, 2.0, 3.85, 7.69, 11.54, 15.38, 19.23, 23.08, 26.92, 30.77, 34.62, 38.46, 42.31,
    46.15, 50.0, 53.85, 57.69, 61.54, 65.38, 69.23, 73.08, 76.92, 80.77, 84.62, 88.46, 92.31,
    96.15, 100.0,
)  # fmt: skip
_CELL = (
    0.001, 2.1, 2.977, 3.091, 3.165, 3.218, 3.296, 3.379, 3.462, 3.503, 3.543, 3.588, 3.636,
    3.679, 3.715, 3.742, 3.783, 3.801, 3.833, 3.854, 3.887, 3.908, 3.943, 3.987, 4.039, 4.071,
    4.085, 4.112, 4.173,
)  # fmt: skip
SECONDS_PER_HOUR = 3600.0
ROUNDS = 40


@dataclass(frozen=True, slots=True)
class Discharge:
    """A battery through a flight, (n,) each: V, A, Ah drawn since the start."""

    voltage: Array
    current: Array
    drawn: Array


def rest_voltage(frame: Airframe, drawn: Array) -> Array:
    """(n,) V without load after so many Ah; of an endless battery always the full one's."""
    if frame.battCapacityAh <= 0.0:
        return np.full_like(drawn, frame.maxVoltage)
    left = 100.0 * np.clip(1.0 - drawn / frame.battCapacityAh, 0.0, 1.0)
    out: Array = np.interp(left, _LEFT, _CELL) * (frame.maxVoltage / _CELL[-1])
    return out


def discharge(frame: Airframe, power: Array, drawn: float = 0.0) -> Discharge:
    """Voltage and current under a load of (n,) W at 1 kHz.

    ``V = V_rest(drawn) - I R`` with ``I = P / V``.  An endless battery (``battCapacityAh`` 0)
    keeps its voltage under load too, as in ArduPilot's SITL.

    Args:
        frame: whose battery.
        power: electric, W.
        drawn: Ah before the first sample.
    """
    resistance = frame.refBatRes if frame.battCapacityAh > 0.0 else 0.0
    rest = np.full_like(power, rest_voltage(frame, np.array([drawn]))[0])
    spent = np.full_like(power, drawn)
    for _ in range(ROUNDS):
        # Beyond the most that it can give, the voltage stays at half of the rest voltage.
        root = np.sqrt(np.maximum(rest**2 - 4.0 * resistance * power, 0.0))
        voltage = np.maximum(0.5 * (rest + root), 0.1)
        current = power / voltage
        charge = np.zeros_like(power)
        np.cumsum(0.5 * DT * (current[1:] + current[:-1]), out=charge[1:])
        before, spent = spent, drawn + charge / SECONDS_PER_HOUR
        rest = rest_voltage(frame, spent)
        if np.array_equal(before, spent):
            break
    return Discharge(voltage, current, spent)
