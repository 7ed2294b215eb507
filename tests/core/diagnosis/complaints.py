"""Flights whose EKF complains of GPS when a test says so, and at no other time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from onboard.core.diagnosis.procedure import diagnose
from onboard.core.diagnosis.records import Diagnosis
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.gps.trust import EKF_ATTITUDE, EKF_GPS_GLITCHING
from onboard.core.inputs.samples import EkfHealth
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import GpsTruth
from sitl.recording import FlightSpec, fly_messages

PROMPT = GpsTruth(delay=0.04, stamped_early=0.02)


def complained(
    spec: FlightSpec, complaints: Sequence[tuple[float, float]] = ()
) -> tuple[Diagnosis, float]:
    """What is said of a flight, and the time of its first sample, s.

    Args:
        spec: the flight.
        complaints: from and to, s on the boot clock.
    """
    made, decoder = Calibrator(CalibratorSettings(refine=False, buffer_s=3600.0)), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            if isinstance(sample, EkfHealth):
                bad = any(begin <= sample.t <= end for begin, end in complaints)
                flags = EKF_ATTITUDE | (EKF_GPS_GLITCHING if bad else 0)
                made.feed(replace(sample, flags=flags))
            else:
                made.feed(sample)
    made.finish()
    return diagnose(made, 1), made.first_sample
