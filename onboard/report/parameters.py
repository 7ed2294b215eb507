"""A diagnosis as a parameter file: ``NAME,VALUE`` with ``#`` comments.

Mission Planner and MAVProxy load such files.  What is not safe to load unseen stays in the file
as a comment, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from onboard.core.accelerometer import parameter_names
from onboard.core.findings import Diagnosis, Verdict
from onboard.core.result import SIX_NAMES, Calibration, Status
from onboard.report.words import effect_title


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter to set: its value, why, and why not to load it (empty: load it)."""

    name: str
    value: float
    reason: str
    withheld: str = ""


def changes(diagnosis: Diagnosis) -> tuple[Change, ...]:
    """Parameters to set: observable calibration numbers, then the cures of the effects.

    Each name comes once; values that are not finite do not come at all.  Withheld are numbers of a
    calibration that is not complete, and cures of effects that the flight cannot tell apart.
    """
    found: dict[str, Change] = {}
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        return ()
    unclear = {n for a in diagnosis.ambiguous for n in a.names}
    for change in (*_calibration(diagnosis.calibration), *_cures(diagnosis, unclear)):
        if math.isfinite(change.value):
            found.setdefault(change.name, change)
    return tuple(found.values())


def param_file(diagnosis: Diagnosis) -> str:
    """The parameter file; one ``NAME,VALUE`` a line, comments in plain ASCII."""
    calibration = diagnosis.calibration
    lines = [
        f"# onboard: accelerometer {diagnosis.imu}, verdict {diagnosis.verdict.value}",
        f"# calibration: {calibration.status.value}",
    ]
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        lines.append("# This flight says too little: nothing to change.")
    else:
        names = zip(SIX_NAMES, calibration.observable, strict=True)
        hidden = [name for name, seen in names if not seen]
        if hidden:
            lines.append(f"# not observable in this flight: {', '.join(hidden)}")
        lines.append("# Compare with the parameters in force before loading.")
    for change in changes(diagnosis):
        lines.append(f"# {change.reason}")
        setting = f"{change.name},{change.value:.7g}"
        if change.withheld:
            lines.append(f"# not set, {change.withheld}: {setting}")
        else:
            lines.append(setting)
    return "".join(_plain(line) + "\n" for line in lines)


def parameter_text(diagnosis: Diagnosis, files: Sequence[str]) -> str:
    """:func:`param_file` with the names of the recordings on top."""
    return _plain(f"# onboard explain: {', '.join(files)}") + "\n" + param_file(diagnosis)


def _calibration(calibration: Calibration) -> Iterator[Change]:
    rows = zip(
        parameter_names(calibration.imu).six,
        SIX_NAMES,
        calibration.scale + calibration.offset,
        calibration.scale_sigma + calibration.offset_sigma,
        calibration.observable,
        strict=True,
    )
    complete = calibration.status is Status.CALIBRATED
    withheld = "" if complete else f"the calibration is {calibration.status.value}"
    for name, words, value, sigma, seen in rows:
        if seen:
            spread = f", sigma {sigma:.2g}" if math.isfinite(sigma) else ""
            yield Change(name, value, f"calibration: {words}{spread}", withheld)


def _cures(diagnosis: Diagnosis, unclear: set[str]) -> Iterator[Change]:
    for effect in diagnosis.effects:
        withheld = "not told apart from another effect" if effect.name in unclear else ""
        for name, value in effect.parameters.items():
            yield Change(name, value, f"{effect.name}: {effect_title(effect.name)}", withheld)


def _plain(line: str) -> str:
    """One line of printable ASCII: ground stations differ in what encoding they expect."""
    return "".join(c if " " <= c <= "~" else "?" for c in line)
