"""How much work a diagnosis takes on: numbers that cost time and do not decide what is said.

With twice the work the same effects are named, and their sizes move by less than half a sigma.
"""

from __future__ import annotations

from typing import Final

SAMPLE_S: Final = 200.0
"""s of flight on which noise levels are tried; more does not make them better known."""
NEIGHBOURS: Final = 4
"""Neighbouring batches of the sample: the filter needs ten seconds to settle in each."""
WORTH_A_PASS: Final = (2e-3, 4e-3, 0.01, 0.05, 0.05, 0.05)
"""Moves of delay (s), squared window (s^2), attitude delay (s), heading, roll and pitch (rad) that
are worth another pass."""
MOST_EFFECTS: Final = 5
"""Effects beside each other: more are a search without end."""
SEARCHED: Final = 0.1
"""Of a flight without a jump, that one is searched for in vain: it is decided later, with noise
that is found with it in the model."""
SPACINGS_S: Final = (2.0, 0.5)
"""Spacing of the two rounds of a search, s: the likelihood bends over a second."""
FINER: Final = 4
"""Times that moments are closer in a next round, where the likelihood bends between them."""
FURTHEST: Final = 3
"""Times that a search goes on beyond its edge."""
ONCE_MORE: Final = 12
"""Moments about the best one of a search that are looked at once more, with the jump in place."""
MOST_AT_ONCE: Final = 24
"""Moments with a column each in one pass: its time grows with their square."""
SHORTEST_S: Final = 4.0
"""s of flight between two clipped parts that are worth keeping."""
TOGETHER_S: Final = 2.0
"""s; samples at a rail that are no further apart are of one time at it."""
WORTH_S: Final = 10.0
"""s of flight that are worth a look without the rest of it: the filter settles in as much."""
FORGOTTEN_S: Final = 45.0
"""s of flight to either side of a jump that are gone through: a filter that GPS corrects has then
forgotten nine tenths of what tells it (two simulated copters and planes: 0.95 to 1.00; 0.80 to 0.96
after 35 s, for the likeliest gyroscope is quiet)."""
MOST_PARTS: Final = 128
"""Parts of a flight, at the most, in which its constants are asked to be the same: of 24 minutes
every block."""
MOST_EDGES: Final = 14
"""Moments at which a receiver's error begins, changes or ends."""
CREEPS_S: Final = (6.0, 8.0, 11.0, 15.0, 20.0, 27.0, 36.0, 48.0, 64.0)
"""s over which an error of a receiver may have grown.  What comes and goes within twice the time of
its colour is noise, and what grows slower than all of them an EKF takes for true."""
