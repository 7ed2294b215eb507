"""A battery that gives way as a simulator's would: its capacity and resistance.

The resting voltage of a lithium cell by charge is ArduPilot's own table (facts of
libraries/SITL/SIM_Battery in ArduPilot 4.7-dev), scaled to the full pack.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onboard.core.maths.arrays import Array

CELL_V = np.array(
    [
        *(3.091, 3.165, 3.218, 3.296, 3.379, 3.462, 3.503, 3.543, 3.588, 3.636, 3.679, 3.715),
        *(3.742, 3.783, 3.801, 3.833, 3.854, 3.887, 3.908, 3.943, 3.987, 4.039, 4.071, 4.085),
        *(4.112, 4.173),
    ]
)
CHARGE_PERCENT = np.array(
    [
        *(3.85, 7.69, 11.54, 15.38, 19.23, 23.08, 26.92, 30.77, 34.62, 38.46, 42.31, 46.15),
        *(50.0, 53.85, 57.69, 61.54, 65.38, 69.23, 73.08, 76.92, 80.77, 84.62, 88.46, 92.31),
        *(96.15, 100.0),
    ]
)
CAPACITIES_AH = np.geomspace(0.3, 60.0, 120)
LONGEST_STEP_S = 5.0


@dataclass(frozen=True, slots=True)
class BatteryFit:
    """Capacity (Ah) and resistance (ohm), and the RMS that they leave of the voltage, V."""

    capacity: float
    resistance: float
    left: float


def fitted_battery(t: Array, volts: Array, amperes: Array, full: float) -> BatteryFit | None:
    """The likeliest simulated battery that was full at the first sample; None without a current.

    Args:
        t: (n,) s.
        volts: (n,) V.
        amperes: (n,) A.
        full: resting voltage of the full pack, V.
    """
    known = np.isfinite(volts) & np.isfinite(amperes)
    if np.count_nonzero(known) < 10 or float(np.std(amperes[known])) < 0.1:
        return None
    t, volts, amperes = t[known], volts[known], amperes[known]
    step = np.clip(np.diff(t, prepend=t[0]), 0.0, LONGEST_STEP_S)
    used = np.cumsum(amperes * step) / 3600.0
    best: BatteryFit | None = None
    for capacity in CAPACITIES_AH:
        left = 100.0 * (1.0 - used / capacity)
        if left[-1] < CHARGE_PERCENT[0]:
            continue
        rest = np.interp(left, CHARGE_PERCENT, CELL_V) / CELL_V[-1] * full
        fall = rest - volts
        resistance = max(float(fall @ amperes / (amperes @ amperes)), 0.0)
        rms = float(np.sqrt(np.mean((fall - resistance * amperes) ** 2)))
        if best is None or rms < best.left:
            best = BatteryFit(float(capacity), resistance, rms)
    return best
