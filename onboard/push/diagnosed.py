"""The record of a flight's diagnosis, as it is kept and judged before a push.

What becomes of the calibration beside what was found, :mod:`onboard.answers.answer` says.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

from onboard.core.diagnosis.records import REPEATED
from onboard.core.estimate.result import Calibration
from onboard.core.physics.catalogue import bearing_of, is_excluded
from onboard.core.physics.effect import Bearing

HEADLINES = {
    "clean": "Nothing is missing beyond the six numbers and the timing.",
    "explained": "The flight shows errors beyond the six numbers, and all of them were identified.",
    "partly_explained": "The flight shows errors beyond the six numbers, and some were identified.",
    "unexplained": "The flight shows errors that no known effect explains.",
    "insufficient": "This flight shows too little to say whether anything is missing.",
}
KNOWN_ALREADY = (
    "Nothing is missing. What was found is already taken into account by every calibration."
)


def severity_of_effect(name: str, danger: str = "") -> str:
    """``info`` for what forbids nothing, ``warning`` for what the calibration lacks.

    ``error`` is for what is a danger to the vehicle (:func:`~onboard.core.physics.catalogue.
    danger_of`), whatever it means for the calibration.
    """
    if danger:
        return "error"
    return "info" if bearing_of(name) is Bearing.HARMLESS else "warning"


def headline(verdict: str, effects: Collection[str], *, dangerous: bool = False) -> tuple[str, str]:
    """A diagnosis in one sentence, and its severity: good, info, warning or error.

    Args:
        verdict: a value of :class:`onboard.core.diagnosis.records.Verdict`.
        effects: names of what was found.
        dangerous: whether one of them is a danger to the vehicle.
    """
    if dangerous:
        return HEADLINES[verdict], "error"
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

    @property
    def died(self) -> str:
        """That the accelerometer repeated one reading in flight, in words; empty: it did not."""
        unused = self.document.get("unused") or ()
        spans = [(u["start_s"], u["end_s"]) for u in unused if u["reason"] == REPEATED]
        seconds = sum(end - start for start, end in spans if None not in (start, end))
        said = f"it repeated one reading for {seconds:.0f} s of the flight: broken, or loose"
        return said if spans else ""

    @property
    def left_out(self) -> bool:
        """Whether something was found that must not be fitted, and was left out of the fit."""
        return any(is_excluded(name) for name in self.effects)
