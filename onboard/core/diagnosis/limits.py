"""Every number of this room that decides something, with where it comes from.

[probability] a chance level, [physics] a bound of nature or of sensors, [cost] processor time or
memory, [use] what matters to whoever flies, [tuned] set on simulated flights: to be derived.  What
decides how long it takes, and not what is said, is in :mod:`onboard.core.diagnosis.effort`.
"""

from __future__ import annotations

from typing import Final

# One score for every hypothesis (score, candidates, hypotheses, search).

FALSE_ALARM: Final = 1e-3
"""Of a flight of which nothing is missing, that something is said to be [probability].

Nominal.  In 96 simulated flights 4, 1 and none pass what 10, 1 and 0.1 % of flights should, gravity
left aside: on copters its scores are no chance (14 pass 0.1 %), and nothing but the bound of its
size keeps it from being said.  With 1 % in its place it was said of one flight in 24."""
CLEARLY: Final = 10.0
"""Difference of scores from which one hypothesis is clearly better than another: odds of 150, "very
strong" on the scale of Kass and Raftery (1995), which is that of BIC: scores differ nearly alike
[probability]."""
LEFT_OF_TONE: Final = 25.0
"""Times the variance that is left of velocities: a filter that follows each fix leaves of a tone
``2 sin(pi f T)``, which at 0.6 Hz and fifteen fixes a second is a fourth, and a smoothing that is
found for its sake some more of it [bound]."""
MOST_TONES: Final = 12
"""Tones of a flight that are asked about, a column each [cost: three axes have one of a motor, and
a flight five speeds of it]."""
LOST: Final = 0.1
"""Share of its evidence that an effect loses if the signal that it follows is measured and sampled
with an error of a third of its size: a product must explain as much more to take its place [tuned:
between a true effect, half a per cent, and impostors, 70 % and more]."""
MATTERS_SCALE: Final = 0.005
"""Move of a scale that is worth an effect [use]."""
MATTERS_OFFSET: Final = 0.02
"""Move of an offset that is worth an effect, m/s^2 [use]."""
MATTERS_HELD_OUT: Final = 0.03
"""Fall of the held-out residual that is worth an effect [use]."""
NOISE: Final = 1.3
"""Held-out residual, in units of the noise, up to which it may be called noise [use]."""
PRESENT: Final = 0.01
"""Share of vehicles that have an effect of the catalogue, to a size that matters [probability: the
order of magnitude; what just counts as found is likelier than not with any above 0.0013]."""
HARDLY: Final = 0.05
"""Odds from which a model next to the reported one is counted: what one flight of twenty is like is
outside of the 95 % that two sigma stand for [probability]."""

# Jumps (jumps, selection).

SETTLED_S: Final = 35.0
"""s on the boot clock after which an EKF has settled: before that its attitude jumps [tuned]."""
SCAN_S: Final = 4.0
"""s between the moments at which a jump is looked for: 3 s from where it is it explains half
[physics: the time in which GPS corrects a velocity]."""
CONTACT_S: Final = 10.0
"""s before the end of a flight in which the ground may have been touched: bounces, and the seconds
that an autopilot takes to see that it has landed [physics]."""
LARGEST_TURN: Final = 0.2
"""rad/s over the last spacing that a gyroscope may miss in a shock, one sigma: 6 degrees, as much
as a hard landing turns a vehicle by [physics]."""

# The model that stands (settling).

LINEAR_SHARE: Final = 0.2
"""Of the size of an effect in proportion to the force, by which it is off as long as it counts from
nothing: a curve of 0.06 per g is so much of three times gravity [physics]."""

# Clipping (clipping, screening).

FEWEST_CLIPPED: Final = 5
"""Clipped samples between two reports that are more than a knock [tuned]."""
LEAST_RAIL: Final = 10.3
"""More than any accelerometer that is at rest reads, m/s^2 [physics]."""
LONGEST_STEP_S: Final = 1e-3
"""s between two raw samples, of which clipped ones are counted: ArduPilot's drivers read a thousand
a second and more [data sheet]."""
MARGIN_S: Final = 0.4
"""s to either side of clipped flight that go with it: a low-pass of 5 Hz rings so long
[physics]."""

# False fixes (false_stretches, receiver_errors, refusals).

LARGEST_FALSE: Final = 10.0
"""m/s by which a velocity is false, one sigma: as fast as these vehicles fly, for what is told is
where it was, or is, or nothing [physics]."""
NEAR_S: Final = 10.0
"""s to either side of an error in which a receiver is as noisy as it is there [physics: satellites
come into sight and go as a vehicle turns, in seconds]."""
SAME_FIX_S: Final = 0.1
"""s within which a stamp of the trust window and one of a batch are the same fix: the jitter of
stamps [physics]."""
VIBRATION_HZ: Final = 2.0
"""Of the low-pass behind which ArduPilot reports vibration
(AP_INERTIAL_SENSOR_ACCEL_VIBE_FILT_HZ) [data sheet]."""
ORDINARY_RISE: Final = 0.99
"""Quantile of the rises of vibration from report to report that are no blow: of the five about a
moment one is beyond it by chance once in twenty times [probability]."""
ANTENNA_FLOOR_M: Final = 0.01
"""m; sigma of the antenna's place in each of several recordings beside what their sums say: a
receiver's phase centre moves by as much with the satellites that it sees [data sheet]."""

# What of the receiver's delay is borne out (borne_out).

OFF_SIGMAS: Final = 5.0
"""Sigmas to either side of its estimate at which a delay is asked for once more: two answers that
err by a sigma each, and apart, tell the share that comes back to a seventh [probability]."""
