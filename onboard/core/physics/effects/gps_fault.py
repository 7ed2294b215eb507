"""GPS velocities that cannot be true."""

from __future__ import annotations

from onboard.core.physics import danger
from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import fixed, times


class GpsFault(Effect):
    """The receiver reports a velocity that inertia contradicts, for a while: it is left out."""

    effect = "gps_fault"
    code = 16
    title = "GPS velocity was false for a while"
    sentence = "GPS velocity was false for a while"
    meaning = "`offset`, m/s, where it shows; `duration`, s, and when"
    bearing = Bearing.HARMLESS
    source = "innovation gate, and dead reckoning over what the trust window has refused"
    cure = "look at the antenna's view of the sky, at jamming, at the receiver's power"
    apart = "fly the same place again: a multipath returns there, a failing receiver anywhere"
    of_flight = True
    excluded = True

    @classmethod
    def danger(cls, found: Finding) -> str:
        """How far it would have led an autopilot astray, by the longest of the spells."""
        off = found.unknowns.get("offset")
        longest = max((b - a for a, b in found.intervals), default=0.0)
        return "" if off is None else danger.of_false_velocity(off.value, longest)

    @classmethod
    def size(cls, found: Finding) -> str:
        """``by 1.5 m/s, 33 s in all, 2 times``."""
        whole = sum(b - a for a, b in found.intervals)
        said = f"{fixed(whole, 0)} s in all{times(len(found.intervals))}"
        off = found.unknowns.get("offset")
        return said if off is None else f"by {fixed(off.value, 1)} m/s, {said}"
