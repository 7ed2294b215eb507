"""Several flights of one vehicle as one: its airframe in common, air and sensors of their own.

A flight that never turned its nose, or flew at one speed, tells an airframe's drag and the wind
that it flew in together and not apart.  Another flight of the vehicle in another wind tells them
apart, as the airframe is the same; so does one in a wind that was measured.  Flights are laid end
to end, each with unknowns of its own for wind, gusts and what its calibration leaves
(:class:`onboard.core.vehicle.effects.own.Own`); a block of the fit has steps of one flight alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.effects.wind import PLAUSIBLE_M_S
from onboard.core.vehicle.flight import Flight, History
from onboard.core.vehicle.limits import BLOCK_S

STREAMS = ("outputs", "commands", "battery", "ekf_wind")
"""What is used where every flight has it."""


def joined(flights: Sequence[Flight]) -> Flight:
    """One flight of all, above one ground, each beginning with a block of its own.

    Args:
        flights: at least one; each of one recording.
    """
    first = flights[0]
    if len(flights) == 1:
        return first
    laid, begin, piece = [], float(first.t[0]), 0
    history, place = _histories(flights)
    for number, flight in enumerate(flights):
        laid.append(
            replace(
                flight,
                t=flight.t - flight.t[0] + begin,
                piece=flight.piece - flight.piece[0] + piece,
                height=flight.height - flight.ground + first.ground,
                measured_wind=_measured(flight),
                part=np.full(len(flight), number, dtype=np.int64),
            )
        )
        seconds = float(laid[-1].t[-1] - first.t[0])
        begin = float(first.t[0]) + BLOCK_S * (math.floor(seconds / BLOCK_S) + 1.0)
        piece = int(laid[-1].piece[-1]) + 1

    def together(name: str) -> Array:
        every = [getattr(f, name) for f in laid]
        alike = all(x.shape[1:] == every[0].shape[1:] for x in every)
        out: Array = np.concatenate(every) if alike else np.zeros((sum(map(len, laid)), 0))
        return out

    by_step = ("t", "piece", "f_b", "w_b", "R_bn", "v_b", "v_n", "height", "rho", "airspeed")
    names = (*by_step, "measured_wind", "part", "unsure", "shaken", *STREAMS)
    whole: dict[str, Any] = {name: together(name) for name in names}
    return replace(
        first,
        **whole,
        velocity_sigma=max(f.velocity_sigma for f in flights),
        attitude_sigma=np.max([f.attitude_sigma for f in flights], axis=0),
        rest_volts=float(np.fmax.reduce([_highest_volts(f) for f in laid])),
        ground_seen=all(f.ground_seen for f in flights),
        history=history,
        place=place,
    )


def _histories(flights: Sequence[Flight]) -> tuple[History | None, NDArray[np.int64]]:
    """Commands of all recordings end to end, and the places (n,) of all steps in them."""
    every = [f.history or History(f.commands, f.piece) for f in flights]
    if len({h.commands.shape[1] for h in every}) > 1:
        return None, np.zeros(0, dtype=np.int64)
    pieces, places, piece, at = [], [], 0, 0
    for flight, its in zip(flights, every, strict=True):
        pieces.append(its.piece - its.piece[0] + piece)
        places.append(flight.place + at)
        piece, at = int(pieces[-1][-1]) + 1, at + len(its.piece)
    commands = np.concatenate([h.commands for h in every])
    return History(commands, np.concatenate(pieces)), np.concatenate(places)


def of_parts(flight: Flight, numbers: Sequence[int]) -> Flight:
    """Some of several recordings, on the clock of all and above the same ground.

    Args:
        flight: of several.
        numbers: of those that are kept, in order.
    """
    out = flight.kept(np.isin(flight.part, numbers))
    out.part[:] = np.searchsorted(numbers, out.part)
    return out


def wind_sigmas(flight: Flight) -> list[float]:
    """By how much the wind of each recording may be off what is known of it, m/s."""
    out = []
    for number in range(flight.parts):
        measured = flight.measured_wind[flight.part == number]
        known = measured.shape[1] > 0 and bool(np.isfinite(measured).all())
        out.append(float(np.mean(measured[:, 2])) if known else PLAUSIBLE_M_S)
    return out


def _highest_volts(flight: Flight) -> float:
    """At rest or flown, V: of one battery for all flights the same is full; NaN if unknown."""
    if not flight.battery.shape[1]:
        return flight.rest_volts
    return float(np.fmax(np.percentile(flight.battery[:, 0], 99), flight.rest_volts))


def _measured(flight: Flight) -> Array:
    """(n, 3) NaN where the wind was not measured."""
    if flight.measured_wind.shape[1]:
        return flight.measured_wind
    return np.full((len(flight), 3), np.nan)
