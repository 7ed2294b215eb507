"""A diagnosis as one self-contained page: no script, no network, charts inline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from onboard.core.findings import Diagnosis, Effect, Where
from onboard.core.result import SIX_NAMES
from onboard.report import words
from onboard.report.chart import Band, Line, line_chart, pair_bar
from onboard.report.page import render
from onboard.report.parameters import changes

TEMPLATE = "explain.html.j2"
COMPONENTS = ("North", "East", "Down")
MOST_BANDS = 200


def explain_html(
    diagnosis: Diagnosis, *, files: Sequence[str], autopilot: str, duration_s: float
) -> str:
    """The page of one diagnosis.

    Args:
        diagnosis: what was found; numbers that are not finite are shown as not known.
        files: names of the recordings.
        autopilot: ``ardupilot`` shows parameters to change; others have different ones.
        duration_s: length of the recordings, s.

    Returns:
        One HTML document in UTF-8 without references to anything outside itself.
    """
    m = diagnosis.mismatch
    missing, sure, change = words.sentences(diagnosis)
    unclear = {n for a in diagnosis.ambiguous for n in a.names}
    return render(
        TEMPLATE,
        files=list(files),
        autopilot=autopilot,
        duration=words.number(duration_s),
        imu=diagnosis.imu,
        verdict=diagnosis.verdict.value,
        headline=words.HEADLINES[diagnosis.verdict],
        missing=missing,
        sure=sure,
        change=change,
        note=diagnosis.note,
        charts=_charts(diagnosis),
        shaded=bool(m.where),
        fault=any(e.intervals for e in diagnosis.effects),
        refused=bool(np.any(diagnosis.series.refused)),
        fits=_fits(diagnosis),
        where=[_where(w) for w in m.where],
        regimes=_regimes(diagnosis),
        effects=[_card(e, autopilot, ambiguous=e.name in unclear) for e in diagnosis.effects],
        ladder=_ladder(diagnosis),
        six=_six(diagnosis),
        status=diagnosis.calibration.status.value,
        known=diagnosis.calibration.parameters_known,
        timing=[
            (name.replace("_", " "), words.with_sigma(e.value, e.sigma))
            for name, e in diagnosis.timing.items()
        ],
        parameters=[
            (c.name, f"{c.value:.7g}", c.reason, c.withheld)
            for c in (changes(diagnosis) if autopilot == "ardupilot" else ())
        ],
        ambiguous=[
            ([words.effect_title(n) for n in a.names], a.tell_apart) for a in diagnosis.ambiguous
        ],
        not_testable=[(words.effect_title(n.name), n.why) for n in diagnosis.not_testable],
    )


def _charts(d: Diagnosis) -> list[Markup]:
    """Residual over time by component with the located intervals, then the other curves."""
    bands = [Band(w.start_s, w.end_s, "located") for w in d.mismatch.where]
    bands += [Band(a, b, "interval") for e in d.effects for a, b in e.intervals[:MOST_BANDS]]
    s = d.series
    out = []
    for k, component in enumerate(COMPONENTS):
        lines = [
            Line(s.t, s.before[:, k], "before", "before"),
            Line(s.t, s.after[:, k], "after", "after"),
        ]
        out.append(line_chart(f"{component} velocity residual", "m/s", lines, bands))
    for name, (x, y) in d.curves.items():
        title = name.replace("_", " ")
        line = Line(x, y, "after", title)
        out.append(line_chart(title, "value", [line], x_unit="argument", symmetric=False))
    return out


def _fits(d: Diagnosis) -> list[dict[str, Any]]:
    """Error before and after: on all data, on held-out data, in m/s."""
    m = d.mismatch
    rows = [
        ("Not used in the fit", "× noise", m.held_out_before, m.held_out_after),
        ("All data", "× noise", m.whitened_rms_before, m.whitened_rms_after),
        ("Velocity", "m/s", m.velocity_rms_before, m.velocity_rms_after),
    ]
    return [_pair(label, unit, a, b, _longest((a, b))) for label, unit, a, b in rows]


def _regimes(d: Diagnosis) -> list[dict[str, Any]]:
    longest = _longest([v for r in d.regimes for v in (r.rms_before, r.rms_after)])
    return [
        _pair(f"{r.regime} ({words.fixed(r.seconds, 0)} s)", "", r.rms_before, r.rms_after, longest)
        for r in d.regimes
    ]


def _pair(label: str, unit: str, before: float, after: float, longest: float) -> dict[str, Any]:
    return {
        "label": label,
        "unit": unit,
        "before": words.number(before),
        "after": words.number(after),
        "bar": pair_bar(before, after, longest, label),
    }


def _longest(values: Sequence[float]) -> float:
    return max((v for v in values if math.isfinite(v)), default=math.nan)


def _ladder(d: Diagnosis) -> list[dict[str, Any]]:
    longest = _longest([v for r in d.ladder for v in (r.whitened_rms, r.held_out)])
    return [_pair(r.name, "", r.whitened_rms, r.held_out, longest) for r in d.ladder]


def _where(w: Where) -> str:
    span = f"{words.fixed(w.start_s, 0)} to {words.fixed(w.end_s, 0)} s"
    axis = w.axis.replace("_", " ")
    return f"{span}: {w.regime}, mostly {axis}, {words.percent(w.share)} of the mismatch"


def _card(e: Effect, autopilot: str, *, ambiguous: bool) -> dict[str, Any]:
    return {
        "title": words.effect_title(e.name),
        "name": e.name,
        "unknowns": [(n.replace("_", " "), words.quantity(q)) for n, q in e.unknowns.items()],
        "formula": e.formula,
        "share": words.percent(e.share_of_mismatch),
        "sure": words.surely(e, ambiguous=ambiguous),
        "bic": words.number(e.delta_bic),
        "bar": pair_bar(
            e.held_out_before,
            e.held_out_after,
            _longest((e.held_out_before, e.held_out_after)),
            "error on data not used in the fit",
        ),
        "before": words.number(e.held_out_before),
        "after": words.number(e.held_out_after),
        "rivals": [(words.effect_title(r.name), words.number(r.delta_bic)) for r in e.rivals],
        "cure": e.cure,
        "parameters": [
            (n, f"{v:.6g}" if math.isfinite(v) else words.UNKNOWN)
            for n, v in (e.parameters.items() if autopilot == "ardupilot" else ())
        ],
        "intervals": [f"{words.fixed(a, 1)} to {words.fixed(b, 1)} s" for a, b in e.intervals[:8]],
        "more": max(len(e.intervals) - 8, 0),
        "where": [_where(w) for w in e.where[:3]],
    }


def _six(d: Diagnosis) -> list[tuple[str, str, str, str, bool]]:
    c = d.calibration
    rows = zip(
        SIX_NAMES,
        c.scale + c.offset,
        c.scale_sigma + c.offset_sigma,
        c.in_force_scale + c.in_force_offset,
        c.observable,
        strict=True,
    )
    return [
        (name, words.fixed(v, 4), words.fixed(s, 4), words.fixed(f, 4), seen)
        for name, v, s, f, seen in rows
    ]
