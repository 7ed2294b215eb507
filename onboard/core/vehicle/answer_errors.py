"""How far commands that answer what disturbs the thrust may have bent what is told by them.

An autopilot holds the climb: where a gust, a rotor that gives way or a battery takes thrust away,
it commands more, and the force stays what it was.  Commands are then no cause that is independent
of the rest, and least squares take the answer for rotors that hardly obey: a thrust that changes
by 3 % of its own, seven times in ten seconds, was told as a thrust of 0.36 +-0.04 times the
airframe's, with a curve that falls.  By their past (:mod:`onboard.core.vehicle.instruments`) only
what does not last is told apart.  So what an answer can have made is in the sigmas.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from onboard.core.maths.arrays import Array
from onboard.core.vehicle.answered import Answered
from onboard.core.vehicle.effects.thrust_curve import ThrustCurve
from onboard.core.vehicle.fit import Fit
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.instruments import whitened_residual
from onboard.core.vehicle.limits import INSTRUMENT_WINDOWS, THRUST_AXIS
from onboard.core.vehicle.windows import Windows, windows_of

COMMAND = 1e-3
"""Of the difference quotient over the command [cost]."""
LEAST_PULL = 1e-3
"""m/s^2 of the thrust by a full command: less is no command's [physics]."""


def answered_by_commands(fit: Fit) -> Answered | None:
    """What answers may have made of a fit; None where it is no copter's, or of no commands."""
    model = fit.model
    if THRUST_AXIS not in model.axes or not model.indices(ThrustCurve.name):
        return None
    k, windows = model.axes.index(THRUST_AXIS), windows_of(model.flight)
    more = replace(model, flight=_commanded(model.flight, COMMAND))
    pulled = (more.predicted(fit.theta) - model.predicted(fit.theta))[:, k]
    apart = (more.jacobian(fit.theta).by - fit.jacobian.by)[:, k]
    obeys = np.abs(pulled) > LEAST_PULL * COMMAND
    rows = np.where(obeys[:, None], apart / np.where(obeys, pulled, 1.0)[:, None], 0.0)
    left = whitened_residual(model, fit.residual, fit.noise, fit.sensitivity)[k]
    lasting = _remembered(left, windows) if THRUST_AXIS in model.instrumented else 1.0
    each = lasting * left[:, None] ** 2 * windows.mean(rows)
    part, score = model.flight.part[windows.first], np.zeros(len(fit.theta))
    for number, places in enumerate(fit.jacobian.places):
        np.add.at(score, places, each[part == number].sum(axis=0))
    return Answered(score, fit.prior, fit.theta - model.nominal)


def _commanded(flight: Flight, more: float) -> Flight:
    """The flight with so much more of the command of each motor."""

    def shifted(commands: Array) -> Array:
        out = commands.copy()
        out[:, 1] += 2.0 * more * out[:, 0] + more**2
        out[:, 0] += more
        return out

    history = flight.history
    if history is not None:
        history = replace(history, commands=shifted(history.commands))
    return replace(flight, commands=shifted(flight.commands), history=history)


def _remembered(left: Array, windows: Windows) -> float:
    """Share of whitened rows (r,) that is there still when commands are told from the past."""
    square, share = float(left @ left), 0.0
    for lag in INSTRUMENT_WINDOWS:
        same = windows.piece[lag:] == windows.piece[:-lag]
        share += abs(float(np.sum((left[lag:] * left[:-lag])[same]))) / max(square, 1e-300)
    return min(share, 1.0)
