"""A parameter file that ground stations load: calibration that was seen, and cures."""

from __future__ import annotations

from collections.abc import Sequence

from onboard.core.accelerometer import parameter_names
from onboard.core.findings import Diagnosis


def parameter_changes(diagnosis: Diagnosis) -> list[tuple[str, float, float | None, str]]:
    """Name, value, value in force (None if unknown) and reason of every parameter to change."""
    c = diagnosis.calibration
    rows = zip(
        parameter_names(c.imu).six,
        c.scale + c.offset,
        c.in_force_scale + c.in_force_offset,
        c.observable,
        strict=True,
    )
    out: list[tuple[str, float, float | None, str]] = [
        (name, value, force if c.parameters_known else None, "calibration")
        for name, value, force, seen in rows
        if seen
    ]
    for effect in diagnosis.effects:
        out += [(name, value, None, effect.name) for name, value in effect.parameters.items()]
    return out


def parameter_text(diagnosis: Diagnosis, files: Sequence[str]) -> str:
    """``NAME,VALUE`` lines with comments, as Mission Planner, QGroundControl and MAVProxy read."""
    lines = [f"# onboard explain: {', '.join(files)}", f"# verdict: {diagnosis.verdict.value}"]
    for name, value, _, why in parameter_changes(diagnosis):
        lines += [f"# {why}", f"{name},{value:.7g}"]
    return "\n".join(lines) + "\n"
