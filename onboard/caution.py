"""A second look at calibrations from files: is the model behind them complete?

A fit of six numbers gives six numbers, whatever physics it lacks.  As the service does before it
writes, every calibrated accelerometer is diagnosed; what moves the numbers by more than was
claimed for them is put into the model where it can be, and else the answer is withdrawn.
"""

from __future__ import annotations

from dataclasses import replace

from onboard.core.calibrator import Calibrator
from onboard.core.diagnosis import diagnose
from onboard.core.result import Calibration, Status
from onboard.push.physics import judge_physics
from onboard.replay import Replay


def with_caution(result: Replay, calibrator: Calibrator) -> Replay:
    """The replay with what a diagnosis of its flights says of each calibration.

    Args:
        result: of :func:`onboard.replay.replay`.
        calibrator: that it was made with; it stays as it is.
    """
    return replace(
        result, calibrations=tuple(_cautious(c, calibrator) for c in result.calibrations)
    )


def _cautious(calibration: Calibration, calibrator: Calibrator) -> Calibration:
    """The calibration, that of the fuller model, or the first one withdrawn."""
    if calibration.status is not Status.CALIBRATED:
        return calibration
    try:
        found = diagnose(calibrator, calibration.imu)
    except (ArithmeticError, LookupError, ValueError) as error:  # numbers that no model fits
        return _withdrawn(calibration, f"the flight could not be diagnosed ({error})")
    judged = judge_physics(calibration, found, {})
    if not judged.missing:
        return calibration
    if judged.modelled:
        note = f"taken into account beside the six: {judged.missing}. {judged.calibration.note}"
        return replace(judged.calibration, note=note.rstrip())
    return _withdrawn(calibration, judged.missing)


def _withdrawn(calibration: Calibration, why: str) -> Calibration:
    return replace(
        calibration,
        status=Status.INSUFFICIENT,
        note=f"{why}; see onboard explain. {calibration.note}".rstrip(),
    )
