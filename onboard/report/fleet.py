"""A fleet as one page: a row for each vehicle, the most urgent first, with links to reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from onboard.answers.fleet.history import Accelerometer, History, Number
from onboard.answers.fleet.record import Flown
from onboard.answers.fleet.severity import (
    NAMES,
    SAID,
    UNITS,
    Severity,
    day,
    known,
    sentences,
    severity_of,
    shared_sentence,
    sized,
    state_in_words,
)
from onboard.answers.fleet.shared_numbers import Comparison
from onboard.answers.fleet.vehicles import Flight
from onboard.answers.words import capital
from onboard.core.estimate.result import Status
from onboard.core.fleet.course import Sized
from onboard.core.fleet.limits import FALSE_ALARM, SHARED_FALSE_ALARM
from onboard.report.page import render
from onboard.report.sparkline import sparkline

TEMPLATE = "fleet.html.j2"
LOOKS = {
    Severity.CONTRADICTED: "error",
    Severity.CHANGED: "warn",
    Severity.TO_SET: "warn",
    Severity.UNKNOWN: "info",
    Severity.WELL: "good",
}
STATES = {
    Status.CALIBRATED: "good",
    Status.COLLECTING: "warn",
    Status.INSUFFICIENT: "warn",
    Status.INVALID: "bad",
}
HOUR_S = 3600.0


def fleet_html(
    flown: Sequence[Flown],
    histories: Sequence[History],
    compared: Comparison,
    pages: Mapping[str, str],
) -> str:
    """The index.

    Args:
        flown: every recording, in order.
        histories: of the vehicles.
        compared: what types share.
        pages: address of the report of each recording that has one, beside the index, by name.

    Returns:
        One HTML document in UTF-8 that refers to nothing but these pages.
    """
    order = list(Severity)
    by_severity = sorted(histories, key=lambda h: (order.index(severity_of(h)), h.vehicle.name))
    seconds = sum(o.record.document.recording.duration_s or 0.0 for o in flown if o.record)
    unread = [o for o in flown if o.record is None]
    counts = [(s, sum(severity_of(h) is s for h in histories)) for s in Severity]
    return render(
        TEMPLATE,
        look="error" if unread else LOOKS[severity_of(by_severity[0])] if by_severity else "info",
        vehicles=[_vehicle(h, pages) for h in by_severity],
        counts=[(n, s.value, _plain(s), SAID[s]) for s, n in counts if n],
        recordings=len(flown),
        hours=f"{seconds / HOUR_S:.1f}",
        unread=[(o.name, o.error.removeprefix(f"{o.path}: ")) for o in unread],
        shared=[shared_sentence(c) for c in compared.common],
        compared=compared.looked_at,
        false_alarm=f"{100 * FALSE_ALARM:.0f}",
        shared_false_alarm=f"{100 * SHARED_FALSE_ALARM:.0f}",
    )


def _vehicle(h: History, pages: Mapping[str, str]) -> dict[str, Any]:
    severity = severity_of(h)
    flights = h.vehicle.flights
    days = [d for f in flights if (d := day(f))]
    said = sentences(h)
    accelerometers = [_accelerometer(a) for a in h.accelerometers if a.numbers]
    beside = [_number(n) for n in h.numbers]
    hidden = [n for a in accelerometers[1:] for n in a["numbers"]] + beside
    return {
        "name": h.vehicle.name,
        "type": h.vehicle.type,
        "identified": h.vehicle.identified_by,
        "look": LOOKS[severity],
        "severity": severity.value,
        "severity_said": _plain(severity),
        "what": [capital(s) for s in said] or [f"{capital(SAID[severity])}."],
        "count": len(flights),
        "span": " to ".join(dict.fromkeys((days[0], days[-1]))) if days else "",
        "accelerometers": accelerometers,
        "beside": beside,
        "open": any(n["changed"] for n in hidden),
        "flights": [_flight(f, pages) for f in reversed(flights)],
    }


def _accelerometer(a: Accelerometer) -> dict[str, Any]:
    merged = a.merged
    said = a.why
    if merged is not None:
        n, flights = len(merged.counted), len(a.flights) + len(a.left_out)
        said = f"{n} of {flights} flights merged" if flights > 1 else ""
    return {"imu": a.imu, "said": said, "numbers": [_number(n) for n in a.numbers]}


def _number(n: Number) -> dict[str, Any]:
    c, s = n.course, n.series
    name, unit = NAMES.get(n.name, n.name), UNITS[n.unit]
    latest = known(Sized(*n.latest, 1.0))
    notes = []
    if c.steps:
        notes.append(f"{len(c.steps)} step{'s' if len(c.steps) > 1 else ''}")
    if c.odd:
        notes.append(f"{len(c.odd)} odd")
    if c.drifts and c.trend is not None:
        notes.append(f"{sized(c.trend, unit)} a day")
    return {
        "name": name,
        "unit": unit.strip(),
        "latest": latest,
        "changed": bool(notes),
        "note": ", ".join(notes),
        "picture": sparkline(
            s.value,
            s.sigma,
            c.parts,
            [o.flight for o in c.odd],
            f"{name} of {len(n.flights)} flights, now {latest}{unit}",
        ),
    }


def _flight(f: Flight, pages: Mapping[str, str]) -> dict[str, Any]:
    imus = [
        (i.calibration.imu, state_in_words(i), STATES[i.calibration.status], i.missing or i.why)
        for i in f.record.imus
    ]
    return {
        "name": f.flown.name,
        "page": _address(pages.get(f.flown.name)),
        "day": day(f),
        "minutes": f"{(f.record.document.recording.duration_s or 0.0) / 60.0:.1f}",
        "imus": imus,
        "why": f.why,
        # Behind the name of the file, which is there already.
        "damage": [
            x.removeprefix(f"{f.record.name}: ") for x in f.record.document.recording.damage
        ],
    }


def _plain(severity: Severity) -> str:
    return severity.value.replace("_", " ")


def _address(page: str | None) -> str | None:
    """Of a page beside this one: a name like ``javascript:...`` or ``50%#2`` is a name."""
    return None if page is None else "./" + quote(page)
