"""Charts of a match: forces over time, wind, laws with their data, flying on alone."""

from __future__ import annotations

import itertools
import math

import numpy as np
from markupsafe import Markup

from onboard.answers import words
from onboard.answers.match_story import AXIS_WORDS
from onboard.core.maths.arrays import Array
from onboard.core.vehicle.records import Curve, ForceSeries, VehicleMatch, WindEstimate
from onboard.report.chart import Band, Line, Points, line_chart

SPEEDS_M_S = (0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, math.inf)
"""Edges of the bins of speed over ground."""
FEWEST_IN_BIN = 20
TITLES = {
    "drag_x": "Drag along the vehicle's x axis (forward)",
    "drag_y": "Drag along the vehicle's y axis (right)",
    "thrust": "Thrust over command",
    "sag": "Battery voltage over charge",
    "lift": "Lift over angle of attack",
    "drag": "Drag over lift",
}
X_LABELS = {
    "drag_x": "air-relative speed along x",
    "drag_y": "air-relative speed along y",
    "thrust": "command of the motors, 0 to 1",
}
WORST_SIGMA = 5.0
"""Median sigmas past which an estimate of a block is too poor to be drawn."""
LEAST_SAG_V = 0.2
LEAST_WIND_M_S = 0.3
"""Below, a wind has no direction to speak of."""


def rms(x: Array) -> float:
    """Root of the mean square of the finite ones; NaN if there is none."""
    x = x[np.isfinite(x)]
    return float(np.sqrt(np.mean(x**2))) if x.size else math.nan


def most_shown(s: ForceSeries) -> float:
    """How far errors of the force are drawn, m/s^2: nearly all of each axis, before and after.

    One scale for all axes: where nothing differs, nothing should seem to.
    """
    errors = np.abs(np.concatenate([s.measured - s.before, s.measured - s.after], axis=1))
    finite = [e[np.isfinite(e)] for e in errors.T]
    return 1.1 * max((float(np.percentile(e, 99.7)) for e in finite if e.size), default=0.0) or 1.0


def of_forces(v: VehicleMatch, marks: list[Band]) -> list[Markup]:
    """Error of the predicted force over time, one chart for each axis."""
    s = v.series
    if s is None:
        return []
    out = []
    most = most_shown(s)
    for k, axis in enumerate(s.axes):
        before, after = s.measured[:, k] - s.before[:, k], s.measured[:, k] - s.after[:, k]
        told = f"{words.number(rms(before))} m/s² before, {words.number(rms(after))} m/s² after"
        lines = [Line(s.t, before, "before", "before"), Line(s.t, after, "after", "after")]
        title = AXIS_WORDS.get(axis, axis)
        out.append(
            line_chart(
                title,
                "m/s²",
                lines,
                marks,
                y_range=(-most, most),
                summary=f"{told}, root mean square",
            )
        )
    return out


def by_speed(v: VehicleMatch) -> list[tuple[str, float, float]]:
    """Error of the force by speed over ground: words, before and after, m/s^2 RMS."""
    s = v.series
    if s is None or len(s.speed) != len(s.t):
        return []
    before = np.sqrt(np.sum((s.measured - s.before) ** 2, axis=1))
    after = np.sqrt(np.sum((s.measured - s.after) ** 2, axis=1))
    out = []
    for low, high in itertools.pairwise(SPEEDS_M_S):
        mine = (s.speed >= low) & (s.speed < high)
        if np.count_nonzero(mine) < FEWEST_IN_BIN:
            continue
        span = f"{low:.0f} to {high:.0f} m/s" if math.isfinite(high) else f"over {low:.0f} m/s"
        out.append((span, rms(before[mine]), rms(after[mine])))
    return out


def speed_at(v: VehicleMatch, start_s: float, end_s: float) -> float:
    """Median speed over ground in a stretch of flight, m/s; NaN where it is not known."""
    s = v.series
    if s is None or len(s.speed) != len(s.t):
        return math.nan
    mine = (s.t >= start_s - 0.5) & (s.t <= end_s + 0.5)
    return float(np.median(s.speed[mine])) if mine.any() else math.nan


def of_alone(v: VehicleMatch) -> list[Markup]:
    """How the velocity drifts while the model flies on by itself."""
    a = v.alone
    if a is None:
        return []
    lines = [Line(a.t, a.before, "before", "before"), Line(a.t, a.after, "after", "after")]
    told = f"{words.number(a.before[-1])} m/s before, {words.number(a.after[-1])} m/s after"
    return [
        line_chart(
            "Velocity error of the model alone",
            "m/s",
            lines,
            x_label="time since it was left alone",
            symmetric=False,
            y_range=(0.0, 1.05 * float(max(a.before.max(), a.after.max(), 1e-3))),
            summary=f"after {a.t[-1]:.0f} s {told}",
        )
    ]


def of_wind(wind: WindEstimate) -> list[Markup]:
    """Wind over time towards north and east, and along itself over height."""
    if len(wind.series_t) < 2 or len(wind.law) != len(wind.series_t):
        return []
    size = np.linalg.norm(wind.series_sigma, axis=1)
    told = size < WORST_SIGMA * float(np.median(size))
    series_t = wind.series_t[told]
    series, law, spread = wind.series[told], wind.law[told], wind.series_sigma[told]
    out = []
    for k, way in enumerate(("north", "east")):
        estimate = Points(series_t, series[:, k], "block", "estimate", 2.0 * spread[:, k])
        lines = [Line(series_t, law[:, k], "found", "model")]
        if has_ekf(wind):
            lines.append(Line(series_t, wind.ekf[told, k], "theirs", "autopilot"))
        out.append(
            line_chart(
                f"Wind towards {way}",
                "m/s",
                lines,
                points=[estimate],
                symmetric=False,
                y_range=_wide(np.concatenate([series[:, k], *(line.y for line in lines)])),
                summary=f"mean {words.number(float(np.mean(series[:, k])))} m/s",
            )
        )
    speed = wind.speed
    if speed < LEAST_WIND_M_S:
        return out
    along = np.array([wind.north, wind.east]) / speed
    height = wind.series_height[told]
    order = np.argsort(height)
    height, model = height[order], law[order] @ along
    found = series[order] @ along
    top = 1.1 * float(max(found.max(), model.max()))
    out.append(
        line_chart(
            "Wind over height",
            "height above ground, m",
            [Line(model, height, "found", "model")],
            points=[Points(found, height, "block", "estimate")],
            x_label="wind speed",
            x_unit="m/s",
            x_range=(min(0.0, float(found.min())), max(top, 1.0)),
            y_range=(0.0, 1.1 * float(height.max())),
            symmetric=False,
            summary=f"{words.number(found[0])} m/s at {height[0]:.0f} m, "
            f"{words.number(found[-1])} m/s at {height[-1]:.0f} m",
        )
    )
    return out


def has_ekf(wind: WindEstimate) -> bool:
    """Whether the autopilot has a wind of its own."""
    return bool(len(wind.ekf) and np.isfinite(wind.ekf).all(axis=1).any())


def tells(c: Curve) -> bool:
    """Whether a curve has something to show: a battery that stays full has not."""
    return c.name != "sag" or float(np.ptp(c.data)) > LEAST_SAG_V


def of_curve(c: Curve) -> Markup:
    """A law as the simulation has it and as it was found, with the flight's points."""
    lines = [
        Line(c.x, c.nominal, "simulated", "simulation"),
        Line(c.x, c.fitted, "found", "found"),
    ]
    points = (
        Points(c.points[:, 0], c.points[:, 1], "flown", "flight")
        if len(c.points)
        else Points(c.x, c.data, "flown", "flight", c.spread)
    )
    high = int(np.argmax(np.abs(c.x)))
    y_unit = words.unit_in_words(c.y_unit)
    told = (
        f"at {words.number(float(c.x[high]))} {words.unit_in_words(c.x_unit)} "
        f"{words.number(float(c.nominal[high]))} {y_unit} in the simulation, "
        f"{words.number(float(c.fitted[high]))} {y_unit} found"
    )
    return line_chart(
        TITLES.get(c.name, words.capital(c.y_label)),
        ", ".join(x for x in (c.y_label, y_unit) if x),
        lines,
        points=[points],
        x_label=X_LABELS.get(c.name, c.x_label),
        x_unit=words.unit_in_words(c.x_unit),
        x_range=(float(c.x.min()), float(c.x.max())),
        y_range=_wide(np.concatenate([c.nominal, c.fitted, *_most(points.y)]), floor=0.0),
        symmetric=False,
        summary=told,
    )


def _most(y: Array) -> list[Array]:
    """The range of nearly all points: one wild value does not flatten the rest."""
    y = y[np.isfinite(y)]
    return [np.percentile(y, [0.5, 99.5])] if len(y) else []


def _wide(y: Array, floor: float = 0.5) -> tuple[float, float]:
    """A range that holds all of y, not narrower than twice ``floor``."""
    y = y[np.isfinite(y)]
    if not len(y):
        return -1.0, 1.0
    low, high = float(y.min()), float(y.max())
    low, high = min(low, 0.5 * (low + high) - floor), max(high, 0.5 * (low + high) + floor)
    margin = 0.08 * (high - low) or 0.1
    return low - margin, high + margin
