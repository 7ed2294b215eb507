"""A plane's recording against an airframe: the record of the vehicle level."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.agreement import told_alone
from onboard.core.vehicle.air import SIDE, UP
from onboard.core.vehicle.airframe_file import numbers_of_file
from onboard.core.vehicle.effects.air_density import AirDensity
from onboard.core.vehicle.effects.airspeed_scale import AirspeedScale
from onboard.core.vehicle.effects.beyond_wings import WINGS
from onboard.core.vehicle.effects.propulsion import Propulsion
from onboard.core.vehicle.effects.side_force import SideForce
from onboard.core.vehicle.effects.wind_change import CHANGE, EVERY_S
from onboard.core.vehicle.effects.wind_profile import WindProfile
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.front import front_of, on_both_sides
from onboard.core.vehicle.limits import (
    FEWEST_STEPS,
    MOST_BEYOND,
    RECEIVER_M_S,
    SURE,
    TOLD_S,
)
from onboard.core.vehicle.match_record import differences, not_testable_of, vehicle_match
from onboard.core.vehicle.matching import Matched, likelier, matched
from onboard.core.vehicle.model import ForceModel
from onboard.core.vehicle.motion_errors import errors_of
from onboard.core.vehicle.noise import rms
from onboard.core.vehicle.plane import has_airspeed, plane_missing, plane_model, unstalled
from onboard.core.vehicle.plane_airframe import PlaneAirframe
from onboard.core.vehicle.plane_curves import plane_curves
from onboard.core.vehicle.records import VehicleMatch
from onboard.core.vehicle.structure import structures

LEAST_INDUCED = 0.01
"""Of the file's induced drag, that a file may have where there is none [use]."""
FALSE_SENSOR = (
    "the airspeed sensor reads what the force of the wing contradicts, and none of it is used"
)
MANOEUVRES = {
    e.name: e.manoeuvre for e in (AirDensity, AirspeedScale, Propulsion, SideForce, WindProfile)
}


def match_plane(flight: Flight, frame: PlaneAirframe, force_sigma: Array) -> VehicleMatch | None:
    """What this flight has that the airframe lacks; None if it never flew as a plane does.

    Args:
        flight: with throttle and surfaces, if the recording has outputs.
        frame: to compare with.
        force_sigma: (3,) what the sensor level leaves unknown of the force, m/s^2.
    """
    told = told_alone(flight, force_sigma, lambda of, sigma: _found(of, frame, sigma))
    found = _found(told.counting(flight), frame, told.sigmas(force_sigma))
    if found is None:
        return None
    effects = differences(found)
    silenced = has_airspeed(flight) and not has_airspeed(found.model.flight)
    absent = plane_missing(found.model.flight)
    if silenced:
        absent[AirspeedScale.name] = "the sensor reads what the force contradicts"
    untested = not_testable_of(found, absent, MANOEUVRES)
    match = vehicle_match(
        found,
        "plane",
        untested,
        effects=effects,
        frame=_coefficients(found, frame),
        curves=plane_curves(found, frame),
    )
    said = (
        match.note,
        FALSE_SENSOR if silenced else "",
        _stalled(told.counting(flight), frame, found),
    )
    match = replace(match, note="; ".join(filter(None, said)))
    return told.beside(match)


def _stalled(flight: Flight, frame: PlaneAirframe, found: Matched) -> str:
    """That flight was left out in which the wing has another law; empty where there is none."""
    winds = found.fit.theta[found.model.indices("wind")].reshape(-1, 2)
    seconds = flight.step_s * (len(flight) - len(unstalled(flight, frame, winds)))
    said = f"the wing is stalled, or nearly so, for {seconds:.0f} s, of which nothing is told"
    return said if seconds >= TOLD_S else ""


@dataclass(frozen=True, slots=True)
class _Form:
    """What a model has beside the effects.

    Attributes:
        beyond: keys of what repeats with the motion, or with time, and is no effect's.
        wind_from: when the wind of a single flight became another at once, s; None: never.
    """

    beyond: tuple[str, ...] = ()
    wind_from: float | None = None

    def model(
        self, flight: Flight, frame: PlaneAirframe, sigma: Array, *, held: bool = False
    ) -> ForceModel:
        """Of this form."""
        return plane_model(flight, frame, sigma, self.beyond, held=held, wind_from=self.wind_from)

    def turning(self, moment: float | None) -> _Form:
        """The same in a wind that becomes another, at a moment, s, or over minutes."""
        return _Form((*self.beyond, CHANGE), moment)


def _found(
    flight: Flight, frame: PlaneAirframe, force_sigma: Array, form: _Form | None = None
) -> Matched | None:
    """What is found in flight that is not stalled; None if there is too little."""
    form = form or _Form()
    flying = unstalled(flight, frame, np.zeros((flight.parts, 2)))
    if len(flying) < FEWEST_STEPS:
        return None
    blown, first = _with_front(flying, frame, force_sigma, form)
    found = matched(blown.model(flying, frame, force_sigma), first)
    if blown is form or on_both_sides(found.model.flight, blown.wind_from):
        form = blown
    else:  # what told of it was no part of the model, and has been left out since
        found = matched(form.model(flying, frame, force_sigma))
    places = found.model.indices("wind")
    winds = found.fit.theta[places].reshape(-1, 2)
    flying = unstalled(flight, frame, winds)
    if len(flying) >= FEWEST_STEPS and float(np.max(np.linalg.norm(winds, axis=1))) > 1.0:
        # What was stalled could only be told with the wind.
        found = matched(form.model(flying, frame, force_sigma))
    found = _slipping(found, flying, frame, force_sigma, form)
    more = structures(
        found.plain or found.fit, form.beyond, WINGS, answering=found.fit.turned is not None
    )
    if more and len(form.beyond) < MOST_BEYOND:
        # All else is asked anew beside it: what looked like gusts may have been this.
        wider = replace(form, beyond=(*form.beyond, more[0].key))
        return _found(flight, frame, force_sigma, wider)
    if _false(found):
        return _found(_deaf(flight), frame, force_sigma)
    return found


def _with_front(
    flying: Flight, frame: PlaneAirframe, sigma: Array, form: _Form
) -> tuple[_Form, Fit]:
    """The form with a wind that becomes another at once, where it does, and its likelier fit.

    Before anything else is asked, as a change of a copter is: all else would be bent by it.
    """
    first = likelier(form.model(flying, frame, sigma))
    lasted = float(flying.t[-1] - flying.t[0])
    if flying.parts > 1 or CHANGE in form.beyond or lasted < 2.0 * EVERY_S:
        return form, first
    found = front_of(
        first,
        lambda moment: form.turning(moment).model(flying, frame, sigma),
        form.turning(None).model(flying, frame, sigma),
    )
    return (form, first) if found is None else (form.turning(found[0]), found[1])


def _false(found: Matched) -> bool:
    """Whether the airspeed sensor reads gusts that the wing does not feel.

    Lift goes with the square of the airspeed: gusts along the flow cannot be more than what is left
    of the force would be by itself.
    """
    model, air = found.fit.model, found.turbulence
    if AirspeedScale.name not in {e.name for e in model.effects} or not air.found:
        return False
    k = model.axes.index(UP)
    u_b = model.air(found.fit.theta).u_b
    ahead_n = np.einsum("nij,ni->nj", model.flight.R_bn, u_b)
    ahead_n /= np.maximum(np.linalg.norm(u_b, axis=1), 1.0)[:, None]
    slope = np.einsum("ni,ni->n", model.gust_slope(found.fit.theta)[:, k], ahead_n)
    return air.rms - SURE * air.sigma > rms(found.fit.residual[:, k]) / rms(slope)


def _deaf(flight: Flight) -> Flight:
    """The flight without its airspeed sensor."""
    return replace(flight, airspeed=np.full(len(flight), np.nan))


def _slipping(
    found: Matched, flying: Flight, frame: PlaneAirframe, sigma: Array, form: _Form
) -> Matched:
    """The same, but with the file's side force where the flight slips too little to tell it.

    Where sideslip is no more than errors of the motion, a force of none fits whatever the force
    is: errors of a regressor make its slope nothing (W. A. Fuller, *Measurement Error Models*,
    1987, section 1.1), and the wind across is then free.  A rudder that holds the slip tells all
    of it better than the slip itself.  So it has to be seen that the file's force leaves more than
    such errors make.
    """
    model, fit = found.model, found.fit
    places = model.indices(SideForce.name)
    apart = np.abs(fit.theta - model.nominal)[places]
    if not np.any(apart > [model.unknowns[k].floor for k in places]):
        return found
    fit = likelier(form.model(flying, frame, sigma, held=True))
    k = fit.model.axes.index(SIDE)
    slope = np.linalg.norm(fit.model.gust_slope(fit.theta)[:, k], axis=-1)
    made = [np.linalg.norm(of[:, k], axis=-1) for of in errors_of(fit.model, fit.theta)]
    errors = math.hypot(RECEIVER_M_S * rms(slope), rms(np.concatenate(made)))
    if rms(fit.residual[:, k]) > errors:
        return found
    return matched(fit.model, fit)


def _coefficients(m: Matched, frame: PlaneAirframe) -> dict[str, float | list[float]]:
    """Keys of a coefficient file: those given, and what was found in their places."""
    names = set(m.handed_back)
    made = frame
    if "lift" in names:
        c_lift_0, c_lift_a = m.fit.theta[m.model.indices("lift")].tolist()
        made = replace(made, c_lift_0=c_lift_0, c_lift_a=c_lift_a)
    if "drag" in names:
        c_drag_p, induced = m.fit.theta[m.model.indices("drag")].tolist()
        # A file divides by it: as good as none is a share of what it has.
        induced = max(induced, LEAST_INDUCED * frame.induced)
        oswald = 1.0 / (math.pi * induced * made.b**2 / made.s)
        made = replace(made, c_drag_p=c_drag_p, oswald=oswald)
    if "side_force" in names:
        c_y_b, c_y_deltar = m.fit.theta[m.model.indices("side_force")].tolist()
        made = replace(made, c_y_b=c_y_b, c_y_deltar=c_y_deltar)
    return numbers_of_file(made)
