"""Plain words and readable numbers for the controlled vocabulary of effects."""

from __future__ import annotations

import math

from onboard.core.findings import Diagnosis, Effect, Quantity, Verdict

UNKNOWN = "not known"
DEGREE = math.pi / 180.0

HEADLINES = {
    Verdict.CLEAN: "Nothing is missing",
    Verdict.EXPLAINED: "Something was missing, and it was found",
    Verdict.PARTLY_EXPLAINED: "Something is missing, and a part of it was found",
    Verdict.UNEXPLAINED: "Something is missing, and nothing known explains it",
    Verdict.INSUFFICIENT: "This flight cannot tell",
}

VERDICTS: dict[Verdict, tuple[str, str]] = {
    Verdict.CLEAN: ("green", "Nothing is missing: six numbers and timing explain this flight."),
    Verdict.EXPLAINED: ("yellow", "Physics is missing from the model, and it was found."),
    Verdict.PARTLY_EXPLAINED: ("yellow", "Physics is missing; a part of it was found."),
    Verdict.UNEXPLAINED: ("red", "Something is missing, and nothing in the catalogue explains it."),
    Verdict.INSUFFICIENT: ("red", "This flight is too quiet to say."),
}
"""Colour and one line for terminals."""

EFFECTS = {
    "gps_latency": "GPS is late",
    "gps_smoothing": "GPS averages its velocity",
    "gps_lever_arm": "The GPS antenna is away from the IMU",
    "imu_delay": "Attitude and accelerometer are not simultaneous",
    "cross_axis": "The accelerometer's axes are not square",
    "mount_tilt": "The accelerometer is tilted against the attitude",
    "heading_error": "The heading is off",
    "heading_by_throttle": "The motors pull the compass",
    "temperature_drift": "The offset follows the temperature",
    "bias_ramp": "The offset grows with time",
    "bias_step": "The offset jumped",
    "scale_nonlinearity": "The scale changes with the load",
    "vibration_rectification": "Vibration shifts the offset",
    "throttle_coupling": "The throttle shifts the offset",
    "saturation": "The accelerometer hit its limit",
    "gps_fault": "GPS velocity was false for a while",
    "clock_skew": "The GPS and IMU clocks run at different rates",
    "gravity": "Gravity differs from the expected value",
    "load_flex": "The mount bends under load",
    "rotor_drag": "The rotors drag in the wind",
    "empirical": "An unnamed dependence on a measured signal",
}


TIMING = {
    "gps_delay_s": "GPS is late by",
    "gps_smoothing_window_s": "GPS averages over",
    "imu_delay_s": "attitude is late by",
}
DISTRUST = {
    "waiting": "nothing heard yet",
    "spoofed": "the receiver reports spoofing",
    "jammed": "the receiver reports jamming",
    "no_fix": "no 3D fix",
    "few_satellites": "too few satellites",
    "hdop": "satellites badly spread (HDOP)",
    "speed_accuracy": "speed too inaccurate",
    "gps_glitch": "velocity jumped (glitch)",
    "ekf_gps_glitch": "the autopilot reports a GPS glitch",
    "ekf_unhealthy": "the autopilot's state estimate is not ready",
    "stale": "no fresh GPS",
    "gps_gap": "a gap in GPS",
    "restarted": "the recording or the autopilot began anew",
    "configured_end": "the configured time is over",
    "end_of_data": "no more data",
}
"""Why GPS is not trusted."""


def effect_title(name: str) -> str:
    """The effect as a short sentence; unknown names read as words."""
    return EFFECTS.get(name, name.replace("_", " "))


def number(value: float, digits: int = 3) -> str:
    """``value`` with ``digits`` significant digits; words where it is not finite."""
    if not math.isfinite(value):
        return UNKNOWN
    if value == 0.0:
        return "0"
    places = digits - 1 - math.floor(math.log10(abs(value)))
    if places < 0 and abs(value) < 1e6:
        return f"{float(f'{value:.{digits}g}'):.0f}".replace("-", "−")
    if places < 0 or abs(value) < 1e-4:
        return f"{value:.{digits}g}".replace("-", "−")
    return f"{value:.{min(places, 7)}f}".replace("-", "−")


def fixed(value: float, places: int) -> str:
    """``value`` with ``places`` decimals; words where it is not finite."""
    return f"{value:.{places}f}".replace("-", "−") if math.isfinite(value) else UNKNOWN


def signed(value: float, places: int) -> str:
    """``value`` with its sign and ``places`` decimals; words where it is not finite."""
    return f"{value:+.{places}f}".replace("-", "−") if math.isfinite(value) else UNKNOWN


def seconds(value: float, sigma: float) -> str:
    """A time in ms with its sigma."""
    return quantity(Quantity(value, sigma, "s")) if math.isfinite(value) else UNKNOWN


def percent(share: float) -> str:
    """A share as per cent; words where it is not finite."""
    return f"{100.0 * share:.0f} %".replace("-", "−") if math.isfinite(share) else UNKNOWN


def with_sigma(value: float, sigma: float) -> str:
    """``value ± sigma``, the value to the second digit of sigma."""
    if not (math.isfinite(value) and math.isfinite(sigma)) or sigma <= 0.0:
        return number(value)
    places = 1 - math.floor(math.log10(sigma))
    if not 0 <= places <= 7:
        return f"{number(value)} ± {number(sigma, 2)}"
    return f"{value:.{places}f} ± {sigma:.{places}f}".replace("-", "−")


def quantity(q: Quantity) -> str:
    """Value, sigma and unit; seconds below one in ms, angles in degrees."""
    scale, unit = 1.0, q.unit
    if q.unit == "s" and abs(q.value) < 1.0:
        scale, unit = 1e3, "ms"
    elif q.unit.startswith("rad"):
        scale, unit = 1.0 / DEGREE, "°" + q.unit[3:]
    text = with_sigma(q.value * scale, q.sigma * scale)
    return f"{text} {unit}".rstrip(" -")


def strength(delta_bic: float) -> str:
    """Words for a difference of BIC, after Kass and Raftery (1995)."""
    if not math.isfinite(delta_bic):
        return "evidence not known"
    gain = -delta_bic
    if gain > 10.0:
        return "very strong evidence"
    if gain > 6.0:
        return "strong evidence"
    if gain > 2.0:
        return "some evidence"
    return "weak evidence"


def surely(effect: Effect, *, ambiguous: bool) -> str:
    """How sure one effect is, as a sentence."""
    text = strength(effect.delta_bic).capitalize()
    before, after = effect.held_out_before, effect.held_out_after
    if math.isfinite(before) and math.isfinite(after) and before > 0.0:
        less = 100.0 * (1.0 - after / before)
        change = "lowers" if less >= 0.0 else "raises"
        text += f"; it {change} the error on data not used in the fit by {abs(less):.0f} %"
    if ambiguous:
        text += "; but this flight cannot tell it from another effect"
    return text + "."


def sentences(diagnosis: Diagnosis) -> tuple[str, str, str]:
    """What is missing, how sure, what to change: three short paragraphs."""
    m = diagnosis.mismatch
    names = [effect_title(e.name) for e in diagnosis.effects]
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        return (
            "There is too little motion with trusted GPS to say what is missing.",
            "Not at all: no effect was accepted or ruled out.",
            diagnosis.note or "Fly again, with accelerations, turns and climbs.",
        )
    if names:
        missing = "; ".join(names) + "."
    elif diagnosis.verdict is Verdict.CLEAN:
        missing = "Scale, offset and timing explain this flight down to the noise."
    else:
        missing = "The residual is larger than noise, but no effect of the catalogue fits it."
    sure = "The residual could not be judged on data not used in the fit."
    if math.isfinite(m.held_out_before) and math.isfinite(m.held_out_after):
        sure = (
            f"On data not used in the fit, the error is {m.held_out_after:.2f} times the noise "
            f"(it was {m.held_out_before:.2f} with scale and offset only; about 1 is ideal)."
        )
    if diagnosis.ambiguous:
        sure += " Some effects could not be told apart, see below."
    cures = [e.cure for e in diagnosis.effects if e.cure]
    if cures:
        change = "; ".join(dict.fromkeys(c.rstrip(".") for c in cures)) + "."
    elif names:
        change = "No parameter cures what was found."
    elif diagnosis.verdict is Verdict.CLEAN:
        change = "Nothing beyond the calibration itself."
    else:
        change = "Look at where the residual lives, below, for a cause."
    return missing, sure, change
