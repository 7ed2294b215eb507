"""Samples with one time stamp and different content: somebody else speaks in the vehicle's voice.

An autopilot stamps each sample once.  The same packet may come twice, and then it says the same.
Where two say different things with one stamp, one of them is not the vehicle's, and nobody can tell
which: neither is to be believed.
"""

from __future__ import annotations

from typing import TypeAlias

from onboard.core.inputs.samples import FIX_3D, AttitudeSample, GpsFix, ImuSample, Sample
from onboard.mavlink import limits

Key: TypeAlias = tuple[str, int, str]


class Repetitions:
    """Remembers the newest sample of each stream; ``now`` is the link's clock, s."""

    def __init__(self) -> None:
        self.contradictions = 0
        self._newest: dict[Key, Sample] = {}
        self._spoilt: dict[Key, float | None] = {}
        self._doubtful_at = -limits.DOUBTFUL_S

    def contradicts(self, sample: Sample, now: float) -> Sample | None:
        """A sample of the same stream and stamp that says something else; None: all is well.

        Once a stamp is spoilt, whatever comes with it is contradicted, by itself if need be.
        """
        key = _stream(sample)
        if key is None:
            return None
        before = self._newest.get(key)
        if before is None or before.t != sample.t:
            self._newest[key] = sample
            return None
        if self._spoilt.get(key) != sample.t and _content(before) == _content(sample):
            return None
        self._spoilt[key] = sample.t
        self.contradictions += 1
        self._doubtful_at = now
        return before

    def doubtful(self, now: float) -> bool:
        """Whether that has happened of late."""
        return now - self._doubtful_at < limits.DOUBTFUL_S


def _stream(sample: Sample) -> Key | None:
    """Which stream it belongs to; None where it cannot contradict another."""
    if isinstance(sample, ImuSample):  # asked of every sample: this is much faster than a pattern
        return "imu", sample.imu, sample.source._value_
    if isinstance(sample, AttitudeSample):
        return "attitude", int(sample.turned), ""
    # Without a fix the stamp stays that of the last one.
    if isinstance(sample, GpsFix) and sample.fix_type >= FIX_3D:
        return "gps", sample.receiver, ""
    return None


def _content(sample: Sample) -> tuple[object, ...]:
    """What two packets of one sample have in common, NaN being like NaN."""
    match sample:
        case ImuSample():
            return (sample.f_b, sample.w_b)
        case GpsFix():  # quality is updated between fixes, position and velocity are not
            return (sample.latitude, sample.longitude, repr((sample.v_n, sample.v_e)))
        case AttitudeSample():
            return (sample.roll, sample.pitch, sample.yaw)
        case _:
            return ()
