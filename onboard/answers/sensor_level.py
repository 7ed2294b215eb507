"""The sensor level in the story of a match: what differs from the sensors that SITL simulates."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import Status
from onboard.core.maths.board_orientation import board_rotation
from onboard.core.physics.finding import Finding
from onboard.core.vehicle.limits import APART, SURE
from onboard.core.vehicle.records import Compared, Difference

SIMULATED_LAG_S: Final = 0.1
"""SIM_GPS1_LAG_MS by default: the nominal simulator's receiver is this late, s [data sheet]."""
DRIVER_LAG_S: Final = 0.012
"""By how much ArduPilot's simulator is later than it is told, s: loops of its receiver, of the
driver and of the log.  It is 7 to 25 ms on a dozen flights of it, and nothing of the built-in one's
[measured]."""
SIMULATED_PERIOD_S: Final = 0.2
"""Its fixes are so far apart, s [data sheet]."""
LAG_FLOOR_S: Final = 0.05
WINDOW_FLOOR_S: Final = 0.15
"""What timing must differ by to be an effect, s (contracts of ``explain``) [use]."""
PER_CENT: Final = 100.0
SCALE_FLOOR: Final = 0.005
OFFSET_FLOOR: Final = 0.02
"""What a scale (1) and an offset (m/s^2) must differ by to be worth a setting [use]."""
TIMING_NAMES = ("gps_latency", "gps_smoothing")


def simulated_window(lag: float) -> float:
    """Averaging span, s, of SITL's receiver: it interpolates between the fixes around the lag.

    A mean of two fixes a period apart with weights a and 1 - a has variance ``T^2 a (1 - a)``, an
    average over a window ``w^2 / 12``.
    """
    share = (lag / SIMULATED_PERIOD_S) % 1.0
    return SIMULATED_PERIOD_S * math.sqrt(12.0 * share * (1.0 - share))


def sensor_differences(
    real: Diagnosis, simulation: Diagnosis | None = None
) -> tuple[Difference, ...]:
    """What the sensors of the recording do that those of the simulation do not.

    Args:
        real: diagnosis of the real recording.
        simulation: of the simulation's; None: SITL with its default settings.
    """
    if real.silent:
        return ()
    out = list(_timing(real, simulation))
    theirs = {} if simulation is None else {e.name: e for e in simulation.effects}
    for effect in real.effects:
        if effect.name in TIMING_NAMES:
            continue
        found = _difference(effect, theirs.pop(effect.name, None))
        if found is not None:
            out.append(found)
    for name, effect in theirs.items():
        if name not in TIMING_NAMES:
            out.append(_only_simulated(effect))
    return tuple(out)


def _timing(real: Diagnosis, simulation: Diagnosis | None) -> Iterable[Difference]:
    lag = real.timing.get("gps_delay_s")
    if lag is None or not math.isfinite(lag.sigma):
        return
    nominal, its_sigma = SIMULATED_LAG_S, 0.0
    if simulation is not None and "gps_delay_s" in simulation.timing:
        told = simulation.timing["gps_delay_s"]
        nominal, its_sigma = told.value, told.sigma
    sigma = math.hypot(lag.sigma, its_sigma)
    if abs(lag.value - nominal) > LAG_FLOOR_S + SURE * sigma:
        value = Compared(nominal, lag.value, sigma, "s")
        yield _with_proof("gps_latency", {"delay": value}, real)
    window = real.timing.get("gps_smoothing_window_s")
    if window is None or not math.isfinite(window.sigma):
        return
    expected = simulated_window(lag.value)
    its_sigma = 0.0
    if simulation is not None and "gps_smoothing_window_s" in simulation.timing:
        told = simulation.timing["gps_smoothing_window_s"]
        # The lag that is handed back changes what the simulator averages over.
        expected, its_sigma = max(expected, told.value), told.sigma
    sigma = math.hypot(window.sigma, its_sigma)
    if window.value - expected > WINDOW_FLOOR_S + SURE * sigma:
        value = Compared(expected, window.value, sigma, "s")
        yield _with_proof("gps_smoothing", {"window": value}, real)


def _with_proof(name: str, values: Mapping[str, Compared], real: Diagnosis) -> Difference:
    found = next((e for e in real.effects if e.name == name), None)
    if found is None:
        return Difference(name, "sensor", values)
    return Difference(
        name,
        "sensor",
        values,
        found.share_of_mismatch,
        found.where,
        tuple(c.name for c in found.confounders),
        found.held_out_before,
        found.held_out_after,
    )


def _difference(real: Finding, simulation: Finding | None) -> Difference | None:
    """One effect of both or of the real one alone; None if they agree."""
    values: dict[str, Compared] = {}
    apart = simulation is None
    for name, q in real.unknowns.items():
        other = None if simulation is None else simulation.unknowns.get(name)
        value, sigma = (0.0, 0.0) if other is None else (other.value, other.sigma)
        both = math.hypot(q.sigma, sigma)
        values[name] = Compared(value, q.value, both, q.unit)
        apart = apart or abs(q.value - value) > APART * both
    if not apart:
        return None
    return Difference(
        real.name,
        "sensor",
        values,
        real.share_of_mismatch,
        real.where,
        tuple(c.name for c in real.confounders),
        real.held_out_before,
        real.held_out_after,
    )


def _only_simulated(effect: Finding) -> Difference:
    values = {n: Compared(q.value, 0.0, q.sigma, q.unit) for n, q in effect.unknowns.items()}
    return Difference(effect.name, "sensor", values)


def calibration_settings(
    real: Diagnosis, parameters: Mapping[str, float]
) -> dict[str, tuple[float, float]]:
    """SIM_ACC1_* and SIM_GYR1_*, each with its sigma: the simulator's sensors err as these do.

    Only what is calibrated and differs surely from what the vehicle has in force.  SITL's sensors
    err in the axes of the body, before SIM_IMU_ORIENT turns them (AP_InertialSensor_SITL): the six
    numbers, of the sensor's axes, are turned; rates are of the body's.

    Args:
        real: of the accelerometer.
        parameters: the autopilot's; AHRS_ORIENTATION says how the sensor's axes lie.
    """
    c = real.calibration
    if c.status is not Status.CALIBRATED or not c.parameters_known:
        return {}
    out: dict[str, tuple[float, float]] = {}
    # The simulator's gyroscope has the axes of its accelerometer.
    sigma = c.sigma_with_its_gyroscope
    R_bs = board_rotation(parameters.get("AHRS_ORIENTATION", 0.0))
    if R_bs is None:
        return {}
    for i, axis in enumerate("XYZ"):
        j = int(np.argmax(np.abs(R_bs[i])))  # the sensor's axis that lies there
        if abs(c.scale[j] - c.in_force_scale[j]) > SCALE_FLOOR + SURE * sigma[j]:
            out[f"SIM_ACC1_SCAL_{axis}"] = (c.scale[j], float(sigma[j]))
        if abs(c.offset[j] - c.in_force_offset[j]) > OFFSET_FLOOR + SURE * sigma[3 + j]:
            out[f"SIM_ACC1_BIAS_{axis}"] = (float(R_bs[i, j]) * c.offset[j], float(sigma[3 + j]))
    for axis, gyro in zip("XYZ", c.gyro_scale, strict=True):
        if abs(gyro.value) > SCALE_FLOOR + SURE * gyro.sigma:
            out[f"SIM_GYR1_SCALE_{axis}"] = (PER_CENT * gyro.value, PER_CENT * gyro.sigma)
    return out
