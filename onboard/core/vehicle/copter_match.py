"""A copter's recording against an airframe: the record of the vehicle level."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.agreement import ToldAlone, told_alone
from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.airframe_file import DIGITS, numbers_of_file
from onboard.core.vehicle.battery import fitted_battery
from onboard.core.vehicle.between import spread
from onboard.core.vehicle.copter import (
    Outputs,
    Variant,
    copter_missing,
    copter_model,
    full_voltage,
)
from onboard.core.vehicle.copter_curves import copter_curves
from onboard.core.vehicle.effects.air_density import AirDensity
from onboard.core.vehicle.effects.ground_effect import GroundEffect
from onboard.core.vehicle.effects.mass_change import Change, MassChange, ThrustChange
from onboard.core.vehicle.effects.motor_lag import MotorLag
from onboard.core.vehicle.effects.own_motion import PLAUSIBLE as MOVING
from onboard.core.vehicle.effects.rotor_wind import PLAUSIBLE as THROUGH
from onboard.core.vehicle.effects.thrust_curve import ThrustCurve
from onboard.core.vehicle.effects.thrust_scale import ThrustScale
from onboard.core.vehicle.effects.voltage_sag import VoltageSag
from onboard.core.vehicle.effects.wind_change import CHANGE
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.fit import fitted
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import (
    AMBIGUOUS,
    APART,
    FEWEST_FLIGHTS,
    MOST_BEYOND,
    RECEIVER_M_S,
)
from onboard.core.vehicle.match_record import differences, not_testable_of, vehicle_match
from onboard.core.vehicle.matching import Matched, held_out, likelier, matched
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.noise import rms
from onboard.core.vehicle.records import Compared, Difference, VehicleMatch
from onboard.core.vehicle.said import change_in
from onboard.core.vehicle.signals import Signals
from onboard.core.vehicle.structure import structures
from onboard.core.vehicle.sudden import CHANGES, change_of, wind_instead
from onboard.core.vehicle.turbulence import turbulence_of

MANOEUVRES = {
    e.name: e.manoeuvre
    for e in (
        *(AirDensity, GroundEffect, MotorLag, ThrustCurve, ThrustScale, VoltageSag, WindProfile),
        *(MassChange, ThrustChange),
    )
}

RIVAL_FORMS: tuple[tuple[str, dict[str, Any]], ...] = (
    # ArduPilot's wind is constant from 60 m on, the open air's is not.
    ("wind_profile", {"profile_top": math.inf}),
    # ArduPilot's rotors that lean drag more on one axis.
    ("thrust_tilt", {"by_components": True}),
)
"""Where an effect was found, another form of the model; see :func:`_better`."""
NOTHING_SHOWN = "this flight would have shown no effect at any plausible size"


def match_copter(
    flight: Flight, signals: Signals, frame: CopterAirframe, force_sigma: Array
) -> VehicleMatch:
    """What this flight has that the airframe lacks.

    Args:
        flight: with commands, if the recording has outputs.
        signals: of the vehicle.
        frame: to compare with.
        force_sigma: (3,) what the sensor level leaves unknown of the force, m/s^2.
    """
    told = told_alone(
        flight, force_sigma, lambda of, sigma: _found(of, frame, sigma, Variant(among=True))
    )
    flight, force_sigma = told.counting(flight), told.sigmas(force_sigma)
    found = _found(flight, frame, force_sigma, Variant(change=_change(told)))
    nothing_testable = set(found.choices.names) <= set(found.chosen.untestable)
    if nothing_testable and not found.handed_back:
        # Numbers that nobody knows are nothing that a flight could be closer with.
        found = replace(found, held=found.nominal)
    effects = tuple(
        _with_battery(d, found.model.flight, signals, frame) for d in differences(found)
    )
    absent = copter_missing(flight, frame)
    untested = not_testable_of(found, absent, MANOEUVRES)
    match = vehicle_match(
        found,
        "copter",
        untested,
        effects=effects,
        frame=_frame(found, signals, frame),
        curves=copter_curves(found, frame, signals),
    )
    if nothing_testable:
        # What is left of a force that nothing could have explained is no evidence of gusts.
        nothing = "" if found.handed_back else NOTHING_SHOWN
        note = "; ".join(filter(None, (nothing, match.note)))
        match = replace(match, effects=(), shown=False, note=note)
    return told.beside(match)


def _found(flight: Flight, frame: CopterAirframe, force_sigma: Array, given: Variant) -> Matched:
    """What is found with the likeliest of the model's forms, beginning with this one."""
    apart = _apart(flight, frame, force_sigma)
    plain = replace(given, moving=apart.moving, through=apart.through)
    variant, found = _with_change(flight, frame, force_sigma, plain)
    seen = max(found.turbulence.rms, RECEIVER_M_S)
    answering = replace(variant, gusts=seen)
    fit = fitted(copter_model(flight, frame, force_sigma, answering))
    air = turbulence_of(fit)
    # A plain fit that took the answers for the cause has too little drag to show a gust.
    if found.turbulence.answered or air.answered:
        variant = replace(answering, gusts=max(air.rms, RECEIVER_M_S))
        model = copter_model(flight, frame, force_sigma, variant)
        found = matched(model, fitted(model, fit.theta, fit.noise))
    for name, change in RIVAL_FORMS:
        if name in found.chosen.effects:
            other_form = replace(variant, **change)
            other = matched(copter_model(flight, frame, force_sigma, other_form))
            if _better(other, found):
                variant, found = other_form, other
    if len(variant.beyond) < MOST_BEYOND and (more := structures(found.fit, variant.beyond)):
        # All else is asked anew beside it: what looked like gusts may have been this.
        beyond = (*variant.beyond, more[0].key)
        more_of_it = replace(given, beyond=beyond, wind_from=variant.wind_from)
        return _found(flight, frame, force_sigma, more_of_it)
    return found


def _change(told: ToldAlone) -> Change | None:
    """The change that explains most, of those in flights that count; None if none has one.

    It is one within a flight: of a difference between flights it is asked in none.
    """
    changed = [
        (sum(m.chosen.gains.get(n, 0.0) for n in CHANGES), change)
        for m in told.of_counted
        if (change := change_in(m.model.effects)) is not None
    ]
    return max(changed, key=lambda c: c[0])[1] if changed else None


def _apart(flight: Flight, frame: CopterAirframe, force_sigma: Array) -> Variant:
    """By how much flights differ in what each has for itself; none where they are too few to tell.

    That is the force that goes with a flight's own motion, and the wind that its thrust shows.
    """
    if flight.parts < FEWEST_FLIGHTS:
        return Variant()
    most = Variant(moving=MOVING, through=THROUGH)
    fit = likelier(copter_model(flight, frame, force_sigma, most))

    def likeliest(prefix: str, prior: float) -> float:
        places = [k for k, u in enumerate(fit.model.unknowns) if u.name.startswith(prefix)]
        if not places:
            return 0.0
        return spread(fit.theta[places], fit.covariance[np.ix_(places, places)], prior)

    return Variant(moving=likeliest("moving_", MOVING), through=likeliest("through_", THROUGH))


def _with_change(
    flight: Flight, frame: CopterAirframe, force_sigma: Array, plain: Variant
) -> tuple[Variant, Matched]:
    """The model, with a sudden change of mass or thrust where one is needed, and what it finds.

    Before anything else is asked: whatever else may be free would be bent to take the change in.
    Of several flights it is that of ``plain``.
    """

    def blowing(variant: Variant) -> ForceModel:
        return copter_model(flight, frame, force_sigma, variant)

    def model(change: Change | None) -> ForceModel:
        return blowing(replace(plain, change=change))

    first, change = None, plain.change
    if flight.parts == 1:
        first = likelier(model(None))
        change = change_of(first, model)
    if first is not None and change is not None and CHANGE not in plain.beyond:
        gone = wind_instead(first, change, model, lambda t: blowing(_turning(plain, t)))
        if gone is not None:
            # The vehicle may have changed as well: that is asked anew.
            return _with_change(flight, frame, force_sigma, _turning(plain, gone))
    if change is not None:
        found = matched(model(change))
        if set(CHANGES) & set(found.chosen.effects):
            # Either of the two vehicles that flew may be the airframe's: that which needs less.
            since = replace(change, since=True)
            other = matched(model(since))
            if _better(other, found):
                change, found = since, other
            return replace(plain, change=change), found
    return replace(plain, change=None), matched(model(None), first)


def _turning(plain: Variant, moment: float) -> Variant:
    """The same in a wind that becomes another at a moment, s."""
    return replace(plain, change=None, wind_from=moment, beyond=(*plain.beyond, CHANGE))


def _better(other: Matched, found: Matched) -> bool:
    """Whether another form of the model predicts better; of two alike, whether it needs less.

    Alike are forms whose log-likelihoods on flight that was not used differ by less than
    :data:`AMBIGUOUS`, with the same effects in both.  Rotors that lean as far ahead as aside drag
    alike in all forms, if there is less of the drag: then it is the form that needs no other drag.
    """
    fit = found.fit
    names = tuple(dict.fromkeys((*found.chosen.effects, *other.chosen.effects)))
    before, after = (rms(held_out(m.choices, names)) for m in (found, other))
    rows = sum(block.rows for block in fit.blocks) / fit.scale
    ahead = 2.0 * rows * math.log(before / after)
    if abs(ahead) > AMBIGUOUS:
        return ahead > 0.0
    return len(other.chosen.effects) < len(found.chosen.effects)


def _with_battery(
    d: Difference, flight: Flight, signals: Signals, frame: CopterAirframe
) -> Difference:
    """Sag with the battery that would give way like this."""
    if d.name != "voltage_sag":
        return d
    volts = flight.battery[:, 0]
    values = dict(d.values)
    values["lowest"] = Compared(frame.maxVoltage, float(np.min(volts)), 0.0, "V")
    its = _battery(signals, flight, frame)
    if its is not None:
        nan = float("nan")
        values["capacity"] = Compared(frame.battCapacityAh, its[0], nan, "Ah")
        values["resistance"] = Compared(frame.refBatRes, its[1], nan, "ohm")
    return replace(d, values=values)


def _battery(signals: Signals, flight: Flight, frame: CopterAirframe) -> tuple[float, float] | None:
    """Capacity and resistance from power-up to the end of the flight."""
    b = signals.battery
    if not len(b) or b.x.shape[1] < 2:
        return None
    before_end = (b.t <= flight.t[-1]) & (b.x[:, 0] > 1.0)
    fit = fitted_battery(
        b.t[before_end],
        b.x[before_end, 0],
        b.x[before_end, 1],
        full_voltage(flight, frame),
    )
    return None if fit is None else (fit.capacity, fit.resistance)


def _frame(m: Matched, signals: Signals, frame: CopterAirframe) -> dict[str, float | list[float]]:
    """Keys of a frame file that flies like the recording: the given frame, and what was found."""
    theta, model = m.fit.theta, m.model
    names = set(m.handed_back)
    made = frame
    if "thrust_scale" in names:
        ratio = math.exp(float(theta[model.indices("thrust_scale")[0]]))
        made = replace(made, hoverThrOut=made.hoverThrOut / ratio)
    if "thrust_curve" in names:
        made = replace(made, propExpo=float(theta[model.indices("thrust_curve")[0]]))
    if names & {"thrust_scale", "thrust_curve", "voltage_sag"}:
        made = _with_inflow(m, made)
        made = _with_ranges(made, signals)
    if names & {"rotor_drag", "body_drag"}:
        c_m = float(theta[model.indices("rotor_drag")[0]])
        made = made.with_drag(c_m, float(np.mean(theta[model.indices("body_drag")])))
    if "voltage_sag" in names:
        battery = _battery(signals, model.flight, frame)
        if battery is not None:
            made = replace(made, battCapacityAh=battery[0], refBatRes=battery[1])
        made = replace(made, maxVoltage=full_voltage(model.flight, frame))
    out = numbers_of_file(made)
    if "thrust_tilt" in names:
        x, y = theta[model.indices("thrust_tilt")].tolist()
        for k in range(int(made.num_motors)):
            out[f"motor{k + 1}_vector"] = [round(x, DIGITS), round(y, DIGITS), -1.0]
    return out


def _with_inflow(m: Matched, frame: CopterAirframe) -> CopterAirframe:
    """The reference current whose outflow gives the inflow that was found, if it surely differs."""
    k = m.model.index("inflow")
    found, sigma = float(m.fit.theta[k]), float(m.fit.sigma[k])
    if found <= 0.0 or abs(found - frame.inflow) < APART * sigma:
        return frame
    return replace(frame, refCurrent=frame.refCurrent * math.sqrt(frame.inflow / found))


def _with_ranges(frame: CopterAirframe, signals: Signals) -> CopterAirframe:
    """The vehicle's own range of outputs, where it has one."""
    get = signals.parameters.get
    low, high = get("MOT_PWM_MIN", 0.0), get("MOT_PWM_MAX", 0.0)
    if 0.0 < low < high:
        frame = replace(frame, pwmMin=low, pwmMax=high)
    least, most = get("MOT_SPIN_MIN", frame.spin_min), get("MOT_SPIN_MAX", frame.spin_max)
    if least < most and Outputs.of(signals, frame).motors:
        frame = replace(frame, spin_min=least, spin_max=most)
    return frame
