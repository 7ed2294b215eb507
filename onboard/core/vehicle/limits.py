"""Every number of this room that decides something, with where it comes from.

[probability] a chance level, [physics] a bound of nature or of vehicles, [cost] processor time or
memory, [use] what matters to whoever flies, [data sheet] what sensors promise.
"""

from __future__ import annotations

from typing import Final

# Flight on a grid (flight, trajectory, spans).

STEP_S: Final = 0.1
"""Step of the grid, s: the rate at which ordinary logs have outputs and battery [data sheet]."""
FEWEST_STEPS: Final = 100
"""Steps that a flight must have to be looked at: ten seconds [physics: unknowns by rows]."""
MARGIN_S: Final = 3.0
"""s of flight next to the ground that are left out: contact and ground effect are another
physics [physics]."""
HEIGHT_WANDER_M: Final = 10.0
"""By how much a receiver's height may wander in a flight, m: in 95 % of hours [data sheet]."""
LEVEL_M_S: Final = 0.15
"""Vertical speed of a vehicle that rolls, as a receiver shows it, m/s [data sheet]."""
STILL_S: Final = 1.0
"""s for which it must show it [probability: five fixes in a row]."""
CONTACT_M_S2: Final = 40.0
"""Specific force that no copter's rotors make, m/s^2: an impact [physics]."""
ATTITUDE_WANDER: Final = (1e-4, 4e-4, 1.5e-3, 6e-3)
"""Noise of the integrated rates, rad per sqrt(s), among which the likeliest is taken: from a good
gyroscope's to coning at 25 samples a second [data sheet]."""
VELOCITY_NOISE_M_S: Final = (0.02, 0.06, 0.2)
"""White noise of a receiver's velocity, likewise, m/s [data sheet]."""
LEVELS_FROM: Final = 400
"""Fixes from which these are found [cost]."""
FEWEST_FIXES: Final = 5
"""Fewer are no piece of flight [physics]."""

# Flight that contradicts itself (contradiction).

CONTRADICTION_S: Final = 1.0
"""s over which force and velocity are compared: several fixes, and no time to drift [physics]."""
CONTRADICTION_M_S2: Final = 5.0
"""Past this one of them is wrong, m/s^2: an accelerometer that nobody calibrated is 0.7 off and an
attitude that is five degrees off 0.9, so that it is three times what both may be together; an
attitude that is half a right angle off, or a velocity that jumps, is more [physics]."""

# Quantities that are not of one motion (same_motion).

TURN_S: Final = 0.19
"""s over which attitude and gyroscope are compared: two samples at 10 Hz, and no more than a part
of a radian [data sheet]."""
MOTION_S: Final = 0.95
"""s over which velocity is compared with force and position: five fixes at 5 Hz, one at 1 Hz, and
long beside a receiver's lag [data sheet]."""
LAGS_S: Final = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
"""s by which a receiver's velocity may lag [data sheet]."""
LONGEST_SPAN_S: Final = 2.5
"""s, past which it is an outage between two samples [data sheet]."""
LONGEST_GAP_S: Final = 0.3
"""s between samples of the accelerometer or the gyroscope, over which nothing is summed up
[physics]."""
APART_RATE_RAD_S: Final = 0.1
"""Rates further apart are of no gyroscope that works, rad/s: twice what one that nobody calibrated
is off by at rest [data sheet]."""
APART_FORCE_M_S2: Final = 1.6
"""The same of accelerations, m/s^2: an accelerometer that nobody calibrated is 0.7 off and an
attitude that is five degrees off 0.9 [data sheet]."""
APART_VELOCITY_M_S: Final = 2.0
"""The same of velocities, m/s: a metre by which a receiver's height wanders in a second, and a
metre between its filter of the position and that of the velocity [data sheet]."""
APART_SHARE: Final = 0.15
"""Of the squares of both, that the square of their difference may be: axes that are 32 degrees
apart, or a unit that is 1.75 times the other.  Scales, axes and delays of the catalogue make a
hundredth [physics]."""
APART_SHARE_FORCE: Final = 0.5
"""The same of accelerations: a receiver that averages half a second takes a quarter of a manoeuvre
of three seconds away [physics]."""
FEWEST_APART: Final = 10
"""Spans that must be wrong at least, beside a tenth of all and half of those that move: a glitch
of a few seconds is none [probability]."""
ALIKE_SHARE: Final = 0.15
"""Of the sizes of both, or of gravity, that is left where a guess of what was exchanged is worth
saying [use]."""

# Noise (noise).

CORRELATION_S: Final = (0.3, 0.6, 1.2, 2.5, 5.0, 10.0)
"""Correlation times of the coloured disturbance that are tried, s: from the grid's own to half a
block's [cost]."""
WHITE_SHARES: Final = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
"""Shares of white noise in the variance of the disturbance that are tried [cost]."""
GUST_LEVELS: Final = (0.0, 0.3, 1.0, 3.0, 10.0)
"""Gust noise, as multiples of the force noise at the mean sensitivity, that is tried [cost]."""
FINER_LEVELS: Final = (0.45, 0.55, 0.67, 0.82, 1.22, 1.5, 1.8, 2.2)
"""Times the best of them, tried with the best of the others: rows weigh by it, and where a law is
not quite the vehicle's a wind depends on their weights [cost]."""
LEAST_NOISE_M_S2: Final = 0.005
"""Noise that no force goes below, m/s^2: steps of logged numbers [data sheet]."""

# Fit (fit).

WINDOW_STEPS: Final = 5
"""Steps whose mean is a row of the fit: half a second, in which an error of the velocity hardly
changes, so that what follows is nearly a Markov process [physics]."""
BLOCK_S: Final = 12.0
"""Length of a block whose sums are kept, s: longer than the disturbance remembers.  It is a whole
part of that in a flight that has not the fewest of them [cost]."""
FEWEST_BLOCKS: Final = 5
"""Fewer blocks do not tell the scatter between them [probability]."""
FEWEST_FLIGHTS: Final = 5
"""Fewer flights do not tell by how much flights differ [probability]."""
FOLDS: Final = 8
"""Folds of the cross-validation [cost]."""
INSTRUMENT_WINDOWS: Final = (2, 4)
"""Windows ago of which commands are told from: longer than a gust that an autopilot answers at once
lasts, shorter than a manoeuvre [physics]."""
PATH_WINDOWS: Final = (1, 3)
"""Windows ago of which the path over ground is told from: a gust has pushed the vehicle by the end
of the window that it is felt in [physics; with the window itself a drag was 5 % too small in the
mean of twenty simulated flights, without it by 1.4 +-1.8 % on them and by 0 +-1.6 % on others]."""
THRUST_AXIS: Final = 2
"""Body axis along which the commands act."""
ROUNDS: Final = 6
"""Gauss-Newton steps at the most [cost]."""
MORE_ROUNDS: Final = 20
"""The same where regressors are told from the past, and steps may lead to and fro [cost]."""
SHRINKING: Final = 0.8
"""Of the step before: a step that is larger has gone too far [cost]."""
LEAST_SHARE: Final = 0.1
"""Of a step; where less would be gone there is a kink, and no better place near it [cost]."""
SETTLED: Final = 0.02
"""Sigmas that a step may move and count as no move [cost]."""
STALE: Final = 0.03
"""Plausible sizes that the unknowns may move before derivatives are taken anew: drag and wind act
together, by this share of each other [cost]."""
NOISE_ROUNDS: Final = 3
"""Times that noise and unknowns are found in turn [cost]."""
OUTLYING: Final = 5.0
"""Robust sigmas past which a step is no part of what the model describes (stall, gust front,
contact): 6e-7 of normal ones [probability]."""
LEAVING_ROUNDS: Final = 6
"""Times that such steps are left out and the rest is fitted anew, at the most [cost]."""

STALL_SHARE: Final = 0.85
"""Of the angle of stall: up to it lift is a straight line to a per cent [physics]."""

# Decisions (choices).

FALSE_ALARM: Final = 1e-3
"""Probability that a recording of the nominal airframe shows any given effect by chance; divided
by the number of effects that are tried [probability]."""
CREDIT: Final = 2.0
"""What each unknown takes off the fall of chi-square when effects of several are compared: one that
it gains by chance, one that it loses on flight not used (Akaike, 1974) [probability]."""
SURE: Final = 2.0
"""Sigmas by which a difference must exceed what matters [probability: one in 44]."""
APART: Final = 3.0
"""Sigmas by which two findings of one number differ, or a number from the airframe's that is not
tested as an effect: one in 370 by chance [probability]."""
TESTABLE: Final = 3.0
"""Sigmas in the largest plausible size that make an effect testable [probability]."""
ALIKE: Final = 0.7
"""Correlation of two effects' unknowns past which each explains half of the other
[probability]."""
AMBIGUOUS: Final = 10.0
"""Fall of chi-square within which two effects cannot be told apart (Kass and Raftery, 1995)
[probability]."""
UNCLEAR_M_S: Final = 0.3
"""Errors of the velocity, m/s, that what is left of a force may be of and need no effect: six times
what receivers are good for [data sheet]."""
RECEIVER_M_S: Final = 0.1
"""Gusts below this, and below the recording's own errors of the velocity, are within what those
look like on a copter, m/s: twice the median error of good receivers [data sheet]."""
HEADING_RAD: Final = 0.03
"""What a heading is good to that a compass holds, rad: at speed it is an error of the velocity
across the way, wandering for as long as nobody turns [data sheet]."""

PROPELLER_BEND: Final = 0.3
"""Of the thrust at a standstill, by which that of a propeller is off a straight line over the
advance ratio, at the ratio where it pulls nothing: standard deviation [data sheet]."""
MOST_OF_ROTORS: Final = 0.5
"""Of what rotors pull, that may be of something else: a copter is carried by them [physics]."""
MOST_BY_GUSTS: Final = 0.95
"""Share of what tells an unknown that gusts may make; past it nothing is known [probability]."""
TOLD_S: Final = 1.0
"""Spans of flight that were not used and are shorter are not told of, s [use]."""
SENSED_GUST_M_S: Final = 0.15
"""Gusts below this are within what an airspeed sensor wanders by: a per cent of a plane's speed,
m/s [data sheet]."""

# Several flights (agreement).

ANOTHER_MASS: Final = 1.0
"""Of the logarithm: no vehicle flies with a third or with three times its mass [physics]."""

# Laws that no effect has (copter_match, plane_match).

MOST_BEYOND: Final = 3
"""Of them that are let in one after the other; with more the model is another one [cost]."""

# What is shown (flown_alone, curves).

ALONE_S: Final = 10.0
"""s for which the model flies on alone [use]."""
ALONE_EVERY_S: Final = 4.0
"""s between the starts of such flights [cost]."""
CURVE_BINS: Final = 24
"""Points of a curve with its data [cost]."""
MOST_OUTLYING: Final = 0.1
"""Share of steps past which they are no outliers but flight that the model fails on
[probability]."""
