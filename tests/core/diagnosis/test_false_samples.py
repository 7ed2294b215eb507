"""Single false samples of a whole flight: told, left out, and not taken for physics."""

import numpy as np
import pytest

from onboard.answers.answer import answer
from onboard.core.estimate.result import Status
from sitl.builtin.effects import AccelerometerSpikes
from sitl.builtin.truth import ImuTruth
from tests.core.estimate.test_simulated_flights import fed, flown

IMU = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
SIX = np.array(IMU.scale + IMU.offset)


def asked(*effects):
    samples = flown("copter", 150.0, seed=8, imu=IMU, effects=effects)[0]
    return answer(fed(samples), 1)


def beside_latency(found):
    """What was found; the receiver is late, and nobody has told by how much."""
    return [e for e in found.diagnosis.effects if e.name != "gps_latency"]


@pytest.mark.slow
@pytest.mark.parametrize(("size", "share"), [(9.8, 0.01), (40.0, 0.002)])
def test_false_samples_are_no_averaging_no_antenna_and_no_hysteresis(size, share):
    found = asked(AccelerometerSpikes(size=size, share=share))
    (spikes,) = beside_latency(found)
    assert spikes.name == "accelerometer_spikes"
    assert spikes.unknowns["size"].value == pytest.approx(size, rel=0.25)
    by_chance = np.sqrt(share / (50.0 * 120.0))
    assert spikes.unknowns["share"].value == pytest.approx(share, abs=3.5 * by_chance)
    c = found.calibration
    off = (np.array(c.scale + c.offset) - SIX) / np.array(c.scale_sigma + c.offset_sigma)
    assert np.max(np.abs(off)) < 3.5
    assert c.status is Status.CALIBRATED
