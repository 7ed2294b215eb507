"""The page of ``onboard explain --report``: one HTML file that needs nothing but itself."""

from __future__ import annotations

from collections.abc import Sequence

import jinja2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from onboard.core.findings import Diagnosis, Verdict
from onboard.core.result import SIX_NAMES
from onboard.report.chart import bar_pairs, series_chart
from onboard.report.parameters import parameter_changes
from onboard.report.words import EFFECTS, VERDICTS


def explain_html(
    diagnosis: Diagnosis, *, files: Sequence[str], autopilot: str, duration_s: float
) -> str:
    """The report as one HTML document.

    Args:
        diagnosis: what was found.
        files: names of the recordings.
        autopilot: as the recordings name it.
        duration_s: length of all recordings.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("onboard.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    environment.filters["number"] = _number
    template = environment.get_template("explain.html.j2")
    colour, words = VERDICTS[diagnosis.verdict]
    s = diagnosis.series
    shaded = [(w.start_s, w.end_s) for w in diagnosis.mismatch.where]
    for effect in diagnosis.effects:
        shaded.extend(effect.intervals)
    before, after = _length(s.before), _length(s.after)
    c = diagnosis.calibration
    return template.render(
        d=diagnosis,
        files=list(files),
        autopilot=autopilot,
        duration=duration_s,
        colour=colour,
        words=words,
        insufficient=diagnosis.verdict is Verdict.INSUFFICIENT,
        names=EFFECTS,
        residual=Markup(  # noqa: S704 - made by our own chart, which escapes its texts
            series_chart(
                "velocity residual over time, before and after",
                "m/s",
                [
                    ("six numbers only", "before", s.t, before),
                    ("with all that was found", "after", s.t, after),
                ],
                shaded,
            )
        ),
        ladder=Markup(  # noqa: S704
            bar_pairs([(r.name, r.whitened_rms, r.held_out) for r in diagnosis.ladder])
        ),
        regimes=Markup(  # noqa: S704
            bar_pairs(
                [
                    (f"{r.regime}, {r.seconds:.0f} s", r.rms_before, r.rms_after)
                    for r in diagnosis.regimes
                ]
            )
        ),
        six=list(
            zip(
                SIX_NAMES,
                c.scale + c.offset,
                c.scale_sigma + c.offset_sigma,
                c.in_force_scale + c.in_force_offset,
                c.observable,
                c.coverage.per_parameter,
                strict=True,
            )
        ),
        changes=parameter_changes(diagnosis),
    )


def _length(v: NDArray[np.float64]) -> NDArray[np.float64]:
    """Length of the horizontal and, where measured, vertical residual."""
    squares = np.nansum(np.asarray(v) ** 2, axis=1) if len(v) else np.zeros(0)
    length: NDArray[np.float64] = np.sqrt(squares)
    return length


def _number(value: float | None, digits: int = 4) -> str:
    if value is None or not np.isfinite(value):
        return "–"
    return f"{value:.{digits}g}"
