"""What a person is told of flight that a match left out; empty where there is none."""

from __future__ import annotations

from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.limits import TOLD_S


def of_rotors(seconds: float) -> str:
    """That flight was left out in which upright rotors turned."""
    left_out = f"upright rotors turned for {seconds:.0f} s, of which nothing is told"
    return left_out if seconds else ""


def of_outages(flight: Flight, *, plane: bool) -> str:
    """That flight was left out of which it is not known what was commanded, or its airspeed."""
    what = "outputs or airspeed" if plane else "outputs"
    missing = f"{what} are missing for {flight.unheard_s:.0f} s, of which nothing is told"
    return missing if flight.unheard_s >= TOLD_S else ""


def of_velocity(flight: Flight) -> str:
    """That flight was left out in which no receiver held the velocity."""
    lost = f"nobody knows the velocity for {flight.lost_s:.0f} s, of which nothing is told"
    return lost if flight.lost_s >= TOLD_S else ""


def of_a_sensor(flight: Flight, *, plane: bool) -> str:
    """That a plane's airspeed sensor has died."""
    dead = f"the airspeed sensor repeats one reading for {flight.dead_s:.0f} s, which is not used"
    return dead if plane and flight.dead_s >= TOLD_S else ""
