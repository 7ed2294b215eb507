"""Known errors put into a real recording, sample by sample.

Each is what a sensor, a receiver or a clock would have done, applied to the numbers that the
autopilot reports, after reading and before the estimator.  Nothing of the estimator's model is
used: rotations and interpolation are this package's own.  What the autopilot would have made of the
error is not imitated: the recorded attitude stays as it was flown, as that of an EKF that has
learned the error long ago.
"""

from __future__ import annotations

import math

from benchmarks.real.concealed_attitude import attitude_late, heading, tilted
from benchmarks.real.concealed_fixes import antenna, averaged, fault, latency, skewed
from benchmarks.real.concealed_force import crossed, offset, ramp, scale, step, turned, warmed
from benchmarks.real.concealed_kind import Kind, X, Y, Z

KINDS: tuple[Kind, ...] = (
    offset(X, 0.3),
    offset(Y, -0.3),
    offset(Z, 0.2),
    scale(X, 1.03),
    scale(Y, 0.97),
    scale(Z, 1.02),
    step(X, 0.5),
    step(Y, -0.3),
    step(Z, 0.3),
    ramp(Y, 0.003),
    warmed(X, 0.05),
    crossed(X, Y, 0.05),
    crossed(Y, Z, 0.03),
    turned(math.radians(3.0)),
    latency(0.06),
    latency(0.10),
    skewed(5e-4),
    averaged(),
    antenna(X, 0.5),
    antenna(Z, -0.4),
    fault(3.0),
    heading(math.radians(6.0)),
    tilted(math.radians(3.0)),
    attitude_late(0.05),
)
"""Two dozen errors, of sizes that a vehicle could have and nobody would want."""
