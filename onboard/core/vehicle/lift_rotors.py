"""Where rotors carry a plane that has some: it then flies by no law of wings.

A quadplane hovers, speeds up with its rotors still turning, and flies on its wings once they stand.
What the rotors add is no lift, and what they cost no drag: laws of a wing are told by flight in
which they stand.  Rotors that tilt pull ahead then, and those of a tailsitter always do: of them
the outputs do not tell which it is.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from onboard.core.maths.arrays import Array, Mask
from onboard.core.vehicle.flight import Flight
from onboard.core.vehicle.signals import Signals, rotor_functions

TURNING: Final = 0.05
"""Share of a rotor's range past which it turns: thrust goes by the square of the speed, so that it
is less than a 400th of the full one below [physics]."""
RUN_DOWN_S: Final = 1.0
"""s by which what is left out is longer on either side: a rotor runs up and down in some tenths of
a second, and outputs are recorded ten times a second or less often [physics]."""
TILTING: Final = ("Q_TAILSIT_ENABLE", "Q_TILT_ENABLE")


def rotors_of(signals: Signals) -> tuple[int, ...]:
    """Channels of the rotors that stand upright; none of a plane without, or whose rotors tilt."""
    if signals.normalised or _tilting(signals):
        return ()
    return signals.channels_of(*rotor_functions(signals.parameters.get("Q_FRAME_CLASS")))


def unseen(signals: Signals) -> bool:
    """Whether a plane has upright rotors (``Q_ENABLE``) whose outputs were not recorded."""
    has_some = signals.parameters.get("Q_ENABLE", 0.0) > 0.0 and not _tilting(signals)
    return has_some and not rotors_of(signals)


def _tilting(signals: Signals) -> bool:
    return any(signals.parameters.get(name, 0.0) > 0.0 for name in TILTING)


def turning(signals: Signals) -> Array:
    """(m,) moments of the outputs at which an upright rotor turns, s."""
    channels = rotors_of(signals)
    if not channels:
        return np.zeros(0)
    get = signals.parameters.get
    low, high = get("Q_M_PWM_MIN", 1000.0), get("Q_M_PWM_MAX", 2000.0)
    most = np.max(np.nan_to_num(signals.outputs.x[:, channels]), axis=1)
    out: Array = signals.outputs.t[most > low + TURNING * max(high - low, 1.0)]
    return out


def carried(flight: Flight, signals: Signals) -> Mask:
    """(n,) the steps in which rotors turn, or have just turned, or are about to."""
    return _near(flight.t, turning(signals))


def on_wings(flight: Flight, signals: Signals) -> tuple[Flight, float]:
    """The steps in which no rotor carries the plane, and for how long one did, s."""
    mask = carried(flight, signals)
    seconds = float(np.count_nonzero(mask)) * flight.step_s
    return (flight.cut(~mask) if mask.any() else flight), seconds


def _near(t: Array, moments: Array) -> Mask:
    """(n,) whether one of the sorted moments (m,), s, is near each of the times (n,)."""
    if not len(moments):
        return np.zeros(len(t), dtype=bool)
    next_one = np.searchsorted(moments, t)
    bounded = np.concatenate([[-math.inf], moments, [math.inf]])
    out: Mask = np.minimum(t - bounded[next_one], bounded[next_one + 1] - t) < RUN_DOWN_S
    return out
