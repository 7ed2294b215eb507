"""Noise that is larger than noise of its kind is: something that no model has stands behind it.

Noise is estimated with what else is missing, and takes in whatever has no column: a gyroscope that
fails bends the heading by tens of degrees, and a heading's slow error that may be as large as it
likes makes a perfect fit of that.  Each level has a highest value, which is physics
(:data:`onboard.core.filter.limits.LIMITS`); a flight that asks for it asks for more.

A heading that is wrong spoils nothing of an accelerometer (so it is with a constant one): it is
taken out of the calibration, and worth knowing.
"""

from __future__ import annotations

from typing import Final

from onboard.core.filter.noise import NoiseLevels

GPS: Final = "GPS errs by more than a receiver does"
HEADING: Final = "the autopilot's heading is off by more than 30 degrees, as no compass is"
TILT: Final = "the autopilot's roll and pitch are off by more than a state estimate is that works"
GYROSCOPE: Final = "the gyroscope errs by more than one that works"
FORCE: Final = "the accelerometer is noisier than vibration makes one that works"
WORDS: Final = {
    "velocity": GPS,
    "velocity_colour": GPS,
    "height": GPS,
    "height_walk": GPS,
    "jitter": GPS,
    "force_walk": FORCE,
    "lift_walk": FORCE,
    "shaken_walk": FORCE,
    "shaken_lift": FORCE,
    "tilt_walk": GYROSCOPE,
    "bias_walk": GYROSCOPE,
    "attitude": TILT,
    "attitude_white": TILT,
    "heading": HEADING,
    "heading_walk": HEADING,
}
"""What a level at its highest says."""


def excess_in_words(noise: NoiseLevels, *, misled: bool = False) -> str:
    """What is no noise any more, one sentence; empty if all is.

    Args:
        noise: levels.
        misled: whether the accelerometer is known to have misled the recorded attitude by more than
            a state estimate makes up for: what the gyroscope says otherwise is then that.
    """
    words = {**WORDS, **{k: TILT for k, said in WORDS.items() if said == GYROSCOPE and misled}}
    said = list(dict.fromkeys(words[name] for name in noise.at_highest))
    return f"{', and '.join(said)}." if said else ""


def spoils(noise: NoiseLevels) -> bool:
    """Whether any of it is not the heading's."""
    return any(WORDS[name] != HEADING for name in noise.at_highest)
