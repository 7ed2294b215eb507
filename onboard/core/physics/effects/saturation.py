"""An accelerometer at the rail of its range."""

from __future__ import annotations

from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import fixed, times


class Saturation(Effect):
    """The accelerometer clips: what was clipped is left out of the fit."""

    effect = "saturation"
    code = 15
    title = "The accelerometer hit its limit"
    sentence = "the accelerometer hit its limit"
    meaning = "`limit`, m/s², and when"
    bearing = Bearing.NO_ONE_NUMBER
    source = "full-scale range of the sensor; samples that stay at one extreme, VIBE.Clip counts"
    cure = "damp the mount; use a sensor with a wider range"
    apart = "fly the same gently: what clips, clips no more"
    excluded = True

    @classmethod
    def danger(cls, found: Finding) -> str:  # noqa: ARG003 - at the rail any size is too much
        """At its limit an accelerometer does not feel what it is exposed to."""
        return (
            "meanwhile the autopilot does not know how it is accelerated, and its height and "
            "velocity run away"
        )

    @classmethod
    def size(cls, found: Finding) -> str:
        """``of 78.5 m/s², 3 times``."""
        q = found.unknowns.get("limit")
        return f"of {fixed(q.value, 1)} m/s²{times(len(found.intervals))}" if q else ""
