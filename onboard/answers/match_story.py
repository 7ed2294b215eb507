"""A match as a story: one plain sentence for each effect, place, curve and manoeuvre."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from onboard.answers.match import Match
from onboard.answers.match_words import instead
from onboard.answers.words import (
    capital,
    fixed,
    listed,
    number,
    percent,
    unit_in_words,
)
from onboard.core.diagnosis.records import Verdict
from onboard.core.physics.catalogue import kind_of, title_of
from onboard.core.physics.finding import Where
from onboard.core.physics.wording import places
from onboard.core.vehicle.limits import SURE
from onboard.core.vehicle.places import AXES
from onboard.core.vehicle.records import Compared, Difference, NotTestable, sigma_along

Values = Mapping[str, Compared]
SEVERITIES = {
    Verdict.CLEAN: "good",
    Verdict.EXPLAINED: "info",
    Verdict.PARTLY_EXPLAINED: "warning",
    Verdict.UNEXPLAINED: "error",
    Verdict.INSUFFICIENT: "warning",
}
AXIS_WORDS = {
    "body_x": "forward and backward",
    "body_y": "to the sides",
    "body_z": "up and down",
    "x": "Forward and backward (x)",
    "y": "To the sides (y)",
    "z": "Up and down (z)",
    AXES[-1]: "in the airspeed",
}
REGIME_WORDS = {"fast": "fast flight", "slow": "slow flight"}
ALIKE: Final = 0.005
"""Share by which numbers must differ to be said to: less would be said as 0 % [bound]."""


def whole(value: float, sigma: float, unit: str = "") -> str:
    """A number with its sigma to the first digit of that, and unit, as people read it."""
    if not math.isfinite(sigma) or sigma <= 0.0:
        return f"{number(value)} {unit_in_words(unit)}".rstrip()
    digits = places(sigma)
    return f"{fixed(value, digits)} ± {fixed(sigma, digits)} {unit_in_words(unit)}".rstrip()


def wind_from(north: float, east: float) -> float:
    """Degrees that a wind towards (north, east) comes from."""
    return math.degrees(math.atan2(-east, -north)) % 360.0


def sentence(d: Difference) -> str:
    """What one effect is and how large, for a pilot."""
    said = _alone(d)
    others = instead(d)
    if not others:
        return said
    more = f"or it is {' or '.join(others)}: this flight does not tell which."
    return f"{said.removesuffix('.')}; {more}"


def _alone(d: Difference) -> str:
    """The same without what it may be in its place."""
    say = SENTENCES.get(d.name)
    if say is not None and d.level == "vehicle":
        try:
            return say(d.values)
        except KeyError:  # an effect with other numbers than these
            pass
    if d.name == "gps_latency" and set(d.values) == {"delay"}:
        return _latency(d.values["delay"])
    none = not any(v.simulation for v in d.values.values())
    sizes = [
        f"{key.replace('_', ' ')} {whole(v.real, v.sigma, v.unit)}"
        + ("" if none else f" (simulation {whole(v.simulation, math.nan, v.unit)})")
        for key, v in d.values.items()
    ]
    known = kind_of(d.name) is not None
    title = title_of(d.name) if known else capital(d.name.replace("_", " "))
    if not sizes:
        return f"{title}."
    return f"{title}: {listed(sizes)}{'; nothing of it in the simulation' if none else ''}."


def _latency(delay: Compared) -> str:
    """A receiver may be later than the simulation's, less late, or ahead of its stamps."""
    theirs = f"the simulation's is {number(1e3 * delay.simulation)} ms late"
    size = whole(1e3 * abs(delay.real), 1e3 * delay.sigma, "ms")
    if delay.real < 0.0:
        return f"GPS is {size} ahead of its stamps; {theirs}."
    less = "" if delay.real > delay.simulation else "only "
    return f"GPS is {less}{size} late; {theirs}."


def _times(value: Compared) -> str:
    """How the recording's number stands to the simulation's."""
    if not value.simulation or value.real / value.simulation <= 0.0:
        return "unlike"
    ratio = value.real / value.simulation
    if ratio >= 1.95:
        return f"{ratio:.1f} times as much as"
    if ratio > 1.0:
        return f"{100.0 * (ratio - 1.0):.0f} % more than"
    return f"{100.0 * (1.0 - ratio):.0f} % less than"


def _against(value: Compared) -> str:
    return f"{number(value.simulation)} in the simulation"


def _wind(v: Values) -> str:
    north, east = v["north"], v["east"]
    speed = math.hypot(north.real, east.real)
    sigma = sigma_along(north.real, east.real, north.sigma, east.sigma)
    said = f"The wind was {whole(speed, sigma, 'm/s')} from {_from(north.real, east.real)}"
    still = math.hypot(north.simulation, east.simulation)
    if still < 0.05:
        return f"{said}; the simulation's air stands still."
    theirs = f"{still:.1f} m/s from {_from(north.simulation, east.simulation)}"
    return f"{said}; the simulation's was {theirs}."


def _from(north: float, east: float) -> str:
    return f"{wind_from(north, east):.0f}°"


def _profile(v: Values) -> str:
    p = v["exponent"]
    theirs = "does not" if p.simulation == 0.0 else f"has {number(p.simulation)}"
    size = whole(p.real, p.sigma)
    return (
        f"The wind grows with height (as height to the power {size}); the simulation's {theirs}. "
        f"Four times as high, it is {4.0**p.real:.1f} times as strong."
    )


def _gusts(v: Values) -> str:
    rms = v["rms"]
    theirs = f"has {number(rms.simulation, 2)} m/s" if rms.simulation else "is smooth"
    size = whole(rms.real, rms.sigma, "m/s")
    return f"Gusts of {size} (RMS of a component, below 5 Hz); the simulation's air {theirs}."


def _rotor_drag(v: Values) -> str:
    c = v["mcoef"]
    return (
        f"Moving air across the rotors brakes {_times(c)} in the simulation: "
        f"{whole(c.real, c.sigma)} m/s² for each m/s, {_against(c)}."
    )


def _body_drag(v: Values) -> str:
    areas = {axis: v[f"area_by_mass_{axis}"] for axis in "xy"}
    hows = {
        axis: f"{_times(a)} in the simulation" if a.real > SURE * a.sigma else "not at all"
        for axis, a in areas.items()
    }
    sizes = [f"{axis} {whole(a.real, a.sigma)} m²/kg" for axis, a in areas.items()]
    how = f"{hows['x']} forward and {hows['y']} sideways"
    if hows["x"] == hows["y"]:
        how = f"{hows['x']}, forward and sideways"
    return f"The body brakes {how} (drag area by mass: {listed(sizes)})."


def _thrust_scale(v: Values) -> str:
    r = v["ratio"]
    way = "more" if r.real > r.simulation else "less"
    size = 100.0 * abs(r.real / r.simulation - 1.0)
    spread = 100.0 * r.sigma / r.simulation
    return (
        f"The same command gives {whole(size, spread, '%')} {way} thrust for the vehicle's weight "
        "than in the simulation."
    )


def _thrust_curve(v: Values) -> str:
    e = v["expo"]
    bent = "straighter" if abs(e.real) < abs(e.simulation) else "more bent"
    return (
        f"Thrust over command is {bent} than in the simulation: expo {whole(e.real, e.sigma)}, "
        f"{_against(e)} (0 is a straight line, 1 a square)."
    )


def _sag(v: Values) -> str:
    e = v["exponent"]
    said = f"Thrust falls with the battery's voltage to the power {whole(e.real, e.sigma)}"
    low = v.get("lowest")
    if low is not None:
        said += f"; the voltage went down to {low.real:.1f} V from {low.simulation:.1f} V"
    return f"{said}. The simulation's battery stays full."


def _lag(v: Values) -> str:
    t = v["time_constant"]
    return (
        f"Thrust follows the command {whole(1e3 * t.real, 1e3 * t.sigma, 'ms')} late; "
        f"{number(1e3 * t.simulation, 2)} ms in the simulation."
    )


def _tilt(v: Values) -> str:
    parts = []
    for axis, ways in (("x", ("forward", "backward")), ("y", ("to the right", "to the left"))):
        t = v[axis]
        if abs(t.real) > SURE * t.sigma:
            size = whole(math.degrees(abs(t.real)), math.degrees(t.sigma))
            parts.append(f"{size}° {ways[0 if t.real > 0.0 else 1]}")
    return (
        f"The rotors do not pull straight up: they lean {listed(parts) if parts else 'a little'}."
    )


def _ground(v: Values) -> str:
    g = v["gain"]
    return f"Near the ground the rotors lift more: gain {whole(g.real, g.sigma)}, {_against(g)}."


def _density(v: Values) -> str:
    e = v["excess"]
    way = "denser" if e.real > 0.0 else "thinner"
    size = whole(100.0 * abs(e.real), 100.0 * e.sigma, "%")
    return f"The air was {size} {way} than that of the standard atmosphere."


def _change(what: str) -> Callable[[Values], str]:
    def say(v: Values) -> str:
        r, t = v["ratio"], v["moment"]
        way = "more" if r.real > 1.0 else "less"
        size = whole(100.0 * abs(r.real - 1.0), 100.0 * r.sigma, "%")
        when = whole(t.real, t.sigma, "s")
        return f"{what} changes in flight, all at once: {size} {way} from {when} on."

    return say


def _coefficients(what: str, names: Mapping[str, str]) -> Callable[[Values], str]:
    def say(v: Values) -> str:
        told = [
            f"{meaning} {whole(v[key].real, v[key].sigma)}, {_times(v[key])} "
            f"the simulation's {number(v[key].simulation)}"
            for key, meaning in names.items()
            if key in v and _apart(v[key])
        ]
        return f"{what}: {listed(told)}." if told else f"{what}."

    return say


def _apart(v: Compared) -> bool:
    return abs(v.real - v.simulation) > max(SURE * v.sigma, ALIKE * abs(v.simulation))


def _airspeed(v: Values) -> str:
    s = v["over_equivalent"]
    way = "less" if s.real < s.simulation else "more"
    size = 100.0 * abs(s.real / s.simulation - 1.0)
    return (
        f"The airspeed sensor reads {whole(size, 100.0 * s.sigma / s.simulation, '%')} {way} "
        "than the simulation's."
    )


SENTENCES: Mapping[str, Callable[[Values], str]] = {
    "wind": _wind,
    "wind_profile": _profile,
    "turbulence": _gusts,
    "rotor_drag": _rotor_drag,
    "body_drag": _body_drag,
    "thrust_scale": _thrust_scale,
    "thrust_curve": _thrust_curve,
    "voltage_sag": _sag,
    "motor_lag": _lag,
    "thrust_tilt": _tilt,
    "ground_effect": _ground,
    "air_density": _density,
    "mass_change": _change("The vehicle's mass"),
    "thrust_change": _change("The thrust of the same command"),
    "lift": _coefficients(
        "The wing's lift differs from the simulation's",
        {"c_lift_0": "at zero angle", "c_lift_a": "per radian"},
    ),
    "drag": _coefficients(
        "The drag differs from the simulation's",
        {"c_drag_p": "profile drag", "induced": "drag by lift"},
    ),
    "side_force": _coefficients(
        "The side force differs from the simulation's",
        {"c_y_b": "per radian of sideslip", "c_y_deltar": "at full rudder"},
    ),
    "airspeed_scale": _airspeed,
}


def how_sure(match: Match) -> str:
    """The proof in one sentence: flight that the fit has not seen."""
    pairs = [(axis, m.before, m.after) for axis, m in match.vehicle.mismatch.items()]
    known = [(a, b) for _, a, b in pairs if math.isfinite(a) and math.isfinite(b)]
    if not known:
        return "There was too little flight to prove anything."
    before = math.sqrt(sum(a * a for a, _ in known))
    after = math.sqrt(sum(b * b for _, b in known))
    if not match.effects:
        return f"On flight that was not used, the force is predicted to {number(after, 2)} m/s²."
    return (
        "On flight that was not used in the fit, the error of the predicted force falls from "
        f"{number(before, 2)} to {number(after, 2)} m/s²."
    )


def where(p: Where, speed: float = math.nan) -> str:
    """Where an effect acts: time, axis, kind of flight, speed, share."""
    span = f"{fixed(p.start_s, 0)} to {fixed(p.end_s, 0)} s"
    regime = REGIME_WORDS.get(p.regime, p.regime)
    pace = f" at {speed:.0f} m/s" if math.isfinite(speed) else ""
    axis = AXIS_WORDS.get(p.axis, p.axis.replace("_", " "))
    share = f", {percent(p.share)} of the effect" if math.isfinite(p.share) else ""
    return f"{span}: {regime}{pace}, mostly {axis}{share}"


def to_fly(untested: Sequence[NotTestable]) -> list[tuple[str, list[str]]]:
    """Manoeuvres that would show what this flight did not, with what they would show."""
    out: dict[str, list[str]] = {}
    for n in untested:
        _, _, manoeuvre = n.why.partition("; ")
        if manoeuvre:
            out.setdefault(capital(manoeuvre), []).append(n.name)
    return list(out.items())


def reason(n: NotTestable) -> str:
    """Why it could not be tested, without the manoeuvre."""
    return n.why.partition("; ")[0]
