"""What a person is told of an accelerometer that dies in flight."""

from dataclasses import replace

import pytest

from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import ImuSample
from onboard.daemon.learning.learner import Learner
from onboard.daemon.learning.store import Store
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, fly_messages

TIMES = [(50.0, 60.0), (75.0, 79.0)]
DEAD = (1.0, 1.0, 1.0)


def told(learner, samples, imu):
    """What the learner says of stuck accelerometers, and when, of batches of half a second."""
    out, batch, since = [], [], -1.0
    for sample in samples:
        if not isinstance(sample, ImuSample):
            batch.append(sample)
            continue
        broken = sample.imu == imu and any(a <= sample.t <= b for a, b in TIMES)
        batch.append(replace(sample, f_b=DEAD) if broken else sample)
        if sample.t > since + 0.5:
            news = learner.learn(batch, judging=()).news
            out += [(sample.t, n.text) for n in news if n.kind == "imu_stuck"]
            batch, since = [], sample.t
    return out


@pytest.mark.slow
@pytest.mark.parametrize("imus", [1, 2])
def test_each_time_is_told_once_and_while_it_lasts_or_soon_after(tmp_path, imus):
    spec = FlightSpec(vehicle="copter", seed=8, duration=120.0, imus=random_imus(8, imus))
    decoder = Decoder()
    samples = [s for _, message in fly_messages(spec) for s in decoder.decode(message)]
    settings = CalibratorSettings(refine=False)
    learner = Learner(Store(tmp_path), settings, clock=lambda: 0.0, wall_clock=lambda: 0.0)
    said = told(learner, samples, imus)
    assert [text for _, text in said] == [f"IMU {imus} repeats one reading in flight"] * 2
    for (when, _), (began, ended) in zip(said, TIMES, strict=True):
        assert began < when < ended + 15.0
