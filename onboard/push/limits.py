"""Every number that decides something about a push: its unit, and where it comes from."""

from __future__ import annotations

from typing import Final

# What may be written at all

SCALE_BOUNDS: Final = (0.8, 1.2)
"""ArduPilot's documented range of INS_ACCSCAL_*, no unit."""
OFFSET_BOUND: Final = 3.5
"""ArduPilot's documented range of INS_ACCOFFS_* to both sides, m/s^2."""
BACK_OFFSET_BOUND: Final = 9.80665
"""m/s^2: what ArduPilot's own calibration accepts (AccelCalibrator::accept_result), wider than what
is documented.  As much may have been in force and flown, and so is written back; a scale has to lie
in the same range there, or to be zero, which ArduPilot takes for none."""
ARMING_THRESHOLD: Final = 0.75
"""ArduPilot's default of ARMING_ACCTHRESH, m/s^2, where it has not told its own."""

# In flight, where the EKF has to follow each step

IN_FLIGHT_SCALE_STEP: Final = 0.005
"""No unit.  0.05 m/s^2 at 1 g, as the offset's."""
IN_FLIGHT_OFFSET_STEP: Final = 0.05
"""m/s^2.  Tuned: small beside the accelerations of flight; larger steps wait for the landing."""
EKF_WATCHED_S: Final = 30.0
"""So long after a push in flight an EKF that became unhealthy is put down to it, s.  Tuned."""

# When

DISARMED_S: Final = 5.0
"""s: five HEARTBEATs that say so."""
LEAST_DISARMED_S: Final = 2.0
"""s: two HEARTBEATs, which come once a second.  A vehicle that has just been armed has not said so
for up to a second, so that one HEARTBEAT alone says nothing of the time after it."""
FRESH_S: Final = 1.5
"""s; a landed push sends a new value only so long after a HEARTBEAT that said disarmed: one
HEARTBEAT and a half, so that a lost one makes it wait."""
ARMED_UNDO_S: Final = 2.0
"""s after the first HEARTBEAT that says armed in which old values are still written back: ArduPilot
lets motors leave the idle 2 s after arming at the earliest; in the air no step is taken."""
SETTLE_S: Final = 2.0
"""s.  Must exceed the longest delay of a link that repeats packets, so that none of our writes is
still on its way when all six are read and believed; twice that on the way back, where what is on
its way differs, and answers may be as late."""
TRANSACTION_S: Final = 60.0
"""s for the way to new values: two or three on a good link; a poor one gets its time."""
UNDO_ROUNDS: Final = 3
"""Values that were undone and came back so often are somebody's doing: it is left open."""

# What the next flight says of a push

JUDGED_AFTER_S: Final = 60.0
"""s of flight with trusted GPS before anything is said.  Tuned: errors show in tens of seconds."""
RESIDUAL_MARGIN: Final = 0.1
"""Share by which a residual may grow from one flight to the next.  Tuned."""
CLEAR_EVIDENCE: Final = 9.0
"""Twice a difference of log-likelihoods: three standard deviations for one number."""
SAME: Final = 1e-6
"""No unit and m/s^2: parameters are float32, which has seven digits."""
ROUNDED: Final = 1e-4
"""No unit and m/s^2: a value this near to what was written is what the autopilot made of it.  As a
calibration it is nothing: a hundredth of the least change that is worth a push."""
UNCHANGED: Final = 1.2e-7
"""Below FLT_EPSILON ArduPilot takes two floats for equal and may not store the difference."""
