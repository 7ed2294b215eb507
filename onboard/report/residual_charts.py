"""Charts of a diagnosis: residuals over time, what an effect makes of them, its response curve."""

from __future__ import annotations

import math

import numpy as np
from markupsafe import Markup

from onboard.answers import words
from onboard.core.diagnosis.epochs import rms
from onboard.core.diagnosis.records import Diagnosis, Verdict
from onboard.core.physics.finding import Finding, Imprint, ResponseCurve
from onboard.report.chart import Band, Line, Ribbon, line_chart

COMPONENTS = ("North", "East", "Down")
MOST_BANDS = 200
SIGMAS = 2.0
CURVES = ("one", "two", "three")
"""Kinds of line for several unknowns in one chart."""
EARTH = {"earth_north": "North", "earth_east": "East", "earth_down": "Down"}


def is_located(d: Diagnosis) -> bool:
    """Whether there is a mismatch of which one can say where it lives."""
    quiet = d.verdict in (Verdict.CLEAN, Verdict.INSUFFICIENT)
    return bool(d.mismatch.where) and not quiet


def shading(d: Diagnosis) -> dict[str, bool]:
    """Which kinds of marks the charts of a flight have, for the legend."""
    return {
        "located": is_located(d),
        "interval": any(e.intervals for e in d.effects),
        "onset": bool(_onsets(d)),
        "refused": bool(np.any(d.series.refused)),
    }


def of_flight(d: Diagnosis, duration_s: float) -> list[Markup]:
    """Residual over time by component, with located intervals and times of effects."""
    bands, s = marks(d), d.series
    whole = (0.0, duration_s) if math.isfinite(duration_s) and duration_s > 0.0 else None
    if whole is not None and len(s.t):
        whole = (0.0, max(duration_s, float(np.max(s.t))))
    out, silent = [], []
    for k, component in enumerate(COMPONENTS):
        if not np.any(np.isfinite(s.before[:, k])):
            silent.append(component)
            continue
        lines = [
            Line(s.t, s.before[:, k], "before", "before"),
            Line(s.t, s.after[:, k], "after", "after"),
        ]
        one, two = words.number(rms(s.before[:, k])), words.number(rms(s.after[:, k]))
        out.append(
            line_chart(
                f"{component} velocity residual",
                "m/s",
                lines,
                bands,
                x_range=whole,
                summary=f"{one} m/s before, {two} m/s after, root mean square",
            )
        )
    if silent:
        said = Markup('<p class="muted">{} velocity residual: no data to draw.</p>')
        out.append(said.format(words.listed(silent)))
    return out


def marks(d: Diagnosis) -> list[Band]:
    """Where the mismatch lives, times of effects and moments of jumps."""
    bands = [Band(a, b, "interval") for e in d.effects for a, b in e.intervals[:MOST_BANDS]]
    if is_located(d):
        bands = [Band(w.start_s, w.end_s, "located") for w in d.mismatch.where] + bands
    return bands + [Band(t, t, "onset") for t in _onsets(d)]


def _onsets(d: Diagnosis) -> list[float]:
    """Moments at which something happened once, s."""
    times = [e.unknowns["time"].value for e in d.effects if "time" in e.unknowns]
    return [t for t in times if math.isfinite(t)]


def of_effect(effect: Finding) -> list[Markup]:
    """How well the effect follows the data, and the response curve that it obeys."""
    out = []
    if effect.imprint is not None and len(effect.imprint.t) > 1:
        out.append(_imprint(effect.imprint))
    if effect.response_curve is not None and len(effect.response_curve.x) > 1:
        out.append(_law(effect.response_curve))
    return out


def _imprint(i: Imprint) -> Markup:
    lines = [
        Line(i.t, i.left, "data", "data: what is left without this effect"),
        Line(i.t, i.made, "made", "what this effect makes"),
    ]
    one, two = words.number(rms(i.left)), words.number(rms(i.left - i.made))
    return _with_key(
        line_chart(
            f"{EARTH.get(i.axis, i.axis)} velocity: data and effect",
            "m/s",
            lines,
            summary=f"{one} m/s without the effect, {two} m/s with it, root mean square",
        ),
        [(line.label, f"var(--curve-{line.kind})") for line in lines],
    )


def _law(response_curve: ResponseCurve) -> Markup:
    lines, ribbons, key = [], [], []
    edges = [0.0]
    many = len(response_curve.y) > 1
    for kind, (name, y) in zip(CURVES, response_curve.y.items(), strict=False):
        lines.append(Line(response_curve.x, y, kind, name))
        wide = SIGMAS * response_curve.sigma[name]
        flown = np.isfinite(y) & np.isfinite(wide)
        if flown.any():
            low, high = (y - wide)[flown], (y + wide)[flown]
            ribbons.append(Ribbon(response_curve.x[flown], low, high, kind))
            edges += [float(low.min()), float(high.max())]
        key.append((name, f"var(--curve-{kind})"))
    sizes = [np.abs(y[np.isfinite(y)]).max(initial=0.0) for y in response_curve.y.values()]
    highest = float(max(sizes, default=math.nan))
    unit = words.unit_in_words(response_curve.quantity_unit)
    title = f"{words.capital(response_curve.quantity)} over {response_curve.signal}"
    margin = 0.05 * (max(edges) - min(edges))
    chart = line_chart(
        title,
        unit,
        lines,
        ribbons=ribbons,
        x_label=response_curve.signal,
        x_unit=words.unit_in_words(response_curve.unit),
        x_range=(float(response_curve.x[0]), float(response_curve.x[-1])),
        y_range=(min(edges) - margin, max(edges) + margin) if margin > 0.0 else None,
        symmetric=False,
        summary=f"up to {words.number(highest)} {unit}",
    )
    return _with_key(chart, key) if many else chart


def _with_key(chart: Markup, key: list[tuple[str, str]]) -> Markup:
    entries = Markup("").join(
        Markup('<span><i style="background:{}"></i>{}</span>').format(colour, label)
        for label, colour in key
    )
    return Markup('<div class="key">{}</div>{}').format(entries, chart)
