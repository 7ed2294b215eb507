"""What each effect of the catalogue means for a push, and the record of a flight's diagnosis.

Which of these apply to a flight, and what becomes of its calibration, :mod:`onboard.answers.answer`
says.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from onboard.core.estimate.result import Calibration
from onboard.core.physics.finding import Finding

IN_EVERY_MODEL = frozenset(
    {"gps_latency", "gps_smoothing", "imu_delay", "heading_error", "gps_fault"}
)
"""Estimated (or excluded, a receiver's fault) with or without a diagnosis."""
NO_ONE_NUMBER = frozenset({"temperature_drift", "bias_ramp", "bias_step", "saturation"})
"""The six are not the same for all of the flight, or samples are not what was measured."""
GEOMETRY = frozenset(
    {"gps_lever_arm", "cross_axis", "mount_tilt", "heading_by_throttle", "clock_skew", "load_flex"}
)
"""Effects beside which the six keep their meaning: their modelled values may be offered."""
WORDS = {
    "gps_lever_arm": "the GPS antenna is {size:.2g} m away from the IMU and that is not told",
    "cross_axis": "the accelerometer's axes are not square",
    "mount_tilt": "the accelerometer is tilted by {degrees:.2g} deg against the attitude",
    "heading_by_throttle": "the motors pull the compass",
    "temperature_drift": "the offset follows the temperature",
    "bias_ramp": "the offset grew during the flight",
    "bias_step": "the offset jumped during the flight",
    "scale_nonlinearity": "the scale changes with the load",
    "vibration_rectification": "vibration shifts the offset",
    "throttle_coupling": "the throttle shifts the offset",
    "saturation": "the accelerometer hit its limit",
    "clock_skew": "GPS and IMU clocks run at different rates",
    "gravity": "gravity is not the expected",
    "load_flex": "the mount bends under load",
}


HEADLINES = {
    "clean": "Nothing is missing beyond the six numbers and the timing.",
    "explained": "Physics is missing from the model, and it was found.",
    "partly_explained": "Physics is missing from the model; a part of it was found.",
    "unexplained": "Something is missing, and nothing known explains it.",
    "insufficient": "This flight cannot tell.",
}
KNOWN_ALREADY = "Nothing is missing: what was found is in every calibration, and worth knowing."


def severity_of_effect(name: str) -> str:
    """``info`` for what every calibration has, ``warning`` for what the six numbers lack."""
    return "info" if name in IN_EVERY_MODEL else "warning"


def headline(verdict: str, effects: Collection[str]) -> tuple[str, str]:
    """A diagnosis in one sentence, and its severity: good, info, warning or error.

    Args:
        verdict: a value of :class:`onboard.core.diagnosis.records.Verdict`.
        effects: names of what was found.
    """
    if verdict == "explained" and all(severity_of_effect(n) == "info" for n in effects):
        return KNOWN_ALREADY, "info"
    severity = {"clean": "good", "unexplained": "error"}
    return HEADLINES[verdict], severity.get(verdict, "warning")


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """One accelerometer's flight, diagnosed.

    Attributes:
        imu: which accelerometer.
        verdict: the diagnosis in one word.
        effects: names of what was found, the largest first.
        calibration: of the model with what was found in it, as it was when it was diagnosed.
        missing: why it must not be written by itself, in words; empty if nothing forbids it.
        modelled: what is missing is modelled beside the six, which may be offered to a person.
        document: the diagnosis as other programs read it.
        resumed: it was made before the service last started.
    """

    imu: int
    verdict: str
    effects: tuple[str, ...]
    calibration: Calibration
    missing: str = ""
    modelled: bool = False
    document: dict[str, Any] = field(default_factory=dict)
    resumed: bool = False


def words_of(effect: Finding) -> str:
    """A found effect as part of a sentence, with its size and its name."""
    size = float(np.linalg.norm([q.value for q in effect.unknowns.values()]))
    text = WORDS.get(effect.name, "something is missing")
    return f"{text.format(size=size, degrees=np.degrees(size))} ({effect.name})"
