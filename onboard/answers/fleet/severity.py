"""How urgently somebody should look at a vehicle, and why, in sentences."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from enum import Enum

from onboard.answers.fleet.history import Accelerometer, History, Number
from onboard.answers.fleet.record import ImuRecord
from onboard.answers.fleet.shared_numbers import Common
from onboard.answers.fleet.vehicles import Flight
from onboard.core.estimate.result import Status
from onboard.core.fleet.course import Sized

NAMES = {
    "gps_delay_s": "latency of GPS",
    "imu_delay_s": "delay of the attitude",
    "antenna_x_m": "antenna forward",
    "antenna_y_m": "antenna right",
    "antenna_z_m": "antenna down",
}
"""Numbers that are not of an accelerometer, in words."""
PX4 = "px4"
UNITS = {"1": "", "m/s^2": " m/s²", "s": " s", "m": " m"}


STATES = {
    Status.CALIBRATED: "calibrated",
    Status.COLLECTING: "too short",
    Status.INSUFFICIENT: "not shown",
    Status.INVALID: "invalid",
}


class Severity(Enum):
    """What there is to do, the most urgent first."""

    CONTRADICTED = "contradicted"
    CHANGED = "changed"
    TO_SET = "to_set"
    UNKNOWN = "unknown"
    WELL = "well"


SAID = {
    Severity.CONTRADICTED: "flights contradict each other, or have no valid result",
    Severity.CHANGED: "a number has changed",
    Severity.TO_SET: "a flight asks for other parameters than are in force",
    Severity.UNKNOWN: "no flight says whether what is in force is right",
    Severity.WELL: "nothing to do",
}


def severity_of(h: History) -> Severity:
    """The most urgent that holds."""
    every = [n for a in h.accelerometers for n in a.numbers]
    latest = [i.calibration.status for i in h.vehicle.latest.imus]
    contradicted = any(n.course.odd for n in every) or any(
        a.flights and (a.merged is None or a.merged.contradicted)
        for a in h.accelerometers
        if not any(n.course.drifts for n in a.numbers)
    )
    if contradicted or Status.INVALID in latest:
        return Severity.CONTRADICTED
    if any(n.course.steps or n.course.drifts for n in (*every, *h.numbers)) or any(
        n.course.odd for n in h.numbers
    ):
        return Severity.CHANGED
    if any(_asking(h)):
        return Severity.TO_SET
    answered = any(_answers(f, i) for f in h.vehicle.counting for i in f.record.imus)
    return Severity.WELL if answered else Severity.UNKNOWN


def _answers(flight: Flight, i: ImuRecord) -> bool:
    """Whether a flight says that what is in force is right, or how far it is off.

    PX4 has other parameters, which are never compared.
    """
    told = i.calibration.parameters_known or flight.record.document.recording.autopilot == PX4
    return told and i.calibration.status is Status.CALIBRATED


def sentences(h: History) -> tuple[str, ...]:
    """What there is to say of a vehicle over time."""
    out: list[str] = []
    for a in h.accelerometers:
        out += [f"accelerometer {a.imu}: {said}" for n in a.numbers for said in _said(n)]
        out += [f"accelerometer {a.imu}: {said}" for said in _merged(a)]
    out += [said for n in h.numbers for said in _said(n)]
    asking: dict[str, list[int]] = {}
    for imu, flight in _asking(h):
        asking.setdefault(_flight(flight), []).append(imu)
    out += [
        f"{_accelerometers(imus)}: {flight} asks for other parameters than are in force: "
        "set them as its report says"
        for flight, imus in asking.items()
    ]
    if not out and severity_of(h) is Severity.UNKNOWN:
        out = [f"accelerometer {i.calibration.imu}: {why_not(i)}" for i in h.vehicle.latest.imus]
    for a in h.accelerometers:
        if a.merged is not None and a.merged.open:
            open_ = a.merged.open.rstrip(".")
            out.append(f"accelerometer {a.imu}: {open_[0].lower()}{open_[1:]}")
    return tuple(out)


def state_in_words(i: ImuRecord) -> str:
    """What one recording says of an accelerometer, in two words at most."""
    if i.calibration.status is Status.INSUFFICIENT and i.missing:
        return "missing physics"
    return STATES[i.calibration.status]


def why_not(i: ImuRecord) -> str:
    """Why a recording has not calibrated an accelerometer, in a sentence."""
    if i.missing:
        return f"something is missing from the model: {i.missing}"
    if i.calibration.status is Status.CALIBRATED and not i.calibration.parameters_known:
        return "the recording does not say which parameters were in force"
    said = i.calibration.note.removeprefix(f"accelerometer {i.calibration.imu}: ").rstrip(".")
    if not i.calibration.trusted_s and (to_do := i.calibration.coverage.advice):
        return "; ".join(filter(None, (said, to_do)))
    return said or "the flight does not show enough"


def _accelerometers(imus: Sequence[int]) -> str:
    if len(imus) == 1:
        return f"accelerometer {imus[0]}"
    return f"accelerometers {', '.join(map(str, imus[:-1]))} and {imus[-1]}"


def _asking(h: History) -> Iterator[tuple[int, Flight]]:
    """Accelerometers whose last calibrating flight was flown with what is in force, and asks."""
    for latest in h.vehicle.latest.imus:
        c = latest.calibration
        for flight in reversed(h.vehicle.counting or h.vehicle.flights):
            said = next((i for i in flight.record.imus if i.calibration.imu == c.imu), None)
            if said is None or said.calibration.status is not Status.CALIBRATED:
                continue
            then = said.calibration
            if said.asks and (then.in_force_scale, then.in_force_offset) == (
                c.in_force_scale,
                c.in_force_offset,
            ):
                yield c.imu, flight
            break


def shared_sentence(c: Common) -> str:
    """What a type shares, in one sentence."""
    s, u = c.shared, UNITS[c.unit]
    name = NAMES[c.name] + (" beside what is told" if c.unit == "m" else "")
    scatter = f"which scatter by {_rounded(s.between, s.sigma)}{u}"
    return (
        f"{c.of}: {name} {sized(Sized(s.mean, s.sigma, s.p_value), u)} on {s.count} vehicles, "
        f"{scatter if s.between else 'which scatter no more than their sigmas'}"
    )


def sized(x: Sized, unit: str) -> str:
    """``+0.123 ± 0.011 m/s²``."""
    return f"{_rounded(x.size, x.sigma, signed=True)} ± {_rounded(x.sigma, x.sigma)}{unit}"


def known(x: Sized) -> str:
    """A value and its sigma: ``0.9983 ± 0.0013``."""
    return f"{_rounded(x.size, x.sigma)} ± {_rounded(x.sigma, x.sigma)}"


def day(flight: Flight) -> str:
    """``2025-03-08``; empty where the recording does not say."""
    began = flight.record.provenance.began_unix_s
    return "" if began is None else datetime.fromtimestamp(began, UTC).strftime("%Y-%m-%d")


def _said(n: Number) -> Iterator[str]:
    name, unit = NAMES.get(n.name, n.name), UNITS[n.unit]
    for step in n.course.steps:
        yield (
            f"{name} stepped by {sized(step.sized, unit)} between "
            f"{_flight(n.flights[step.first])} and {_flight(n.flights[step.last + 1])}"
        )
    for odd in n.course.odd:
        flight = n.flights[odd.flight]
        last = " (the last flight: it erred, or something has changed since)"
        yield (
            f"{name} of {_flight(flight)} contradicts the others by {sized(odd.sized, unit)}"
            f"{last if odd.flight == len(n.flights) - 1 and len(n.flights) > 2 else ''}"
        )
    if n.course.drifts and n.course.trend is not None:
        yield f"{name} drifts by {sized(n.course.trend, unit)} a day"


def _merged(a: Accelerometer) -> Iterator[str]:
    if a.flights and a.why:
        yield a.why
    if a.merged is not None and a.merged.contradicted:
        yield f"contradicted by {_listed([a.flights[i] for i in a.merged.contradicted])}"


def _listed(flights: Sequence[Flight]) -> str:
    return ", ".join(_flight(f) for f in flights)


def _flight(flight: Flight) -> str:
    when = day(flight)
    return f"{flight.flown.name} ({when})" if when else flight.flown.name


def _rounded(value: float, sigma: float, *, signed: bool = False) -> str:
    """With two digits of the sigma."""
    if not math.isfinite(value):
        return "-"
    places = 3
    if math.isfinite(sigma) and sigma > 0.0:
        places = min(9, max(0, 1 - math.floor(math.log10(sigma))))
    value = round(value, places) + 0.0  # no minus before zero
    return f"{value:+.{places}f}" if signed else f"{value:.{places}f}"
