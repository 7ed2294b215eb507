"""A replay as one self-contained page: how the calibration came about and what it is worth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.answers import words
from onboard.answers.advice import Advice
from onboard.answers.answer import Answer
from onboard.answers.chronicle import FREE_S, Figures
from onboard.answers.compared import common_cause
from onboard.answers.knowledge import ALL_SIX, ROUGHLY, YES, calibrated, determined, knowledge, seen
from onboard.answers.replay import Replay
from onboard.answers.verdict import LACKING, about_six
from onboard.core.estimate.comparison import Comparison
from onboard.core.estimate.result import SIX_NAMES, Calibration, Status
from onboard.core.maths.accelerometer import parameter_names
from onboard.recordings.recording import damage_by_file
from onboard.report.chart import pair_bar, share_bar
from onboard.report.flight_rows import flight_rows
from onboard.report.page import PAGE, render
from onboard.report.replay_charts import (
    Drawn,
    certificate_chart,
    residual_chart,
    six_charts,
    trust_chart,
)

Array = NDArray[np.float64]


TEMPLATE = "replay.html.j2"
ENOUGH_PERCENT = 60.0
MOST_SPANS = 12
HEADLINES = {
    Status.CALIBRATED: "Calibrated",
    Status.COLLECTING: "Not enough data yet",
    Status.INSUFFICIENT: "The flight does not show enough",
    Status.INVALID: "No valid result",
}


def _headline(answer: Answer) -> str:
    """The status in words; numbers that the flight shows may be spoiled all the same."""
    status = answer.calibration.status
    if status is Status.CALIBRATED:
        return words.capital(calibrated(answer.calibration))
    if status is Status.INSUFFICIENT and answer.missing:
        return words.capital(LACKING)
    return HEADLINES[status]


def replay_html(result: Replay, chronicle: Drawn, base: str = PAGE) -> str:
    """The page of one replay.

    Args:
        result: what the replay gave; numbers that are not finite are shown as not known.
        chronicle: what stood before the calibrator in that replay.
        base: the whole page, or its head only (:mod:`onboard.report.page`).

    Returns:
        One HTML document in UTF-8 without references to anything outside itself.
    """
    common = common_cause(result.comparison) if result.comparison is not None else ()
    statuses = [c.status for c in result.calibrations]
    worst = next((s for s in reversed(Status) if s in statuses), Status.INSUFFICIENT)
    done = sum(s is Status.CALIBRATED for s in statuses)
    if len(statuses) > 1 and 0 < done < len(statuses):
        headline = f"{done} of {len(statuses)} accelerometers calibrated"
    else:
        of_worst = {_headline(a) for a in result.answers if a.calibration.status is worst}
        headline = of_worst.pop() if len(of_worst) == 1 else HEADLINES[worst]
    return render(
        TEMPLATE,
        base,
        files=[r.path.name for r in result.recordings],
        autopilot=words.autopilot_in_words(result.autopilot),
        duration=words.fixed(result.duration_s, 0),
        status=worst.value,
        headline=headline,
        damage=damage_by_file(result.recordings),
        notes=[f"{r.path.name}: {n}" for r in result.recordings for n in r.notes]
        + [n for n in result.notes if n not in common],
        trust_chart=trust_chart(chronicle),
        trust=_trust(chronicle),
        imus=[
            _imu(a, chronicle.figures(a.imu), result.autopilot, chronicle, advice)
            | {"flights": flight_rows(a.flights)}
            for a, advice in zip(result.answers, result.advice, strict=True)
        ],
        free=f"{FREE_S:.0f}",
        pairs=_pairs(result.comparison),
        joint=_joint(result),
        common=common,
    )


def _pairs(comparison: Comparison | None) -> list[dict[str, Any]]:
    """Rows of the table of pairs, one for each axis."""
    out = []
    for pair in () if comparison is None else comparison.pairs:
        rows = zip("xyz", pair.in_force, pair.estimated, pair.own, pair.own_sigma, strict=True)
        for axis, before, after, own, sigma in rows:
            out.append(
                {
                    "label": f"{pair.imus[0]} less {pair.imus[1]}, {axis}",
                    "before": words.fixed(before, 3),
                    "after": words.fixed(after, 3),
                    "own": words.fixed(own, 3),
                    "sigma": words.fixed(sigma, 4),
                    "chi_square": words.fixed(pair.chi_square, 1) if axis == "x" else "",
                }
            )
    return out


def _joint(result: Replay) -> list[dict[str, Any]]:
    """Rows of the six of each accelerometer: by itself, and together with the others."""
    if result.comparison is None:
        return []
    found, out = result.comparison.joint, []
    for c in result.calibrations:
        if c.imu not in found.imus:
            continue
        value, covariance = found.of(c.imu)
        alone = zip(c.scale + c.offset, c.scale_sigma + c.offset_sigma, strict=True)
        both = zip(value, np.sqrt(np.diag(covariance)), strict=True)
        for name, (x, s), (y, u) in zip(SIX_NAMES, alone, both, strict=True):
            digits = 4 if "scale" in name else 3
            cells = [words.fixed(float(v), digits) for v in (x, s, y, u)]
            out.append({"label": f"{c.imu}: {name}", "cells": cells})
    return out


def _imu(
    answer: Answer, f: Figures, autopilot: str, chronicle: Drawn, advice: Advice | None
) -> dict[str, Any]:
    c = answer.calibration
    what, sure, do = _sentences(c, f, advice)
    return {
        "imu": c.imu,
        "status": c.status.value,
        "headline": _headline(answer),
        "what": what,
        "sure": sure,
        "do": do,
        "rows": _rows(c, autopilot),
        "known": c.parameters_known,
        "timing": [
            (words.TIMING.get(name, name.replace("_", " ")), words.seconds(e.value, e.sigma))
            for name, e in c.timing.items()
        ],
        "six": six_charts(f.course),
        "residual": residual_chart(f, chronicle),
        "fits": _fits(c),
        "covers": [
            (name, share_bar(p / 100.0, f"{name} coverage", enough=p >= ENOUGH_PERCENT), p)
            for name, p in zip(SIX_NAMES, map(float, c.coverage.per_parameter), strict=True)
        ],
        "weak": _weak(f),
        "certificate": _certificate(c),
        "certificate_chart": certificate_chart(c, f.innovation),
        "rejected": [(name.replace("_", " "), n) for name, n in sorted(c.rejected.items())],
        "trusted": words.fixed(c.trusted_s, 0),
    }


def _sentences(c: Calibration, f: Figures, advice: Advice | None) -> tuple[str, str, list[str]]:
    """What was found, how sure, what to do: two short paragraphs and a list."""
    if c.status is Status.CALIBRATED:
        what = f"{words.capital(knowledge(c))}."
        if math.isfinite(c.velocity_rms_before) and math.isfinite(c.velocity_rms_after):
            what += (
                f" With them, the velocity is off by {c.velocity_rms_after:.2f} m/s after "
                f"{FREE_S:.0f} s without GPS; with the parameters in force, by "
                f"{c.velocity_rms_before:.2f} m/s."
            )
    else:
        weak = f.seen.note if f.seen is not None else ""
        what = c.note.replace(weak, "").strip() or f"{knowledge(c)}."
        what = f"{what[0].upper()}{what[1:].rstrip('.')}."
    sure = "Not judged on data that the fit did not see: there is too little."
    if math.isfinite(c.held_out_before) and math.isfinite(c.held_out_after):
        sure = (
            f"On parts that the fit did not see, the error is {c.held_out_after:.2f} times the "
            f"noise (with the parameters in force {c.held_out_before:.2f}; 1 is ideal)."
        )
    fly = c.coverage.advice or (f.seen.weak[0].advice if f.seen is not None and f.seen.weak else "")
    return what, sure, list(_to_do(c, fly, advice))


def _to_do(c: Calibration, fly: str, advice: Advice | None) -> Iterator[str]:
    """What to set, by the policy, and what to fly."""
    whole = knowledge(c) == ALL_SIX
    calibrated = c.status is Status.CALIBRATED
    if advice is None:
        if calibrated:
            yield "Use the numbers below." if whole else "Use those that are known."
    elif advice.settable:
        yield (
            "Set the parameters below."
            if whole
            else "Set the parameters in bold, all of them: they belong together."
        )
    else:
        yield about_six(advice)
        yield from (f"{name} holds {said}." for name, said in advice.conditions.items())
    if not calibrated:
        if "onboard explain" in c.note:
            yield "Run onboard explain on the recording: it says what is missing."
        if fly and not c.trusted_s:  # there was no flight to say anything of
            yield f"{words.capital(fly)}."
            return
        yield f"Fly again: {fly}." if fly else "Fly again, with turns, climbs and speed changes."
    elif not whole and fly:
        roughly = all(word in {YES, ROUGHLY} for word in seen(c))
        yield f"To know them better: {fly}." if roughly else f"To learn the others: {fly}."


def _rows(c: Calibration, autopilot: str) -> list[dict[str, Any]]:
    """The table of parameters: before, after, how well known."""
    names = parameter_names(c.imu).six if autopilot == "ardupilot" else SIX_NAMES
    found = determined(c)
    values: tuple[float, ...] = c.scale + c.offset
    if found is not None:  # what is free is set to what belongs to the rest
        own = found.six.scale + found.six.offset
        values = tuple(o if f else v for o, f, v in zip(own, found.free, values, strict=True))
    rows = zip(
        SIX_NAMES,
        names,
        c.in_force_scale + c.in_force_offset,
        values,
        c.scale_sigma + c.offset_sigma,
        seen(c),
        strict=True,
    )
    return [
        {
            "words": label,
            "name": name,
            "before": words.fixed(before, 4),
            "after": words.fixed(value, 4),
            "change": words.signed(value - before, 4),
            "sigma": words.fixed(sigma, 4),
            "seen": how,
        }
        for label, name, before, value, sigma, how in rows
    ]


def _weak(f: Figures) -> list[tuple[str, str]]:
    """What the flight does not show, by the manoeuvre that would; the weakest first."""
    by_advice: dict[str, list[str]] = {}
    for w in f.seen.weak if f.seen is not None else ():
        by_advice.setdefault(w.advice, []).append(
            f"{w.sentence}, sigma {words.number(w.excess, 2)} times what is needed"
        )
    return [(advice, "; ".join(found)) for advice, found in by_advice.items()]


def _fits(c: Calibration) -> list[dict[str, Any]]:
    rows = [
        ("Not used in the fit", "× noise", c.held_out_before, c.held_out_after),
        ("All data", "× noise", c.whitened_rms_before, c.whitened_rms_after),
        (f"Velocity after {FREE_S:.0f} s", "m/s", c.velocity_rms_before, c.velocity_rms_after),
    ]
    if c.dead_reckoning is not None and c.dead_reckoning.windows:
        d = c.dead_reckoning
        rows.append((f"Velocity after {d.horizon_s:.0f} s", "m/s", d.drift_before, d.drift_after))
    if c.at_rest is not None:
        off = abs(c.at_rest.in_force), abs(c.at_rest.estimate)
        rows.append(("Off gravity at rest, not in the fit", "m/s²", *off))
    return [
        {
            "label": label,
            "unit": unit,
            "before": words.number(a),
            "after": words.number(b),
            "bar": pair_bar(a, b, max((v for v in (a, b) if math.isfinite(v)), default=0.0), label),
        }
        for label, unit, a, b in rows
    ]


def _trust(chronicle: Drawn) -> dict[str, Any]:
    spans = chronicle.spans
    doubts = [s for s in spans if s.reason]
    longest = sorted(doubts, key=lambda s: -s.seconds)[:MOST_SPANS]
    return {
        "trusted": words.fixed(sum(s.seconds for s in spans if not s.reason), 0),
        "windows": sum(not s.reason for s in spans),
        "doubts": [
            (
                f"{words.fixed(s.start, 0)} to {words.fixed(s.end, 0)} s",
                words.DISTRUST.get(s.reason, s.reason.replace("_", " ")),
            )
            for s in sorted(longest, key=lambda s: s.start)
        ],
        "more": max(len(doubts) - MOST_SPANS, 0),
    }


def _certificate(c: Calibration) -> dict[str, str] | None:
    if c.certificate is None:
        return None
    k = c.certificate
    return {
        "window": words.fixed(k.window_s, 0),
        "bound": words.number(k.uniform_bound),
        "seen": words.number(k.observed_max),
        "l2": words.number(k.residual_l2),
        "slope": words.number(k.acceleration_bound),
    }
