"""Single samples of an accelerometer that are false."""

from __future__ import annotations

from onboard.core.physics.effect import Bearing, Effect
from onboard.core.physics.finding import Finding
from onboard.core.physics.wording import fixed


class AccelerometerSpikes(Effect):
    """Single samples that no motion has made: what their neighbours say takes their place."""

    effect = "accelerometer_spikes"
    code = 24
    title = "The accelerometer has false samples"
    sentence = "single samples of the accelerometer are false"
    meaning = "`size`, m/s², root mean square of what they are off by, `share` of all, and when"
    bearing = Bearing.HARMLESS
    source = "distance from the samples next to it; the receiver's velocity says if it was felt"
    cure = "look for the sensor's bus errors: cable, supply, clock of the bus; replace it"
    apart = "fly on: what is false does not go with what the vehicle does"
    excluded = True

    @classmethod
    def size(cls, found: Finding) -> str:
        """``of 9.8 m/s², 1.00 % of all``."""
        q, share = found.unknowns.get("size"), found.unknowns.get("share")
        if q is None or share is None:
            return ""
        return f"of {fixed(q.value, 1)} m/s², {fixed(100.0 * share.value, 2)} % of all"
