"""A diagnosis as one self-contained page: no network, charts inline."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from onboard.answers import verdict, words
from onboard.answers.advice import Advice
from onboard.answers.explain import Explanation
from onboard.answers.knowledge import seen
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.result import SIX_NAMES
from onboard.core.physics.catalogue import danger_of, is_excluded, kind_of, title_of
from onboard.core.physics.finding import Confounder, Finding, Where
from onboard.push.diagnosed import severity_of_effect
from onboard.report import residual_charts
from onboard.report.chart import pair_bar
from onboard.report.page import PAGE, render
from onboard.report.parameters import changes

TEMPLATE = "explain.html.j2"
MOST_SPANS = 8
MOST_RIVALS = 3
"""Effects that could stand for another, told one by one: the nearest; the rest in one line."""
LEVELS = {"info": "worth knowing", "warning": "matters", "error": "dangerous"}
"""How much an effect matters, in words: whether it forbids to set the calibration."""


def explain_html(
    diagnosis: Diagnosis,
    *,
    files: Sequence[str],
    autopilot: str,
    duration_s: float,
    advice: Advice | None,
    damage: Sequence[str] = (),
    notes: Sequence[str] = (),
    base: str = PAGE,
) -> str:
    """The page of one diagnosis.

    Args:
        diagnosis: what was found; numbers that are not finite are shown as not known.
        files: names of the recordings.
        autopilot: where the recordings are from.
        duration_s: length of the recordings, s.
        advice: which of ArduPilot's parameters to set; None for another autopilot.
        damage: what was skipped of damaged recordings, in sentences.
        notes: in which order recordings are taken.
        base: the whole page, or its head only (:mod:`onboard.report.page`).

    Returns:
        One HTML document in UTF-8 without references to anything outside itself.
    """
    return render(
        TEMPLATE,
        base,
        files=list(files),
        damage=list(damage),
        notes=list(notes),
        autopilot=words.autopilot_in_words(autopilot),
        duration=words.fixed(duration_s, 0),
        imu=diagnosis.imu,
        **_verdict(diagnosis),
        change=verdict.cures(diagnosis, advice),
        remarks=verdict.remarks(diagnosis),
        to_fly=() if diagnosis.silent else verdict.to_fly(diagnosis),
        charts=residual_charts.of_flight(diagnosis, duration_s),
        shading=residual_charts.shading(diagnosis),
        fits=_fits(diagnosis),
        where=_places(diagnosis),
        regimes=_regimes(diagnosis),
        effects=_cards(diagnosis, advice),
        ladder=_ladder(diagnosis),
        six=_six(diagnosis),
        status=diagnosis.calibration.status.value,
        known=diagnosis.calibration.parameters_known,
        timing=_timing(diagnosis),
        parameters=() if advice is None else _parameters(diagnosis, advice),
        ambiguous=[([title_of(n) for n in a.names], a.tell_apart) for a in diagnosis.ambiguous],
        not_testable=[(title_of(n.name), n.why) for n in diagnosis.not_testable],
        unseen=() if diagnosis.silent else _unseen(diagnosis),
    )


def _timing(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Delays and averaging: what, and how much with its sigma."""
    return [
        (words.TIMING.get(name, name.replace("_", " ")), words.seconds(e.value, e.sigma))
        for name, e in diagnosis.timing.items()
    ]


def explanation_html(result: Explanation, base: str = PAGE) -> str:
    """The page of an explanation, as :func:`explain_html` makes it."""
    return explain_html(
        result.diagnosis,
        files=result.files,
        autopilot=result.source.autopilot,
        duration_s=result.duration_s,
        advice=result.advice,
        damage=result.source.damage,
        notes=result.notes,
        base=base,
    )


def _unseen(d: Diagnosis) -> list[tuple[str, str]]:
    """Effects that could have been found and were not: from which size on they would have been."""
    blind = {n.name for n in d.not_testable}
    return [
        (title_of(u.name), words.sizes(u.smallest, u.unit)) for u in d.unseen if u.name not in blind
    ]


def _fits(d: Diagnosis) -> list[dict[str, Any]]:
    """Error before and after, on flight that was not fitted and on all of it."""
    m = d.mismatch
    rows = [
        ("Not used in the fit", m.held_out_velocity_before, m.held_out_velocity_after, "m/s"),
        ("All flight", m.velocity_rms_before, m.velocity_rms_after, "m/s"),
        ("Not used in the fit", m.held_out_before, m.held_out_after, "× noise"),
        ("All flight", m.whitened_rms_before, m.whitened_rms_after, "× noise"),
    ]
    longest = {u: _longest([x for _, a, b, v in rows if v == u for x in (a, b)]) for *_, u in rows}
    return [_pair(label, unit, a, b, longest[unit]) for label, a, b, unit in rows]


def _regimes(d: Diagnosis) -> list[dict[str, Any]]:
    longest = _longest([v for r in d.regimes for v in (r.velocity_before, r.velocity_after)])
    return [
        _pair(
            f"{r.regime} ({words.fixed(r.seconds, 0)} s)",
            "m/s",
            r.velocity_before,
            r.velocity_after,
            longest,
        )
        | {
            "name": r.regime,
            "noise": f"{words.number(r.rms_before, 2)} → {words.number(r.rms_after, 2)}",
        }
        for r in d.regimes
    ]


def _pair(label: str, unit: str, before: float, after: float, longest: float) -> dict[str, Any]:
    one, two = words.number(before), words.number(after)
    return {
        "label": label,
        "unit": unit,
        "before": one,
        "after": two,
        "bar": pair_bar(before, after, longest, f"{label}: {one} before, {two} after, {unit}"),
    }


def _longest(values: Sequence[float]) -> float:
    return max((v for v in values if math.isfinite(v)), default=math.nan)


def _ladder(d: Diagnosis) -> list[dict[str, Any]]:
    """Each step's errors, and what the step has brought on flight that was not fitted."""
    longest = _longest([r.held_out_velocity for r in d.ladder])
    out = []
    for k, r in enumerate(d.ladder):
        last = d.ladder[k - 1].held_out_velocity if k else math.nan
        error = words.number(r.held_out_velocity)
        out.append(
            {
                "name": _step(r.name),
                "error": error,
                "bar": pair_bar(math.nan, r.held_out_velocity, longest, f"{error} m/s"),
                "change": verdict.fall(last, r.held_out_velocity) if k else "",
                "fitted": words.number(r.velocity_rms),
                "noise": words.number(r.held_out),
            }
        )
    return out


def _step(name: str) -> tuple[str, str]:
    """A step in words, and the effect's name if it is one."""
    effect = name.removeprefix("+ ")
    if kind_of(effect) is not None:
        title = title_of(effect)
        return "+ " + (title if title[:2].isupper() else title[:1].lower() + title[1:]), effect
    return name, ""


def _places(diagnosis: Diagnosis) -> list[str]:
    """Where the mismatch is, if it is anywhere more than elsewhere."""
    if not residual_charts.is_located(diagnosis):
        return []
    return [_where(w) for w in diagnosis.mismatch.where]


def _where(w: Where) -> str:
    span = f"{words.fixed(w.start_s, 0)} to {words.fixed(w.end_s, 0)} s"
    axis = w.axis.replace("_", " ")
    return f"{span}: {w.regime}, mostly {axis}, {words.percent(w.share)} of the mismatch"


def _verdict(diagnosis: Diagnosis) -> dict[str, Any]:
    """What is said first."""
    return {
        "verdict": diagnosis.verdict.value,
        "silent": diagnosis.silent,
        "split": bool(diagnosis.split),
        "headline": verdict.headline(diagnosis),
        "severity": verdict.severity(diagnosis),
        "dangers": verdict.dangers(diagnosis),
        "lacks": verdict.lacks(diagnosis),
        "missing": verdict.missing(diagnosis),
        "sure": verdict.proof(diagnosis),
    }


def _cards(diagnosis: Diagnosis, advice: Advice | None) -> list[dict[str, Any]]:
    """One for each effect that was found."""
    unclear = {n for a in diagnosis.ambiguous for n in a.names}
    return [_card(e, advice, ambiguous=e.name in unclear) for e in diagnosis.effects]


def _card(e: Finding, advice: Advice | None, *, ambiguous: bool) -> dict[str, Any]:
    before, after = e.held_out_velocity_before, e.held_out_velocity_after
    known = math.isfinite(before) and math.isfinite(after)
    rivals = sorted(e.confounders, key=lambda r: r.delta_bic)
    return {
        "title": verdict.sized(e),
        "name": e.name,
        "unknowns": [(n.replace("_", " "), words.quantity(q)) for n, q in e.unknowns.items()],
        "formula": e.formula,
        "share": words.percent(e.share_of_mismatch),
        "sure": verdict.surely(e, ambiguous=ambiguous),
        "bic": words.number(e.delta_bic) if not is_excluded(e.name) else "",
        "fit": _pair("Error without and with it", "m/s", before, after, _longest((before, after)))
        if known
        else None,
        "noise": f"{words.number(e.held_out_before)} → {words.number(e.held_out_after)}",
        "charts": residual_charts.of_effect(e),
        "level": LEVELS[severity_of_effect(e.name, danger_of(e))],
        "danger": danger_of(e),
        "rivals": [(title_of(r.name), words.number(r.delta_bic)) for r in rivals[:MOST_RIVALS]],
        "others": _others(rivals[MOST_RIVALS:]),
        "cure": e.cure,
        "parameters": []
        if advice is None
        else [
            (advice.names.get(n, n), words.setting(v))
            for n, v in e.parameters.items()
            if e.name not in advice.against
        ],
        "intervals": _intervals(e),
        "more": max(len(e.intervals) - MOST_SPANS, 0),
        "where": [] if e.intervals else [_where(w) for w in e.where[:3]],
    }


def _others(rivals: Sequence[Confounder]) -> str:
    """Rivals that are further away than those that are named."""
    if not rivals:
        return ""
    return f"{len(rivals)} more (BIC worse by {words.number(rivals[0].delta_bic)} or more)"


def _intervals(e: Finding) -> list[str]:
    return [f"{words.fixed(a, 1)} to {words.fixed(b, 1)} s" for a, b in e.intervals[:MOST_SPANS]]


def _parameters(d: Diagnosis, advice: Advice) -> list[dict[str, str]]:
    """What to set, beside what is in force where that is known."""
    c = d.calibration
    in_force: dict[str, float] = {}
    if c.parameters_known:
        numbers = zip(SIX_NAMES, c.in_force_scale + c.in_force_offset, strict=True)
        in_force = dict(numbers)
    return [
        {
            "name": change.name,
            "now": words.fixed(in_force[change.number], 4) if change.number in in_force else "",
            "value": f"{round(change.value, 4) + 0.0:.4f}"
            if change.number
            else words.setting(change.value),
            "reason": change.reason.replace("degC", "°C"),  # plain in files of parameters
            "withheld": change.withheld,
        }
        for change in changes(d, advice)
    ]


def _six(d: Diagnosis) -> list[tuple[str, str, str, str, str]]:
    c = d.calibration
    rows = zip(
        SIX_NAMES,
        c.scale + c.offset,
        c.scale_sigma + c.offset_sigma,
        c.in_force_scale + c.in_force_offset,
        seen(c),
        strict=True,
    )
    return [
        (name, words.fixed(v, 4), words.fixed(s, 4), words.fixed(f, 4), how)
        for name, v, s, f, how in rows
    ]
