"""Every number of this room that decides something, with where it comes from.

Provenance in brackets: *probability* (of a false alarm), *physics*, *data sheet*, *cost* (more buys
nothing), or *tuned* (on simulated flights: to be derived).
"""

from __future__ import annotations

from math import inf
from typing import Final

# Linearisation (calibration_model): the range in which timing is looked for.

ATTITUDE_DELAY_RANGE_S: Final = (-0.15, 0.15)
"""Lateness of the recorded attitude, s [physics: beyond it streams are not of one vehicle]."""
SHAPE_RANGE: Final = ((0.0, 0.0, -1.0, 0.0), (1.0, 1.0, 1.0, 1.0))
"""Of shares of the shapes of a receiver's response: weights, of which one leans to either side
[physics]."""
HEADING_RANGE_RAD: Final = (-0.8, 0.8)
"""Error of the recorded heading, rad [physics: past it an EKF does not align]."""
TILT_RANGE_RAD: Final = (-0.3, 0.3)
"""Error of the recorded roll and pitch, rad [physics: past it a vehicle does not hover level]."""
BEYOND: Final = 3.0
"""Sigmas outside of a range: the flight wants what nothing of it can be [probability: 0.1 % where
it is at the very end]."""
SHORTER: Final = 2.0
"""Sigmas by which a span has to be shorter than what an even mean may stand for [probability: 2 %
that it is longer all the same]."""

# Refinement (engine).

WORTH_A_SEARCH: Final = 0.5
"""Log-likelihood that another step of the noise levels is expected to gain, below which they stand:
a level is as uncertain as that by itself, and with it two ways to the same flight differ by less
than a tenth of a sigma (0.19 with 2.0) [probability]."""
MOST_ROUNDS: Final = 24
"""Passes of a refinement, at the most: a search takes five to ten of them [cost]."""
MOST_IDLE: Final = 3
"""Passes in a row, none of them worth it by :data:`WORTH_A_SEARCH`, after which timing that will
not come to rest beside levels that stand is left where it is [cost]."""
MOST_VAIN: Final = 5
"""Such passes after which levels are, too, that do not stand: of real flights, whose gates and
tails go with the estimate, likelihood goes up and down by tens from pass to pass [cost]."""
STEADY: Final = (5e-4, 2e-3, 5e-3, 0.02, 0.02, 0.02)
"""Moves of latency (s), squared window (s^2), attitude delay (s), heading, roll and pitch (rad)
that are not worth another pass [cost]."""
NOT_WORTH: Final = 0.2
"""Sigmas of what moves that another linearisation is not worth a pass for: on real flights the
move after it is up to half of one, so that it is a tenth of a sigma [probability]."""
LEAST_OF_A_STEP: Final = 0.125
"""Share of a step that is made however often it has turned back: three times [cost]."""
WIDER_STEPS: Final = 1.5
"""By how much more of a step is made after one that has not turned back [cost]."""
NEW_SHARE: Final = 0.05
"""Share of a flight that must be new for another refinement at its end [cost]."""
MOST_STATES: Final = 12000
"""Epochs whose state is kept for certificates: 20 minutes at 10 Hz [cost]."""
MOST_KNOWN: Final = 64
"""Batches of flight, at the most, whose integrals are kept for the next answer: ten minutes, a
megabyte at five fixes a second [cost]."""
MOST_AGED: Final = 24
"""Blocks of flight that has left the buffer: enough for folds and clusters [cost]."""

BLOCKS_TOGETHER: Final = 64
"""Blocks whose information is multiplied at once: 5 MB [cost: more saves no time]."""

# Streams (calibrator).

OTHER_CLOCK_S: Final = 60.0
"""s; no stream lags the inertial one by more: what does is of another source, or garbage
[physics]."""
AHEAD_OF_IMU_S: Final = 5.0
"""s; nor is one further ahead: taken in, a single such stamp would make all that follow late
[physics]."""

# What is kept across restarts (saved_sums, agreement).

MOST_SAVED: Final = 16
"""Blocks that are saved: enough for folds and clusters [cost]."""
MOST_WAITING: Final = 4
"""Sums of earlier starts that wait for a flight that agrees with them, the latest [cost]."""
MOST_FLIGHTS: Final = 500
"""Names of flights that are kept with their sums, the latest: sums forget what is older [cost]."""
STRANGER: Final = 0.01
"""Probability with which another sensor may pass for this one [probability]."""

# Flights of one accelerometer (merged_flights).

BY_CHANCE: Final = 1e-3
"""Probability below which flights that scatter so contradict each other [probability]."""
MOST_ODD_FLIGHTS: Final = 2
"""Flights that may have erred among others that agree; more are looked for only before a change of
the sensor [cost: three of 30 flights are 4060 sets]."""
MOST_RECONCILED: Final = 16
"""Last flights of which the consistent sets are looked for [cost: a second and a half]."""

# Solution.

FOLDS: Final = 8
"""Folds of the cross-validation [cost]."""
GRAM_DOUBT: Final = 0.5
"""Relative uncertainty of the noise that was taken out of the regressors: its spectrum is a guess
[cost]."""
MATTERS: Final = 0.2
"""Sigma by which noise in the scales' own regressors may move one of the six before that in all
others is carried, too: it gives about half of it back, and answers are the same to a tenth of a
sigma [bound]."""
FEWEST_BLOCKS: Final = 6
"""Fewer blocks do not tell a cluster's scatter [cost]."""
FEWEST_FREEDOM: Final = 3.0
"""Degrees of freedom below which the variance of Student's t is not told any more: at two it is
infinite, at three three times the scale's [bound]."""
KNOWN: Final = 0.5
"""Share of the prior's variance below which the data know more of a number than it [bound: half
of the variance is the data's]."""
FREEDOMS: Final = (inf, 64.0, 32.0, 16.0, 11.0, 8.0, 5.6, 4.0, 2.8, 2.0, 1.4)
CENTRES: Final = 16
"""Where the likeliest pool of variances is looked for: closer together than twenty unknowns tell
it [cost]."""
ONE_IN_A_THOUSAND: Final = 3.09
"""Standard normal deviate that is exceeded once in a thousand times [probability]."""
MOST_NOISE: Final = 0.9
"""Share of a direction's information that noise may claim; past it there is nothing left to see
[cost]."""

# Calibration record.

SCALE_FLOOR: Final = 5e-4
OFFSET_FLOOR: Final = 1e-3
"""Sigmas of a scale (1) and an offset (m/s^2) that no flight goes below: what the model does not
know (filters, interpolation, clocks) [cost]."""
GYRO_CROSS_SIGMA: Final = 3.3e-3
"""Sensitivity of a gyroscope across its axes, against those of its accelerometer: 1 % at the most
in one housing, taken for three sigma [data sheet]."""
TIMING_FLOOR_S: Final = 5e-4
"""The same of a delay, s: half of the milliseconds that streams are stamped with [physics]."""
CONTRADICTION: Final = 4.0
"""Inflation of the variance past which blocks of one flight ask for different parameters: a sigma
is doubled, and most of it is not what the model says [bound]."""
APART_S: Final = 10.0
"""s; put between the flights of two boots, so that no window spans both [cost: any
number above the longest gap]."""

SURE: Final = 0.99
"""Probability that the force becomes better over the loads flown, from which a calibration is one:
one in a hundred may make it worse, by less than it is uncertain [probability]."""
LEAST_CHANGE: Final = 0.01
"""m/s^2, root mean square over the flight.  Tilts the horizon by 0.06 degrees, and a receiver of
0.05 m/s shows it after five seconds: less changes nothing that anybody could notice [physics]."""

# Observability.

COUPLED: Final = 0.85
"""Correlation from which two numbers are a pair: knowing one would halve the other's sigma
[probability]."""
PRIOR_SHARE: Final = 0.5
"""Share of the prior's sigma that a flight has to get below for a number to be observed
[probability]."""

# Dead reckoning.

LONG_DRIFT_S: Final = 60.0
"""Horizon of the drift that a person is told, s [a GPS outage as pilots think of it]."""
SHORT_DRIFT_S: Final = 10.0
"""Horizon of the velocity residual, s [the length of a batch]."""
LONG_DRIFTS: Final = 6
SHORT_DRIFTS: Final = 12
"""Windows of either at the most [cost]."""
SAME_EPOCH_S: Final = 1e-3
"""Times closer than this are one epoch: streams are stamped in milliseconds [physics]."""
WHOLE_SHARE: Final = 0.97
"""Share of a horizon that a window must reach [cost]."""
FEWEST_INTERVALS: Final = 3
"""Intervals between fixes that a window must have [cost]."""

# At rest (standing).

STAND_S: Final = 2.0
"""Stretches in which it is asked whether a vehicle stands, s: longer than an idling rotor's beat
[physics]."""
FEWEST_AT_REST: Final = 10
FEWEST_STANDS: Final = 3
"""Samples that such a stretch must have, and stretches that say something [cost]."""
QUIET_M_S2: Final = 0.06
QUIET_RAD_S: Final = 0.01
"""Scatter of force and rates of a sensor at rest: a few times what it has by itself.  Of one whose
motors run, or that somebody carries, it is ten times as much [data sheet]."""

# Pairs of accelerometers (shared_windows, wandering, relative, joint, common_cause).

SHARED_WINDOW_S: Final = 1.0
"""Windows in which two accelerometers are compared, s: longer than vibration, shorter than a
manoeuvre [cost]."""
FEWEST_IN_WINDOW: Final = 5
"""Samples that each of them must have in it [cost]."""
FEWEST_WINDOWS: Final = 20
"""Fewer windows say nothing of the scatter [cost]."""
UNKNOWN_PLACE_M: Final = 0.03
"""Sigma of the distance between two accelerometers beyond what is configured, m, each axis
[physics: half an autopilot]."""
MISPLACED_M: Final = 0.5
"""The same where the flight contradicts what is configured, m [physics: the size of a vehicle]."""
PAIR_NOISE_FLOOR: Final = 1e-4
"""Sigma of a window's difference, m/s^2, that no pair goes below: the step of a logged number
[physics]."""
OUTLYING: Final = 6.0
"""Robust sigmas past which a window is no part of the flight: clipping, a bump [probability]."""
CLUSTER_S: Final = 10.0
"""Blocks whose scatter is compared with what windows promise, s [cost]."""
WARMING_S: Final = 100.0
"""s; the longest time constant of what two accelerometers drift apart by: a small board's that
warms up [physics; with none longer than half of a flight, halves of flights for building differ
by several times the variance that they say, with 100 s by 0.7, with 300 s by less]."""
LIKE_SIGMAS: Final = 3.0
"""Sigmas past which two accelerometers differ, a common change is one, or a place is wrong
[probability]."""
LIKE_SHARE: Final = 0.25
"""Share of a common change up to which the differences of the changes are details of it [tuned]."""
