"""Every number of this room that decides something, with where it comes from.

[probability] a chance level, [physics] a bound of nature or of sensors, [cost] processor time or
memory, [use] what matters to whoever flies, [tuned] set on simulated flights: to be derived.
Gains and margins are in units of chi-square.
"""

from __future__ import annotations

from typing import Final

# Candidates and their choice (candidates, hypotheses).

FALSE_ALARM: Final = 1e-3
"""Of a flight of which nothing is missing, that something is said to be [probability]."""
CLEARLY: Final = 10.0
"""Difference of scores from which one hypothesis is clearly better than another: odds of 150, "very
strong" on the scale of Kass and Raftery (1995) [probability]."""
LOST: Final = 0.1
"""Share of its evidence that an effect loses if the signal that it follows is measured and sampled
with an error of a third of its size: a product must explain as much more to take its place
[physics]."""
MATTERS_SCALE: Final = 0.005
"""Move of a scale that is worth an effect [use]."""
MATTERS_OFFSET: Final = 0.02
"""Move of an offset that is worth an effect, m/s^2 [use]."""
MATTERS_HELD_OUT: Final = 0.03
"""Fall of the held-out residual that is worth an effect [use]."""
MOST_EFFECTS: Final = 5
"""Effects beside each other: more are a search without end [cost]."""
LEAST_BLOCKS: Final = 4
"""Blocks of a flight among which a jump can be looked for: two on either side [physics]."""

# Jumps (jumps, selection).

SETTLED_S: Final = 25.0
"""s from the start in which nothing is called a jump: the EKF settles [tuned]."""
REACH_S: Final = 16.0
"""s from the boundary of a block within which a jump shows there: a block and a half [tuned]."""
SETTLING_S: Final = 40.0
"""s after which the filter's state has forgotten a jump: four times the attitude's [tuned]."""
FURTHEST: Final = 3
"""Times that a search goes on beyond its edge [cost]."""
SPACINGS: Final = ((2.0, REACH_S), (0.5, 3.0))
"""Spacing and width of the two rounds of a search, s [cost]."""
ONSET_S: Final = 0.5
"""Sigma of a moment that is searched at that spacing, s [physics]."""

# Passes of a diagnosis (examination).

SAMPLE_S: Final = 200.0
"""s of flight on which noise levels are tried; more does not make them better known [cost]."""
NEIGHBOURS: Final = 4
"""Neighbouring batches of the sample: the filter needs ten seconds to settle in each [cost]."""
NOISE_ROUNDS: Final = 4
"""Rounds of the search for noise levels [cost]."""
WORTH_A_PASS: Final = (2e-3, 4e-3, 0.01, 0.05)
"""Moves of delay (s), squared window (s^2), attitude delay (s) and heading (rad) that are worth
another pass [cost]."""

# Clipping (clipping, cleared, screening).

ENOUGH: Final = 0.3
"""Share of a flight that has to be left without what is clipped [tuned]."""
RAIL_SAMPLES: Final = 12
"""Samples at one extreme value, in all [tuned]."""
RAIL_RUN: Final = 4
"""Samples at one extreme value in a row [tuned]."""
FEWEST_CLIPPED: Final = 5
"""Clipped samples between two reports that are more than a knock [tuned]."""
LEAST_RAIL: Final = 10.3
"""More than any accelerometer that is at rest reads, m/s^2 [physics]."""
MARGIN_S: Final = 0.4
"""s to either side of clipped flight that go with it: a low-pass of 5 Hz rings so long
[physics]."""
SHORTEST_S: Final = 4.0
"""s of flight between two clipped parts that are worth keeping [cost]."""

# False fixes (screening, faults, coasting, refusals).

FEWEST_REFUSED: Final = 3
"""Refused fixes from which a failure is looked for [tuned]."""
OFF: Final = 8.0
"""Times the receiver's noise that no honest velocity is off [tuned]."""
FAR_OFF: Final = 12.0
"""The same where the accelerometer itself is in doubt [tuned]."""
FAULT_S: Final = 1.0
"""s that a fault lasts at least [tuned]."""
ONSET_FIXES: Final = 3
"""Fixes that show how a fault began [tuned]."""
LONGEST_FAULT_S: Final = 120.0
"""s; what lasts longer is how the receiver is [tuned]."""
BESIDE_S: Final = 2.0
"""s of good fixes that part two spells of one fault: those before the EKF complained [tuned]."""
NEIGHBOURS_S: Final = 1.1
"""s between fixes that follow on each other: dead reckoning changes by next to nothing
[physics]."""
MEAN_S: Final = 1.0
"""s over which fixes are averaged against dead reckoning [tuned]."""
FEWEST_FIXES: Final = 5
"""Fixes from which dead reckoning can be compared [tuned]."""
FAULT_M_S: Final = 0.7
"""m/s by which fixes must contradict dead reckoning [tuned]."""
MOST_SCATTER: Final = 0.5
"""Share of its size that a contradiction may scatter by [tuned]."""
BEFORE_S: Final = 5.0
"""s of flight before a refused spell from which dead reckoning starts [tuned]."""
APART_S: Final = 2.0
"""s between two contradictions that are not one [tuned]."""
SAME_FIX_S: Final = 0.1
"""s within which a stamp of the trust window and one of a batch are the same fix: the jitter of
stamps [physics]."""

# What a recording lets ask for (testability).

LEAST_SPREAD: Final = {"temperature": 0.5, "throttle": 0.03, "vibration": 0.05}
"""Changes of slow signals (K, 1, m/s^2) below which what follows them is not to be seen
[tuned]."""
