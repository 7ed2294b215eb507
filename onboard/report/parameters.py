"""Calibrations and diagnoses as parameter files for ground stations.

``NAME,VALUE`` with ``#`` comments is what Mission Planner and MAVProxy load; QGroundControl wants
lines of vehicle, component, name, value and type with tabs between them, by custom in a file
whose name ends in ``.params``.  What is not safe to load unseen stays in the file as a comment,
with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from onboard.core.accelerometer import parameter_names
from onboard.core.findings import Diagnosis, Effect, Verdict
from onboard.core.result import SIX_NAMES, Calibration, Status
from onboard.report.words import effect_title

REAL32 = 9
INTEGERS = {
    "GPS1_DELAY_MS": 4,
    "GPS_DELAY_MS": 4,
    "INS_ACCEL_FILTER": 4,
    "INS_TCAL": 2,
    "COMPASS_ORIENT": 2,
}
"""MAV_PARAM_TYPE of what is not a real number, by the beginning of its name."""


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter to set: its value, why, and why not to load it (empty: load it).

    ``number`` is its name in SIX_NAMES if it is one of the six.
    """

    name: str
    value: float
    reason: str
    withheld: str = ""
    number: str = ""


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


def to_set(effect: Effect) -> dict[str, float]:
    """Parameters that cure an effect; none where they hold it already."""
    return {} if effect.cure.startswith("none") else effect.parameters


def param_file(diagnosis: Diagnosis, *, qgc: bool = False) -> str:
    """The parameter file of a diagnosis, plain ASCII; ``qgc``: as QGroundControl wants it."""
    calibration = diagnosis.calibration
    lines = [
        f"# onboard: accelerometer {diagnosis.imu}, verdict {diagnosis.verdict.value}",
        f"# calibration: {calibration.status.value}",
    ]
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        lines.append("# This flight says too little: nothing to change.")
    else:
        lines += _hidden(calibration)
        lines.append("# Compare with the parameters in force before loading.")
    return _text([*lines, *_settings(changes(diagnosis), qgc=qgc)])


def parameter_text(diagnosis: Diagnosis, files: Sequence[str], *, qgc: bool = False) -> str:
    """:func:`param_file` with the names of the recordings on top."""
    return _text([f"# onboard explain: {', '.join(files)}"]) + param_file(diagnosis, qgc=qgc)


def calibration_text(
    calibrations: Sequence[Calibration], files: Sequence[str], *, qgc: bool = False
) -> str:
    """The parameter file of a replay: what was observed, of every accelerometer."""
    lines = [f"# onboard replay: {', '.join(files)}"]
    for calibration in calibrations:
        lines.append(f"# accelerometer {calibration.imu}: {calibration.status.value}")
        lines += _hidden(calibration)
        known = [c for c in _calibration(calibration) if math.isfinite(c.value)]
        lines += _settings(known, qgc=qgc)
    return _text([*lines, "# Compare with the parameters in force before loading."])


def is_qgc(file: str) -> bool:
    """Whether a file of this name is QGroundControl's."""
    return file.lower().endswith(".params")


def _hidden(calibration: Calibration) -> list[str]:
    names = zip(SIX_NAMES, calibration.observable, strict=True)
    hidden = [name for name, seen in names if not seen]
    return [f"# not observable in this flight: {', '.join(hidden)}"] if hidden else []


def _settings(found: Iterable[Change], *, qgc: bool) -> Iterator[str]:
    for change in found:
        yield f"# {change.reason}"
        setting = _tabbed(change) if qgc else f"{change.name},{change.value:.7g}"
        yield f"# not set, {change.withheld}: {setting}" if change.withheld else setting


def _tabbed(change: Change) -> str:
    """Vehicle 1, its autopilot, and the type that ArduPilot declares (others are not loaded)."""
    kind = next((k for stem, k in INTEGERS.items() if change.name.startswith(stem)), REAL32)
    value = f"{change.value:.7g}" if kind == REAL32 else f"{change.value:.0f}"
    return f"1\t1\t{change.name}\t{value}\t{kind}"


def _text(lines: Iterable[str]) -> str:
    return "".join(_plain(line) + "\n" for line in lines)


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
            yield Change(name, value, f"calibration: {words}{spread}", withheld, words)


def _cures(diagnosis: Diagnosis, unclear: set[str]) -> Iterator[Change]:
    for effect in diagnosis.effects:
        withheld = "not told apart from another effect" if effect.name in unclear else ""
        for name, value in to_set(effect).items():
            yield Change(name, value, f"{effect.name}: {effect_title(effect.name)}", withheld)


def _plain(line: str) -> str:
    """One line of printable ASCII: ground stations differ in what encoding they expect."""
    return "".join(c if " " <= c <= "~" or c == "\t" else "?" for c in line)
