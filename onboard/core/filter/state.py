"""The state of the whitening filter: which slice is what, and how it moves.

An error of what the inertial samples alone would give:

=======  =======================================  =============================
slice    what                                     model
=======  =======================================  =============================
V        velocity, NED, m/s                       random walk (accelerometer)
H        height, m                                integral of -v_down
PSI      attitude error, NED rotation vector      random walk (gyroscope)
BIAS     gyroscope bias, body, rad/s              random walk
CV       correlated GPS velocity error, m/s       Gauss-Markov
CH       wander of GPS height, m                  random walk
ATT      slow error of the recorded attitude      Gauss-Markov; heading: smooth
RATE     rate of that of the heading, rad/s       with it
=======  =======================================  =============================

The order says what is measured: number ``i`` of the :data:`MEASURED` (velocity north, east, down;
height; attitude about north, east, down) reads the sum of state ``i`` and of its own slow error,
state ``i + ERRORS``.  In one step the :data:`MEASURED` first states take from the ``ERRORS``
first ones only; the biases stay, and the errors decay, each for itself.  That of the heading also
follows a rate of its own (:mod:`onboard.core.filter.smooth_error`).
"""

from __future__ import annotations

from typing import Final

V: Final = slice(0, 3)
H: Final = 3
PSI: Final = slice(4, 7)
BIAS: Final = slice(7, 10)
CV: Final = slice(10, 13)
CH: Final = 13
ATT: Final = slice(14, 17)
HEADING: Final = 16
RATE: Final = 17
STATES: Final = 18
MEASURED: Final = 7
ERRORS: Final = 10
