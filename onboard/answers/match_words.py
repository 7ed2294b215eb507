"""A match in sentences: the same on the terminal and in a report."""

from __future__ import annotations

import math

from onboard.answers.match import Match
from onboard.core.diagnosis.records import Verdict
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.wind import FLOOR_M_S
from onboard.core.vehicle.records import Compared, Difference, WindEstimate

TITLES = {
    "wind": "wind",
    "wind_profile": "wind that grows with height",
    "turbulence": "turbulence",
    "rotor_drag": "drag of the rotors",
    "body_drag": "drag of the body",
    "thrust_scale": "thrust by mass",
    "thrust_curve": "curve of thrust over command",
    "voltage_sag": "battery that gives way",
    "motor_lag": "motors that answer late",
    "output_delay": "outputs that are logged late",
    "thrust_tilt": "direction of the thrust",
    "ground_effect": "ground effect",
    "air_density": "density of the air",
    "mass_change": "mass that changes in flight",
    "thrust_change": "thrust that changes in flight",
    "lift": "lift",
    "drag": "drag",
    "side_force": "side force",
    "airspeed_scale": "scale of the airspeed",
}
HEADLINES = {
    Verdict.CLEAN: "The simulation's airframe flies like the recording",
    Verdict.EXPLAINED: "What differs is explained",
    Verdict.PARTLY_EXPLAINED: "Part of what differs is explained",
    Verdict.UNEXPLAINED: "Something differs that no effect of the catalogue explains",
    Verdict.INSUFFICIENT: "This recording says too little",
}
COLOURS = {
    Verdict.CLEAN: "green",
    Verdict.EXPLAINED: "cyan",
    Verdict.PARTLY_EXPLAINED: "yellow",
    Verdict.UNEXPLAINED: "red",
    Verdict.INSUFFICIENT: "yellow",
}


def title(name: str) -> str:
    """An effect for people."""
    return TITLES.get(name, name.replace("_", " "))


def named(d: Difference) -> str:
    """An effect for people, with those that this flight does not tell from it."""
    return " or ".join([title(d.name), *instead(d)])


def instead(d: Difference) -> list[str]:
    """What it may be in its place, for people; of a sensor's effect its own card says it."""
    return [title(name) for name in d.rivals] if d.level == "vehicle" else []


def headline(match: Match) -> str:
    """The verdict as a sentence without its full stop."""
    names = [named(d) for d in match.effects]
    said = HEADLINES[match.verdict]
    return f"{said}: {', '.join(names)}" if names else said


def number(value: float, sigma: float) -> str:
    """A number to the digit that its sigma supports."""
    if not math.isfinite(value):
        return "-"
    if math.isfinite(sigma) and sigma > 0.0:
        digits = max(0, min(5, 1 - math.floor(math.log10(sigma))))
    elif value == 0.0:
        digits = 1
    else:
        digits = max(0, min(5, 2 - math.floor(math.log10(abs(value)))))
    return f"{value:.{digits}f}"


def compared(value: Compared) -> tuple[str, str, str, str]:
    """Simulation, recording, sigma, unit, as words of one table."""
    digits = value.sigma
    sigma = number(digits, digits) if math.isfinite(digits) and digits > 0.0 else "-"
    unit = "" if value.unit == "1" else value.unit
    return number(value.simulation, digits), number(value.real, digits), sigma, unit


def proof(d: Difference) -> str:
    """The held-out residual without and with an effect."""
    if not (math.isfinite(d.held_out_before) and math.isfinite(d.held_out_after)):
        return ""
    return f"{d.held_out_before:.3f} -> {d.held_out_after:.3f}"


def proof_unit(d: Difference) -> str:
    """Of an effect of the vehicle: along the axes that show it, which may be the airspeed's."""
    return "m/s" if d.name == AirspeedScale.name else "m/s^2"


def wind_sentence(match: Match) -> str:
    """The wind of the flight; empty where nothing is known."""
    return "" if match.vehicle.wind is None else blown(match.vehicle.wind)


def blown(wind: WindEstimate) -> str:
    """A wind, where it comes from, and how sure that is."""
    speed = wind.speed
    # What a flight does not tell from a calm need not be one, and has no direction to err along.
    sigma = math.hypot(wind.sigma_north, wind.sigma_east)
    if speed < 3.0 * sigma or speed < FLOOR_M_S:
        told = "calm" if 3.0 * sigma < FLOOR_M_S else "perhaps calm"
        return f"{told}: {speed:.2f} ± {sigma:.2f} m/s"
    origin = math.degrees(math.atan2(-wind.east, -wind.north)) % 360.0
    said = f"{speed:.2f} ± {wind.sigma_along:.2f} m/s from {origin:.0f}°"
    said += f" at a height of {wind.height:.0f} m"
    if wind.profile_exponent is not None:
        said += f"; it grows with the height to the power {wind.profile_exponent:.2f}"
    if wind.turbulence_rms is not None:
        said += f", gusts of {wind.turbulence_rms:.1f} m/s RMS"
    return said
