"""Figures of results, drawn with matplotlib where it is installed (the extra ``plot``).

They are figures by themselves, not of pyplot: nothing is kept open, and a notebook shows each once.
Colours are those of the reports.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from onboard.answers.chronicle import Course
from onboard.answers.match_story import AXIS_WORDS
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.maths.arrays import Array
from onboard.core.vehicle.records import VehicleMatch
from onboard.errors import ExtraError
from onboard.report.chart import Band
from onboard.report.match_charts import most_shown
from onboard.report.replay_charts import SIGMAS, shown_range
from onboard.report.residual_charts import COMPONENTS, marks

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BEFORE: Final = "#a0560a"
AFTER: Final = "#0a58a8"
SHADES: Final = {"located": "#b45309", "interval": "#be123c", "onset": "#ac2018"}
MEANINGS: Final = {
    "located": "where the mismatch is largest",
    "interval": "time of an effect",
    "onset": "moment of a jump",
}
WIDTH_IN: Final = 9.0
DOTS_PER_INCH: Final = 80


def draw_courses(courses: Mapping[int, Course], figure: Figure | None) -> Figure:
    """How the six numbers of each accelerometer converged, by its number."""
    rows = 2 * len(courses)
    made, axes = _axes(rows, 3, 2.1 * rows, figure)
    for k, (imu, course) in enumerate(courses.items()):
        for i, name in enumerate(SIX_NAMES):
            ax = axes[2 * k + i // 3][i % 3]
            value, spread = course.value[:, i], SIGMAS * course.sigma[:, i]
            band = f"±{SIGMAS:.0f} sigma"
            ax.fill_between(
                course.t, value - spread, value + spread, color=AFTER, alpha=0.18, label=band
            )
            ax.plot(course.t, value, color=AFTER, label="estimate")
            ax.plot(course.t, course.in_force[:, i], "--", color=BEFORE, label="in force")
            shown = shown_range(course, i)
            if shown is not None:
                ax.set_ylim(*shown)
            ax.set_title(f"accelerometer {imu}: {name}", fontsize="medium")
            ax.set_ylabel("factor" if i < 3 else "m/s²")
            if i >= 3:
                ax.set_xlabel("time, s")
    _legend(made, axes[0][0])
    return made


def draw_residuals(diagnosis: Diagnosis, figure: Figure | None) -> Figure:
    """Velocity residual over time by component, before and after."""
    s = diagnosis.series
    titles = {
        f"{component} velocity residual": (s.before[:, k], s.after[:, k])
        for k, component in enumerate(COMPONENTS)
        if np.isfinite(s.before[:, k]).any()
    }
    return _before_and_after(s.t, titles, "m/s", marks(diagnosis), figure)


def draw_forces(vehicle: VehicleMatch, figure: Figure | None) -> Figure:
    """Error of the predicted force over time by axis, before and after."""
    s = vehicle.series
    if s is None:
        made, _ = _axes(1, 1, 2.0, figure)
        return made
    before, after = s.measured - s.before, s.measured - s.after
    titles = {
        f"Error of the predicted force: {AXIS_WORDS.get(axis, axis).lower()}": pair
        for axis, pair in zip(s.axes, zip(before.T, after.T, strict=True), strict=True)
    }
    made = _before_and_after(s.t, titles, "m/s²", (), figure)
    for ax in made.axes:
        ax.set_ylim(-most_shown(s), most_shown(s))
    return made


def _before_and_after(
    t: Array,
    curves: Mapping[str, tuple[Array, Array]],
    unit: str,
    bands: Sequence[Band],
    figure: Figure | None,
) -> Figure:
    """One pair of curves below the other, on one scale, by their titles."""
    made, axes = _axes(max(len(curves), 1), 1, 1.7 * max(len(curves), 1) + 0.5, figure)
    for ax, (title, (before, after)) in zip(axes[:, 0], curves.items(), strict=False):
        ax.sharey(axes[0, 0])
        _shade(ax, bands)
        ax.plot(t, before, color=BEFORE, lw=0.8, label="before")
        ax.plot(t, after, color=AFTER, lw=0.8, label="after")
        ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
        ax.set_title(title, fontsize="medium", loc="left")
        ax.set_ylabel(unit)
    axes[-1, 0].set_xlabel("time, s")
    _legend(made, axes[0, 0])
    return made


def _shade(ax: Any, bands: Sequence[Band]) -> None:  # noqa: ANN401 - of matplotlib
    told: set[str] = set()
    for band in bands:
        said = "" if band.kind in told else MEANINGS[band.kind]
        told.add(band.kind)
        colour = SHADES[band.kind]
        if band.end > band.start:
            ax.axvspan(band.start, band.end, color=colour, alpha=0.15, lw=0, label=said)
        else:
            ax.axvline(band.start, color=colour, label=said)


def _axes(rows: int, columns: int, height: float, figure: Figure | None) -> tuple[Figure, Any]:
    """A figure with a grid of axes: (rows, columns) of them.

    Raises:
        ExtraError: matplotlib is not installed.
    """
    made = _blank(height) if figure is None else figure
    axes = made.subplots(rows, columns, squeeze=False, sharex=True)
    for ax in axes.flat:
        ax.grid(visible=True, alpha=0.3)
        ax.ticklabel_format(useOffset=False)
    return made, axes


def _blank(height: float) -> Figure:
    """A figure that a notebook shows by itself.

    Raises:
        ExtraError: matplotlib is not installed.
    """
    try:
        from matplotlib import figure  # noqa: PLC0415 - optional, and slow to import
    except ImportError:
        raise ExtraError("plots need matplotlib: pip install 'onboard-calibration[plot]'") from None

    class Figure(figure.Figure):
        def _repr_png_(self) -> bytes:
            file = io.BytesIO()
            self.savefig(file, format="png", dpi=DOTS_PER_INCH)
            return file.getvalue()

    return Figure(figsize=(WIDTH_IN, height), layout="constrained")


def _legend(figure: Figure, ax: Any) -> None:  # noqa: ANN401 - of matplotlib
    handles, labels = ax.get_legend_handles_labels()
    if not labels:
        return
    figure.legend(handles, labels, loc="outside upper right", ncols=len(labels), frameon=False)
