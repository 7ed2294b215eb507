"""Whether physics that the model left out forbids a push, and what may be offered instead.

A calibration is only as good as the model behind it.  A diagnosis fits the same flight with every
effect of the catalogue; where it finds one, the six numbers of the plain model are compared with
those of the model that has the effect.  A number that moves by more than what was claimed for
it is wrong by more than what was claimed, however small its sigma is: nothing is written by
itself then.  The numbers of the fuller model are offered to a person, where they mean what
the autopilot takes them for.

Latency and averaging of the receiver, delay of the attitude and a wrong heading are in the
plain model, too: they are worth knowing and forbid nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from onboard.core.findings import Diagnosis, Effect, Verdict
from onboard.core.result import SIX_NAMES, Calibration, Status

MOVED_SIGMAS = 2.0
"""Of what is claimed for a number: how far missing physics may move it."""
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


@dataclass(frozen=True, slots=True)
class Diagnosed:
    """One accelerometer's flight, diagnosed.

    Attributes:
        imu: which accelerometer.
        verdict: the diagnosis in one word.
        effects: names of what was found, the largest first.
        calibration: the one that may be proposed, as it was when it was diagnosed.
        missing: why it must not be written by itself, in words; empty if nothing forbids it.
        modelled: the calibration is that of the fuller model.
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


def judge_physics(
    calibration: Calibration, diagnosis: Diagnosis, document: dict[str, Any]
) -> Diagnosed:
    """What a diagnosis means for the push of ``calibration``.

    Args:
        calibration: of the plain model, as it would be proposed.
        diagnosis: of the same accelerometer, at the same moment.
        document: the diagnosis for other programs.
    """
    suspects = [e for e in diagnosis.effects if e.name not in IN_EVERY_MODEL]
    fuller = diagnosis.calibration
    missing, modelled = "", False
    if not diagnosis.mismatch.supported:
        m = diagnosis.mismatch
        missing = f"only {m.fixes} of {m.believed} GPS fixes fit one model of this flight"
    elif diagnosis.verdict in {Verdict.UNEXPLAINED, Verdict.PARTLY_EXPLAINED}:
        found = _listed(suspects)
        missing = "the residual is not noise, and " + (
            f"what was found ({found}) does not explain all of it"
            if found
            else "no known effect explains it"
        )
    elif any(e.name in NO_ONE_NUMBER for e in suspects):
        missing = _cured(suspects)
    elif suspects and (moved := moved_most(calibration, fuller)) is not None:
        name, by, sigmas = moved
        missing = f"{_cured(suspects)} (it moves the {name} by {by:+.2g}, {sigmas:.1f} sigma)"
        modelled = fuller.status is Status.CALIBRATED and {e.name for e in suspects} <= GEOMETRY
    return Diagnosed(
        imu=calibration.imu,
        verdict=diagnosis.verdict.value,
        effects=tuple(e.name for e in diagnosis.effects),
        calibration=fuller if modelled else calibration,
        missing=missing,
        modelled=modelled,
        document=document,
    )


def moved_most(plain: Calibration, fuller: Calibration) -> tuple[str, float, float] | None:
    """The number that the fuller model moves most: name, by how much, in claimed sigmas.

    None if none that the flight shows moves by more than :data:`MOVED_SIGMAS`.
    """
    by = np.array(fuller.scale + fuller.offset) - np.array(plain.scale + plain.offset)
    claimed = np.array(plain.scale_sigma + plain.offset_sigma)
    sigmas = np.where(plain.observable, np.abs(by) / claimed, 0.0)
    worst = int(np.argmax(sigmas))
    # What is no number is not within its claim.
    if sigmas[worst] <= MOVED_SIGMAS:
        return None
    return SIX_NAMES[worst], float(by[worst]), float(sigmas[worst])


def _cured(effects: list[Effect]) -> str:
    """What is missing and what to do about it."""
    cures = [
        f"set {', '.join(f'{n} {v:.2f}' for n, v in e.parameters.items())}"
        if e.parameters
        else e.cure
        for e in effects
    ]
    todo = "; ".join(dict.fromkeys(c for c in cures if c))
    return f"{_listed(effects)}: {todo}; then fly again" if todo else _listed(effects)


def _listed(effects: list[Effect]) -> str:
    return ", ".join(_words(e) for e in effects)


def _words(effect: Effect) -> str:
    size = float(np.linalg.norm([q.value for q in effect.unknowns.values()]))
    text = WORDS.get(effect.name, "something is missing")
    return f"{text.format(size=size, degrees=np.degrees(size))} ({effect.name})"
