"""Calibrations and diagnoses as parameter files for ground stations.

``NAME,VALUE`` with ``#`` comments is what Mission Planner and MAVProxy load; QGroundControl wants
lines of vehicle, component, name, value and type with tabs between them, by custom in a file
whose name ends in ``.params``.  What the policy would not write (:mod:`onboard.answers.advice`)
stays in the file as a comment, with the reason.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from onboard.answers.advice import Advice
from onboard.answers.answer import Answer
from onboard.answers.explain import Explanation
from onboard.answers.px4 import Px4Advice, px4_advice
from onboard.answers.replay import Replay
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import SIX_NAMES, Calibration
from onboard.core.physics.catalogue import title_of
from onboard.errors import UsageError
from onboard.printable import in_ascii

REAL32 = 9
ULOG = "ulog"
"""Recordings that say what PX4 did to its accelerometer; its telemetry does not."""
INTEGERS = {
    "GPS1_DELAY_MS": 4,
    "GPS2_DELAY_MS": 4,
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


def changes(diagnosis: Diagnosis, advice: Advice) -> tuple[Change, ...]:
    """The six as they would be set, then the cures of the effects; what is withheld says why.

    Each name comes once; values that are not finite do not come at all.
    """
    found: dict[str, Change] = {}
    if diagnosis.silent:
        return ()
    for change in (*_six(advice), *_cures(diagnosis, advice)):
        if math.isfinite(change.value):
            found.setdefault(change.name, change)
    return tuple(found.values())


def parameter_text(
    diagnosis: Diagnosis, advice: Advice, files: Sequence[str] = (), *, qgc: bool = False
) -> str:
    """The parameter file of a diagnosis, plain ASCII; ``qgc``: as QGroundControl wants it."""
    lines = [f"# onboard explain: {', '.join(files)}"] if files else []
    lines.append(f"# accelerometer {diagnosis.imu}, verdict {diagnosis.verdict.value}")
    lines.append(f"# calibration: {diagnosis.calibration.status.value}")
    if diagnosis.silent:
        split = diagnosis.split
        why = "These recordings are not one flight" if split else "This flight says too little"
        lines.append(f"# {why}: nothing to change.")
    else:
        lines += _about(diagnosis.calibration, advice)
        lines.append("# Compare with the parameters in force before loading.")
    return _text([*lines, *_settings(changes(diagnosis, advice), qgc=qgc)])


def calibration_text(
    answers: Sequence[Answer], advice: Sequence[Advice], files: Sequence[str], *, qgc: bool = False
) -> str:
    """The parameter file of a replay: the six of every accelerometer."""
    lines = [f"# onboard replay: {', '.join(files)}"]
    for given, its in zip(answers, advice, strict=True):
        lines.append(f"# accelerometer {given.imu}: {given.calibration.status.value}")
        lines += _about(given.calibration, its)
        lines += _settings(_six(its), qgc=qgc)
    return _text([*lines, "# Compare with the parameters in force before loading."])


def px4_text(answers: Sequence[Answer], advice: Sequence[Px4Advice], files: Sequence[str]) -> str:
    """The parameter file of a PX4 log, as QGroundControl loads it."""
    lines = [f"# onboard, PX4: {', '.join(files)}"]
    for given, its in zip(answers, advice, strict=True):
        lines.append(f"# accelerometer {given.imu}: {given.calibration.status.value}")
        lines += [f"# not to be set: {reason}" for reason in its.reasons]
        for setting in its.settings:
            lines.append(f"# calibration: {setting.words}, repeatable to {setting.sigma:.2g}")
            line = f"1\t1\t{setting.name}\t{setting.value:.7g}\t{REAL32}"
            lines.append(f"# not set: {line}" if its.reasons else line)
    lines.append("# Load it before the next flight: PX4 may learn offsets of its own after each")
    lines.append("# (SENS_IMU_AUTOCAL). Compare with the parameters in force before loading.")
    return _text(lines)


def replay_text(result: Replay, file: str | Path) -> str:
    """The parameter file of a replay, in the format that its name asks for.

    Raises:
        UsageError: the recordings are of another autopilot, or telemetry of PX4.
    """
    if result.recordings[0].kind == ULOG:
        path, alone = result.recordings[0].path, len(result.recordings) == 1
        its = [px4_advice(a, path, result.parameters, alone=alone) for a in result.answers]
        return px4_text(result.answers, its, [r.path.name for r in result.recordings])
    advice = [its for its in result.advice if its is not None]
    if not advice:
        raise UsageError(
            f"{file}: {result.recordings[0].path} is no ArduPilot's, and no ULog of PX4; "
            "the table and --json have the numbers"
        )
    names = [recording.path.name for recording in result.recordings]
    return calibration_text(result.answers, advice, names, qgc=is_qgc(str(file)))


def explanation_text(result: Explanation, file: str | Path) -> str:
    """The parameter file of an explanation, in the format that its name asks for.

    Raises:
        UsageError: the recordings are of another autopilot, or telemetry of PX4.
    """
    recordings = result.source.recordings
    if recordings[0].kind == ULOG:
        its = px4_advice(result.answer, recordings[0].path, result.parameters)
        return px4_text([result.answer], [its], result.files)
    if result.advice is None:
        raise UsageError(
            f"{file}: {recordings[0].path} is no ArduPilot's, and no ULog of PX4; "
            "the table and --json have the numbers"
        )
    qgc = is_qgc(str(file))
    return parameter_text(result.diagnosis, result.advice, result.files, qgc=qgc)


def is_qgc(file: str) -> bool:
    """Whether a file of this name is QGroundControl's."""
    return file.lower().endswith(".params")


def _about(calibration: Calibration, advice: Advice) -> Iterator[str]:
    """What holds for all six: the objections, and what is left as it is."""
    for reason in advice.reasons:
        yield f"# not to be set: {reason}"
    if not calibration.parameters_known:
        yield "# parameters in force are not in the recording: scale 1 and offset 0 are assumed"
    changes = () if advice.plan is None else advice.plan.changes
    if hidden := [name for name, c in zip(SIX_NAMES, changes, strict=False) if c.kept]:
        yield f"# not observable in this flight, left as in force: {', '.join(hidden)}"


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
    return "".join(in_ascii(line) + "\n" for line in lines)


def _six(advice: Advice) -> Iterator[Change]:
    if advice.plan is None:
        return
    withheld = ""
    if advice.refusals:
        withheld = advice.refusals[0].objection.value.replace("_", " ")
    for words, number in zip(SIX_NAMES, advice.plan.changes, strict=True):
        if number.kept:
            continue
        reason = f"calibration: {words}"
        if math.isfinite(number.sigma):
            reason += f", repeatable to {number.sigma:.2g}"
        if number.name in advice.conditions:
            reason += f": {advice.conditions[number.name]}"
        yield Change(number.name, number.wanted, reason, withheld, words)


def _cures(diagnosis: Diagnosis, advice: Advice) -> Iterator[Change]:
    for effect in diagnosis.effects:
        withheld = advice.against.get(effect.name, "")
        for name, value in effect.parameters.items():
            reason = f"{effect.name}: {title_of(effect.name)}"
            yield Change(advice.names.get(name, name), value, reason, withheld)
