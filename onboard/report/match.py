"""A match as one self-contained page: what differs, where, the proof, and what to fly next."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from onboard.answers import match_story as story
from onboard.answers import words
from onboard.answers.flown_again import FlownAgain
from onboard.answers.match import Match
from onboard.answers.match_words import TITLES, headline, proof_unit, title, wind_sentence
from onboard.core.diagnosis.records import Verdict
from onboard.core.vehicle.records import Compared, Curve, Difference, VehicleMatch
from onboard.report import match_charts
from onboard.report.chart import Band, pair_bar
from onboard.report.page import HEAD, PAGE, render

TEMPLATE = "match.html.j2"
MOST_PLACES = 3
LEAST_SHARE = 0.005
"""Less is no per cent, and not said."""
OF_EFFECT = {
    "rotor_drag": ("drag_x", "drag_y"),
    "body_drag": ("drag_x", "drag_y"),
    "thrust_scale": ("thrust",),
    "thrust_curve": ("thrust",),
    "voltage_sag": ("sag",),
    "lift": ("lift",),
    "drag": ("drag",),
}
"""Curves that show an effect."""

IN_FILE = {
    "copter": {
        *("rotor_drag", "body_drag", "thrust_scale", "thrust_curve", "voltage_sag", "thrust_tilt"),
    },
    "plane": {"lift", "drag", "side_force"},
}
"""Effects that a frame or coefficient file has keys for: without one it is the file of before."""
FRAME_BY = {PAGE: "--frame-out", HEAD: "frame_file()"}
SETTINGS_BY = {PAGE: "--param", HEAD: "param()"}
"""How who reads it writes the files: a page comes of the command, a head of the library."""


def match_html(match: Match, verified: FlownAgain | None = None, base: str = PAGE) -> str:
    """The page of one match, with its verification if there was one.

    Args:
        match: what was found.
        verified: the simulator's flights with it.
        base: the whole page, or its head only (:mod:`onboard.report.page`).

    Returns:
        One HTML document in UTF-8 without references to anything outside itself.
    """
    v = match.vehicle
    refused = match.verdict is Verdict.INSUFFICIENT
    wind = v.wind
    return render(
        TEMPLATE,
        base,
        files=[r.name for r in (match.simulation, match.real) if r is not None],
        damage=match.damage,
        against=_against(match),
        vehicle=v.vehicle,
        seconds="" if v.series is None else words.fixed(v.seconds, 0),
        verdict=match.verdict.value,
        severity=story.SEVERITIES[match.verdict],
        headline=headline(match),
        differs=[story.sentence(d) for d in match.effects] or [_nothing(match)],
        sure=story.how_sure(match),
        hand_back=_hand_back(match, FRAME_BY[base]),
        frame_by=FRAME_BY[base],
        settings_by=SETTINGS_BY[base],
        note=_note(v.note),
        effects=[_card(d, v) for d in match.effects],
        forces=_forces(v),
        alone_s=words.fixed(float(v.alone.t[-1]), 0) if v.alone is not None else "",
        alone=match_charts.of_alone(v),
        charts=match_charts.of_forces(v, _marks(match)),
        marked=bool(_marks(match)),
        speeds=_speeds(v),
        wind=wind_sentence(match),
        winds=[] if wind is None else match_charts.of_wind(wind),
        autopilot_wind=wind is not None and match_charts.has_ekf(wind),
        curves=[_curve(c, match) for c in v.curves if match_charts.tells(c)],
        verified=None if verified is None else _verified(verified),
        settings=[
            {
                "name": s.name,
                "value": words.setting(s.value),
                "sigma": words.number(s.sigma, 2) if s.sigma > 0.0 else "",
                "reason": s.reason.replace("_", " "),
            }
            for s in match.settings
        ],
        ambiguous=[(" / ".join(map(title, a.names)), a.tell_apart) for a in v.ambiguous],
        fly=() if refused else _to_fly(match),
        not_testable=[(words.capital(title(n.name)), story.reason(n)) for n in match.not_testable],
    )


def _note(said: str) -> str:
    """The note as a sentence, with effects as people call them, where that is another word."""
    for name in TITLES:
        if "_" in name:
            said = re.sub(rf"\b{name}\b", title(name), said)
    return f"{words.capital(said)}." if said else ""


def _against(match: Match) -> str:
    if match.simulation is not None:
        return f"the simulation's recording {match.simulation.name}"
    return "the simulator's airframe in still air"


def _nothing(match: Match) -> str:
    if match.verdict is Verdict.CLEAN:
        return "Nothing: the simulation's airframe flies like this recording."
    if match.verdict is Verdict.INSUFFICIENT:
        return "This recording says too little."
    return "The forces differ, and no effect that is known here explains how."


def _hand_back(match: Match, frame_by: str) -> str | Markup:
    v = match.vehicle
    in_file = {d.name for d in match.effects} & IN_FILE.get(v.vehicle, set())
    count = len(match.settings)
    many = f"the {count} parameters" if count > 1 else "the parameter"
    if count and in_file:
        return Markup(
            "Set {} below in the simulator, and load the frame file (<code>{}</code>)."
        ).format(many, frame_by)
    if count:
        return f"Set {many} below in the simulator."
    if in_file:
        return Markup(
            "Load the frame file of this match (<code>{}</code>) into the simulator."
        ).format(frame_by)
    if match.effects:
        return "Nothing: the simulator has no setting for what differs."
    return "Nothing."


def _card(d: Difference, v: VehicleMatch) -> dict[str, Any]:
    known = math.isfinite(d.held_out_before) and math.isfinite(d.held_out_after)
    unit = words.unit_in_words(proof_unit(d)) if d.level == "vehicle" else "× noise"
    return {
        "title": words.capital(title(d.name)),
        "name": d.name,
        "level": d.level,
        "share": words.percent(d.share) if d.share >= LEAST_SHARE else "",
        "sentence": story.sentence(d),
        "rows": [_row(key, value) for key, value in d.values.items()],
        "fit": _pair("Error without and with it", unit, d.held_out_before, d.held_out_after)
        if known
        else None,
        "where": [
            story.where(p, match_charts.speed_at(v, p.start_s, p.end_s))
            for p in d.where[:MOST_PLACES]
        ],
        "rivals": [title(name) for name in d.rivals],
    }


def _row(key: str, value: Compared) -> dict[str, str]:
    places = value.sigma if math.isfinite(value.sigma) and value.sigma > 0.0 else math.nan
    digits = max(0, 1 - math.floor(math.log10(places))) if math.isfinite(places) else 0
    sized = math.isfinite(places)
    return {
        "name": key.replace("_", " "),
        "unit": words.unit_in_words(value.unit),
        "simulation": words.fixed(value.simulation, digits)
        if sized
        else words.number(value.simulation),
        "real": words.fixed(value.real, digits) if sized else words.number(value.real),
        "sigma": words.fixed(value.sigma, digits) if sized else "",
    }


def _pair(
    label: str, unit: str, before: float, after: float, longest: float | None = None
) -> dict[str, Any]:
    one, two = words.number(before, 2), words.number(after, 2)
    longest = max(before, after) if longest is None else longest
    said = f"{label}: {one} before, {two} after, {unit}"
    return {
        "label": label,
        "unit": unit,
        "before": one,
        "after": two,
        "bar": pair_bar(before, after, longest, said),
    }


def _longest(pairs: list[tuple[float, float]]) -> float:
    return max((x for pair in pairs for x in pair if math.isfinite(x)), default=math.nan)


def _forces(v: VehicleMatch) -> list[dict[str, Any]]:
    """Bars by axis, and of the velocity when the model is alone."""
    rows = {axis: (m.before, m.after) for axis, m in v.mismatch.items()}
    longest = _longest(list(rows.values()))
    out = [
        _pair(story.AXIS_WORDS.get(axis, axis), "m/s²", before, after, longest)
        for axis, (before, after) in rows.items()
    ]
    if math.isfinite(v.alone_before):
        out.append(_pair("Velocity after 10 s alone", "m/s", v.alone_before, v.alone_after))
    return out


def _speeds(v: VehicleMatch) -> list[dict[str, Any]]:
    rows = match_charts.by_speed(v)
    longest = _longest([(a, b) for _, a, b in rows])
    return [_pair(span, "m/s²", a, b, longest) for span, a, b in rows]


def _verified(v: FlownAgain) -> dict[str, Any]:
    """The simulator's own flights beside the recording."""
    forces = {k: (m.before, m.after) for k, m in v.mismatch.items() if k != "tilt"}
    longest = _longest(list(forces.values()))
    rows = [
        _pair(story.AXIS_WORDS.get(k, k), "m/s²", before, after, longest)
        for k, (before, after) in forces.items()
    ]
    if "tilt" in v.mismatch:
        rows.append(_pair("Tilt", "°", v.mismatch["tilt"].before, v.mismatch["tilt"].after))
    return {
        "simulator": v.simulator,
        "agrees": v.agrees,
        "untold": v.untold,
        "bars": rows,
        "numbers": [
            {
                "name": words.capital(key.replace("_", " ").replace(".", ": ")),
                "unit": words.unit_in_words(n.unit),
                "real": words.number(n.real),
                "again": words.number(n.again),
                "sigma": words.number(n.sigma, 2),
                "agrees": n.agrees,
            }
            for key, n in v.numbers.items()
        ],
        "left": [title(name) for name in v.left],
    }


def _marks(match: Match) -> list[Band]:
    """Where the strongest effect of the vehicle acts most."""
    first = next((d for d in match.effects if d.level == "vehicle" and d.where), None)
    return [] if first is None else [Band(p.start_s, p.end_s, "located") for p in first.where]


def _curve(c: Curve, match: Match) -> Mapping[str, Any]:
    named = [d.name for d in match.effects if c.name in OF_EFFECT.get(d.name, ())]
    return {"chart": match_charts.of_curve(c), "names": [title(n) for n in named]}


def _to_fly(match: Match) -> list[tuple[str, str]]:
    return [
        (manoeuvre, words.listed([title(n) for n in names]))
        for manoeuvre, names in story.to_fly(match.not_testable)
    ]
