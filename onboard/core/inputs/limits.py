"""Every number of this room that decides something, with where it comes from.

Provenance in brackets: *physics*, *data sheet*, *cost* (more buys nothing), or *tuned* (on flights:
to be derived).  The ranges of possible samples stand in :mod:`onboard.core.inputs.range_checks`,
those of standing still in :mod:`onboard.core.inputs.airborne`.
"""

from __future__ import annotations

import math
from typing import Final

LONGEST_FIX_GAP_S: Final = 2.5
"""s; receivers report at 1 Hz or faster and may miss one: longer without a fix is an outage, not
trusted flight [data sheet]."""

# What is needed around a fix (reach).

AROUND_S: Final = 0.62
"""s to either side of the moment that a fix tells of: receivers average over less than 1.2 s
[physics: those of real flights ask for 0.5 to 0.95]."""
AROUND_SLOW_S: Final = 1.05
"""s; the same where fixes are further apart than that: receivers report at 1 Hz or faster, and a
line between two fixes weighs either [data sheet]."""
RESOLVED_ENDS_S: Final = 0.02
"""s by which either end of the longest span is within it: nodes are so far apart [cost]."""
DELAY_RANGE_S: Final = (-0.1, 0.45)
"""Latency of GPS, s: a little before the stamp, or as late as no known receiver is [tuned]."""
REACH_MARGINS_S: Final = (0.13, 0.08)
"""s; by which samples reach further back and ahead than that [cost]."""
PAST_MARGIN_S: Final = 0.01
"""s; by which they have to go on past what is around the last fix of a piece [cost]."""
EVEN_MARGIN_S: Final = 0.1
"""s; by which they are taken from earlier still, for even times move a little [cost]."""
KEPT_S: Final = 0.3
"""s; samples are kept this much longer than they reach [cost]."""
SLOW_KEPT_S: Final = 1.0
"""s; and those of slow signals so much longer still [cost]."""

ATTITUDE_MARGIN_S: Final = 0.3
"""s; the recorded attitude is kept for so much longer than the samples to either side: it is asked
for within them, early or late by its own delay [physics: 0.15 at the most]."""

# Cutting (assembly).

IMU_GAP_S: Final = 0.25
"""s; attitude changes too much over a longer gap to be interpolated [physics]."""
SLOWEST_IMU_HZ: Final = 7.5
"""Inertial samples a second: a log at 10 Hz of an autopilot that looks at its samples 25 times a
second has 8.3 of them.  Of five a second, flights of 45 s are off by more than their sigmas say
[tuned: see docs/benchmarks.md]."""
STUCK_S: Final = 1.0
"""s for which no accelerometer that works repeats one reading on all three axes in flight.  Where
steps are a thousandth of g and vibration is no more, one reading of fifty is like that before it,
and eight in a row, a second of the slowest stream, are one of ten thousand million [physics]."""
SAME_M_S2: Final = 1e-4
"""m/s^2 within which readings are one reading.  A low-pass that reckons in float32 never comes to
rest, but goes on by a few roundings for ever (3e-7 m/s^2 at 1 kHz); the quietest accelerometers
have a noise of 25 micro-g a root of a hertz, 1e-3 m/s^2 behind 20 Hz [data sheet]."""
SAME_RAD_S: Final = 1e-6
"""The same of rates, rad/s: the quietest gyroscopes have 0.003 deg/s a root of a hertz, 2e-4 rad/s
[data sheet]."""
MOST_STUCK: Final = 50
"""Such times that are remembered, the latest [cost]."""
FEWEST_SAMPLES: Final = 8
"""Inertial samples of a piece: fewer cannot be interpolated by cubics [cost]."""
FEWEST_FIXES: Final = 3
"""Fixes of a batch: two intervals [cost]."""
TOUCHED_S: Final = 3.0
"""s before the autopilot's word that it has landed in which the vehicle may have touched the
ground: detectors want a second of idling, at which a controller arrives in another one or two; an
impact is no flight [physics].  They want a quiet force besides, for which they may wait in vain
while rotors shake what stands: that shows in the velocity."""
GROUND_M: Final = 2.0
"""m; heights closer than this to where the vehicle stood are the ground [data sheet: what a
receiver's height scatters by in a minute or two]."""
STILL_M_S: Final = 0.3
"""Speed of a vehicle that stands, as a receiver shows it, m/s [data sheet]."""
FELT_M_S2: Final = 0.02
"""Standard deviation of a force that surely changes: two steps of a thousandth of g, in which
telemetry has it [data sheet]."""
FLYING_M_S: Final = 3.0
"""Faster than that a vehicle that has flown is not on the ground for long [physics: a walk]."""
ROLLED_OUT_S: Final = 2.0
"""s without speed after which a vehicle has come to a stand [probability: ten fixes in a row]."""
LONGEST_ROLL_S: Final = 120.0
"""s; nobody rolls for longer between two stands, nor stands with turning rotors for longer before
that is said: what does is flown close to the ground, or hovers [physics]."""
SILENT_S: Final = 2.0
"""s; an accelerometer that is so far behind the newest is not waited for, nor is a temperature that
is told beside it carried on for longer [cost]."""
LEAST_WAITING_S: Final = 0.5
"""s of flight without which there is nothing to cut at the end of a flight [cost]."""
LEAST_LAG_S: Final = 2e-4
"""s; a gyroscope's lag below it is nothing: a hundredth of a sample [cost]."""
TEMPERATURE_EVERY: Final = 10
"""Inertial samples of which one temperature is kept [cost]."""

# Interpolation (segments, gyroscopes).

DENSE_S: Final = 0.6
"""s; between attitude samples no further apart the gyroscope says how it turned: in half of it even
one of 5e-3 rad/sqrt(s) is off by 2.7 mrad only [data sheet]."""
NEAR_S: Final = 0.02
"""s; and at this distance a sample speaks for itself [physics]."""
AS_DENSE: Final = 1.25
"""A gyroscope whose samples are sparser than this against the accelerometer's shows less of the
motion than the accelerometer's own [cost]."""

# Streams (tracks).

HIGHRES_S: Final = 0.5
"""s after a HIGHRES_IMU during which nothing coarser of that accelerometer is taken [cost]."""

# Even times of fixes (even_times).

FEWEST_EVEN: Final = 5
"""Fixes: fewer do not show a grid [cost]."""
WHOLE_MS: Final = 0.3
"""ms; a period this near to a whole millisecond is one: receivers run at 1, 2, 4, 5, 8, 10 Hz
[data sheet]."""
WAITED_S: Final = 5e-3
"""s; an autopilot's loop and its bus let messages wait by this at least: stamps that are nearer to
a grid say no more for it [physics]."""
MISSED: Final = math.log(20.0)
"""Of a missing epoch, what it takes off the log-likelihood: one of twenty is lost on a bad link
[probability]."""
MOST_MISSED: Final = 100
"""Epochs of a batch that may be missing, and no more than are there [cost]."""
OFF_GRID: Final = 0.22
"""Share of a period by which stamps may scatter about a grid: about one that is not theirs they
scatter by 0.29.  With all numbers of missing epochs tried, ninety stamps of no grid find one in
none of 2,000 streams, fifty in 3 %, twenty in two thirds [probability]."""
EVEN_ALREADY_S: Final = 2e-3
"""s; stamps that jitter by less are left alone [physics: they are whole milliseconds]."""
UNEVEN: Final = 2.0
"""Times the scatter of the stamps, by which epochs may scatter in receiver time: where that is true
it is none of the stamps', and twenty of either show four times the variance by chance once in a
thousand [probability]."""
NO_GRID_S: Final = 0.3
"""s; more is no jitter: gaps that are no whole periods, or a clock that was set [physics]."""
CRYSTAL: Final = 2e-4
"""Largest drift between two clocks: a crystal is good to 1e-4 [data sheet]."""
LEAST_JITTER_S: Final = 1e-4
"""s; scale below which the robust fit does not tell outliers [cost]."""
REWEIGHTINGS: Final = 4
"""Rounds of the robust fit [cost]."""
BEFORE_NEXT_S: Final = 1e-3
"""s; a time that must not move stays at least so far before the next [cost]."""

# Noise in samples (expected_force).

RESOLVED_S: Final = 20.0
"""s; stretches of which spectra are made: a manoeuvre's falls by half within a tenth of a Hertz
[cost: longer, and a short flight has too few]."""
SPECTRUM_BINS: Final = 3
"""Frequencies over which a spectrum is averaged [cost: as above]."""
FLOOR_BINS: Final = 21
"""The same where the least of it is looked for: the least of many is too small by chance, by a
tenth [cost]."""
TONE_BESIDE: Final = 1.5
"""Ratio of frequencies up to which is looked what lies beside a tone: what a vehicle's motion has
there is as smooth as its own damping, and rises and falls over tens of per cent [physics]."""
TONE_BINS: Final = 4
"""Frequencies on either side over which the window of a spectrum smears a tone [cost]."""
TONE_STANDS_OUT: Final = 5.0
"""Times what lies beside it that a tone has.  Of three stretches, the fewest of a flight that is
judged, one of 1500 frequencies has that by chance once in a thousand flights [probability]."""
TONE_STRETCHES: Final = 3
"""Stretches of which a spectrum of a part of a flight is made [probability: as above]."""
DROWNED: Final = 0.5
"""Share of noise in the force at a frequency of the fixes, in the mean of them, from which it is
more noise than force [bound]."""

# What an autopilot turns its heading by (steady_heading).

PULLED_RAD_S: Final = 0.1
"""rad/s.  What is slower is a gyroscope's bias (0.01 rad/s), or an EKF's that follows its compass:
the filter's own model of the heading has room for it [physics]."""
GYRO_SHARE: Final = 0.03
"""Of a turn, by which a gyroscope may be off besides [data sheet: older sensors]."""
STAMPED_S: Final = 5e-3
"""s by which stamps of two attitudes may be off together, so that a turn is off by as much of its
rate: six sigma of :data:`~onboard.core.filter.limits.STAMP_JITTER_S` [physics]."""
ATTITUDE_LATE_S: Final = 0.2
"""s by which an attitude is late or early, one sigma of what is expected
(:class:`~onboard.core.model.nuisances.ImuDelay`) [probability]."""
HEADING_LOOKED_AT_S: Final = 60.0
"""s from the start of an uninterrupted flight in which the right heading is looked for: twice what
a compass is off for after a take-off [physics]."""
HEADING_EVERY_S: Final = 0.1
"""s between the moments whose median is taken [cost]."""

# Rounded signals (rounded, assembly).

THROTTLE_STEP: Final = 0.01
"""Of a throttle in VFR_HUD: whole per cents [data sheet: MAVLink's common.xml]."""
WHOLE: Final = 1e-6
"""Of a step, by which what is told in whole steps is off them: a float's rounding, a hundred times
[bound]."""

# Single false samples (spikes).

NEVER_SIGMAS: Final = 7.0
"""By which no sample of a Gaussian is off: one in 4e11, and a flight of ten hours at 400 Hz has
4e7 numbers [probability].  Heavier tails are decided on by the velocity."""
SPREAD_SAMPLES: Final = 200
"""Over which the spread is measured: a median of so many is known to 8 % [probability]."""
NEAR_SAMPLES: Final = 11
"""Before and after a sample, over which it is seen that vibration has begun or ends: a median of so
many is known to a third [probability]."""
WALK_SHARE: Final = 0.1
"""Of the variance by which the velocity is found to walk: what adds less is in the noise [use]."""
LEAST_SPREAD_M_S2: Final = 0.01
"""A thousandth of g, which is what telemetry resolves [data sheet]."""
