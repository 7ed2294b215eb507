"""The charts of a replay: how the six came about, what is left, when GPS was trusted."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from markupsafe import Markup

from onboard.answers.chronicle import Course, Curve, Figures, Span
from onboard.core.estimate.observability import Needs
from onboard.core.estimate.result import SIX_NAMES, Calibration
from onboard.report.chart import Band, Line, Ribbon, line_chart

SIGMAS = 2.0
"""Half of a band that is drawn: 95 % [probability]."""
BEGINNING = 0.15
"""Share of a course whose wide bands may leave the picture [use]."""


class Drawn(Protocol):
    """What stood before the calibrators of a recording, or of several."""

    @property
    def duration_s(self) -> float:
        """Where the drawn time ends, s."""

    @property
    def spans(self) -> tuple[Span, ...]:
        """Trust over time."""

    @property
    def speed(self) -> Curve:
        """Speed over ground that GPS reported, m/s."""

    def figures(self, imu: int) -> Figures:
        """The figures of one accelerometer."""


def six_charts(course: Course) -> list[Markup]:
    """Convergence of each of the six, with its band of two sigma and the value in force."""
    charts = []
    for i, name in enumerate(SIX_NAMES):
        t, value, sigma = course.t, course.value[:, i], course.sigma[:, i]
        low, high = value - SIGMAS * sigma, value + SIGMAS * sigma
        force = course.in_force[:, i]
        unit = "factor" if i < 3 else "m/s²"
        charts.append(
            line_chart(
                name,
                unit,
                [Line(t, force, "in-force", "in force"), Line(t, value, "estimate", "estimate")],
                ribbons=[Ribbon(t, low, high, "estimate")],
                y_range=shown_range(course, i),
            )
        )
    return charts


def shown_range(course: Course, i: int) -> tuple[float, float] | None:
    """What of one number's course is shown: its wide beginning may leave the picture [use]."""
    spread = SIGMAS * course.sigma[:, i]
    every = (course.value[:, i] - spread, course.value[:, i] + spread, course.in_force[:, i])
    later = slice(int(BEGINNING * len(course.t)), None)
    bounds = np.concatenate([curve[later] for curve in every])
    bounds = bounds[np.isfinite(bounds)]
    if not len(bounds):
        return None
    bottom, top = float(bounds.min()), float(bounds.max())
    needs = Needs()
    margin = 0.08 * max(top - bottom, needs.scale if i < 3 else needs.offset)
    return bottom - margin, top + margin


def residual_chart(f: Figures, chronicle: Drawn) -> Markup:
    """Velocity error of the flight integrated freely, with what was in force and as estimated."""
    every = np.concatenate([f.before.y, f.after.y])
    known = every[np.isfinite(every)]
    top = 1.1 * float(np.percentile(known, 99.5)) if len(known) else 1.0
    return line_chart(
        "Velocity error of free integration",
        "m/s",
        [
            Line(f.before.t, f.before.y, "before", "before"),
            Line(f.after.t, f.after.y, "after", "after"),
        ],
        _bands(chronicle.spans),
        y_range=(0.0, top or 1.0),
    )


def trust_chart(chronicle: Drawn) -> Markup:
    """Speed over ground, and where GPS was not trusted."""
    speed = chronicle.speed
    top = 1.1 * float(speed.y.max()) if len(speed.y) else 1.0
    return line_chart(
        "Speed over ground",
        "m/s",
        [Line(speed.t, speed.y, "speed", "speed")],
        _bands(chronicle.spans),
        x_range=(0.0, max(chronicle.duration_s, 1.0)),
        y_range=(0.0, top or 1.0),
    )


def _bands(spans: tuple[Span, ...]) -> list[Band]:
    return [Band(s.start, s.end, "untrusted") for s in spans if s.reason]


def certificate_chart(c: Calibration, innovation: Curve) -> Markup:
    """The residual and the bound that holds for it; empty where there is none."""
    if c.certificate is None or not len(innovation.t):
        return Markup("")
    bound = c.certificate.uniform_bound
    ends = np.array([innovation.t.min(), innovation.t.max()])
    lines = [Line(innovation.t, innovation.y, "after", "residual")]
    if math.isfinite(bound):
        lines.append(Line(ends, np.array([bound, bound]), "bound", "bound"))
    top = max([1.1 * float(innovation.y.max()), *([1.1 * bound] if math.isfinite(bound) else [])])
    return line_chart("Velocity residual and its bound", "m/s", lines, y_range=(0.0, top or 1.0))
