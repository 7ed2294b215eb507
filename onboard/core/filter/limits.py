"""Every number of this room that decides something, with where it comes from.

Provenance in brackets: *probability* (of a false alarm), *physics*, *data sheet*, *cost* (more buys
nothing), or *tuned* (on simulated flights: to be derived).
"""

from __future__ import annotations

import math
from typing import Final

# Innovation gates (innovation_gates).

GATE_VELOCITY: Final = 30.0
"""Normalised innovation squared of velocity past which a fix is refused [probability: 1.4e-6 with
three degrees of freedom, 3e-7 with two]."""
RECEIVER_M_S: Final = 0.1
"""m/s by which a good receiver may err now and then, whatever its noise is elsewhere: what gates
refuse is a fault, and has to be 5.5 of these besides [data sheet: 0.05 m/s is the median error of
velocity, of the best receivers and at a steady speed]."""
TAIL: Final = {1: 6.63, 2: 9.21, 3: 11.34}
"""Normalised innovation squared, by degrees of freedom, past which a measurement is in the tail of
its noise [probability: 1 % of a Gaussian's].  Its variance is then taken for as much larger as the
figure is, so that it pulls no more than one at the edge does (Huber, 1964)."""
ANEW: Final = {"t": 30.0 / TAIL[2], "y": 30.0 / TAIL[1]}
"""By what factor that of the recorded tilt or heading is larger where it counts as set anew: an
alignment in flight, another compass, another core [probability: 3e-7, 4e-8]."""
_FAULTY: Final = 2.0 * math.log(1e3)
ANYTHING: Final = {
    "vvv": _FAULTY + 6.0 * math.log(60.0),
    "vv": _FAULTY + 4.0 * math.log(60.0),
    "h": _FAULTY + 2.0 * math.log(200.0),
}
"""Minus twice the log-likelihood of a measurement that may be anything: one of a thousand is, and
then it is anywhere within 30 m/s, 100 m [physics]."""
GATE_HEIGHT: Final = 30.0
"""The same of height [probability: 4e-8 with one degree of freedom; tuned]."""
PATIENCE_S: Final = 3.0
"""s; a height that is refused for longer is a new reference (other satellites), not a fault
[tuned]."""
RECOVERY_FIXES: Final = 3
RECOVERY_S: Final = 1.0
"""s; velocity is believed again after so many fixes, and so long, inside the gate [tuned]."""
RECOVERY_SIGMAS: Final = 7.0
"""Between two of them the innovation changes by no more than so many sigmas of the receiver's
noise: 5 of a difference [probability: 6e-7]."""
RECOVERY_DRIFT: Final = 0.3
"""m/s^2; and by what the accelerometer is off [data sheet: half the prior of an offset]."""
RENEWED_HEIGHT_VAR: Final = 1e4
"""m^2; what is added to the variance of the height's reference when it is a new one [physics: no
two references are further apart than 100 m]."""

# Where a filter starts (whitening, passes).

TILT_START_RAD: Final = 0.06
"""Sigma of the recorded roll and pitch at the start [tuned: an EKF in a manoeuvre]."""
HEADING_START_RAD: Final = 0.2
"""Sigma of the recorded heading at the start [data sheet: a compass on a small vehicle]."""
BIAS_START_RAD_S: Final = 0.01
"""Sigma of the gyroscope's bias, 0.6 deg/s [data sheet: after the autopilot's own start-up]."""
UNKNOWN_DOWN_START_M_S: Final = 10.0
"""Sigma of a vertical speed that the receiver does not report [physics: no small vehicle climbs
faster]."""
UNKNOWN_HEIGHT_VAR: Final = 1e8
"""m^2; of a height that is not used: flat."""

# Numerics.

LONGEST_STEP_S: Final = 0.26
"""s; longer intervals (GPS at 1 Hz) are predicted in steps, for attitude errors must stay first
order [physics]."""
SYMMETRY_UPDATES: Final = 16
"""Updates after which the covariance is made symmetric again: rounding drifts slowly [cost]."""

EAGER_EPOCHS: Final = 60
"""While so few epochs are in, the running estimate is solved anew after each [cost]."""
LAZY_EPOCHS: Final = 5
"""Later after each so many: it moves no more within half a second [cost]."""

MOST_PREPARED_BYTES: Final = 66_000_000
"""Of segments made ready that are kept for the next pass, in a program that goes over recordings;
what is more is made anew.  Five minutes with five fixes a second and every effect are 18 MB.  None
are beside an autopilot: to make them anew costs a thirtieth of a diagnosis [cost]."""
NEAR_BIAS_RAD_S: Final = 2e-3
"""rad/s; within it attitude is linear in a bias: over the half second to either side of a fix a
turn changes by a milliradian [physics]."""

# Correlation times of slow errors (noise).

COLOUR_TIME_S: Final = 3.0
"""Of the GPS velocity: receivers filter over a second or two, multipath lasts some seconds
[tuned]."""
ATTITUDE_TIME_S: Final = 30.0
"""Of the recorded tilt: an EKF learns the accelerometer's bias, and forgets the tilt that it
took it for, in some tens of seconds [physics]."""

STAMP_JITTER_S: Final = 8e-4
"""s; by how much a recorded attitude's stamp may be off beside a constant delay: whole milliseconds
(0.29) and the autopilot's loop of 2.5 ms (0.72), uniform both [physics]."""

STATED_M_S: Final = 0.3
"""m/s; accuracy of a velocity by the receiver's own word, over which what is stated is kept, and
which a fix has that states nothing: what receivers say with a good sky [data sheet]."""

# The search for noise levels (noise).

LIMITS: Final[dict[str, tuple[float, float]]] = {
    "velocity": (0.01, 2.0),
    "velocity_colour": (0.005, 1.0),
    "vertical": (0.1, 10.0),
    "height": (0.01, 10.0),
    "height_walk": (0.002, 2.0),
    "force_walk": (0.01, 3.0),
    "lift_walk": (0.01, 3.0),
    "shaken_walk": (0.01, 10.0),
    "shaken_lift": (0.01, 10.0),
    "tilt_walk": (5e-5, 0.03),
    "bias_walk": (1e-6, 3e-3),
    "attitude": (0.02, 0.3),
    "heading": (0.05, 0.6),
    "heading_time": (2.0, 600.0),
    "heading_walk": (5e-5, 0.03),
    "attitude_white": (3e-5, 0.03),
    "jitter": (3e-4, 0.2),
    "stated": (0.01, 2.0),
    "stated_colour": (0.01, 2.0),
}
"""Floors and highest noise levels, units of :class:`~onboard.core.filter.noise.NoiseLevels`.

A level that is its floor says that a flight asks for nothing beyond what no flight is without; one
that is at its highest, that something else is wrong.  Two have no floor but a lowest value: the
vertical velocity's, a ratio, and a time.

No sensor on a small vehicle is better than the floors: a velocity and a height that a carrier's
phase gives from one fix to the next are good to a centimetre (a second), a gyroscope to 3 mdps a
root of a Hertz; hundredths of a degree, in which a log writes attitude, are off by 5e-5 rad [data
sheets].  They are there for simulations without noise, which must not make the filter believe that
timing, interpolation and filters are modelled to the last digit.  A gyroscope's bias wanders by
3e-3 rad/s in a second at the most, where vibration is rectified and changes with the throttle
[physics]; the jitter of a velocity's moment is at least that of whole milliseconds, and at most the
time between two fixes, five a second being the fewest that ArduPilot flies with [physics].  Errors
that go with more than the square of the accuracy that is stated, powers of two, are not told apart
from fixes that are worth nothing [bound].
Velocities down are as good as those north and east but for a factor of ten, and a heading that is
off for longer than ten minutes is off for the flight [physics].

Samples that have nothing to do with each other miss all of what shakes a force, and a hundredth of
it is nothing beside the rest [physics].  With it goes what else shaking does to a velocity (a mount
that gives, an antenna that swings), but not ten times as much [bound].

The slow error of the recorded attitude is no such formality.  Its floor is what EKF3 says of
itself: it starts with an accelerometer bias known to 0.2 m/s^2, which at level is a tilt of 20 mrad
[physics].  The likelihood would have less, for it sees how smooth this error is, not how large:
with 10 mrad, flights that hover err by 2.3 sigma in x and y offset, each towards what the EKF was
levelled with.  So with the heading, whose error goes with the manoeuvre, too: the likelihood would
have one degree, and then offsets of simulated copters err by 2 sigma, with three by 1.4, which was
1.5 before its error was smooth [tuned on simulated flights; held by ArduPilot's recordings and
sealed ones, which it was not made from]."""
LEAST_VELOCITY_VAR: Final = LIMITS["velocity"][0] ** 2
"""(m/s)^2; white noise becomes no less than this by what a receiver states of it: see there."""
USUAL_SIGMA: Final = math.log(10.0)
"""Log ratio between a level and the usual one, one sigma: no more than its order of magnitude is
known.  [Tuned on flights for building: with a factor of three the jitter of a receiver with one fix
a second is not found; without any, levels that a flight says nothing of end at their limits.]"""
NUDGE: Final = 0.01
"""Log ratio between a level and its neighbour, which tell a slope: small against what bends a
likelihood, and large against what rounding does to it [physics]."""
LONGEST_STEP: Final = 1.4
"""Log ratio by which a step changes a level at the most, fourfold: past it neither slope nor
information are those of before [cost]."""
SHARES: Final = (0.0, 0.25, 0.5)
"""Shares of a step that are tried beside the whole of it, in case it was too long [cost]."""

# What samples miss (missed).

SUDDEN: Final = 4.9
"""Sigmas of the misses of a segment past which a sample is no noise but something sudden
[probability: 1e-6 of a Gaussian's; what noise is taken for it costs less than a third of its own
random walk]."""

# What is shaken (shaken).

SHAKEN_MEAN_S: Final = 0.2
"""s; what a force scatters by about its mean over so long is what shakes it: vehicles manoeuvre by
half a second and more, rotors and gusts shake by a tenth and less [physics]."""
SHAKEN_LASTS_S: Final = 1.0
"""s; it is as strong for so long: a variance from fewer samples would be none [cost]."""

# Noise in the regressors (regressor_noise).

NOISE_MEAN_S: Final = 0.05
"""s; samples are averaged over as long: vehicles do not manoeuvre faster [tuned; racing quads
do]."""
FEWEST_NOISE_MEANS: Final = 8
"""Fewer means say nothing about noise [cost]."""
