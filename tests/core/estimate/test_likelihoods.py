"""What the same flight's likelihoods about different latencies may be compared by."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import AttitudeSample
from onboard.mavlink.decode import Decoder
from sitl.recording import FlightSpec, fly_messages

STEP = np.radians(0.1)
"""What the recorded attitude is rounded to, rad."""


def rounded(sample):
    if not isinstance(sample, AttitudeSample):
        return sample
    angles = {k: round(getattr(sample, k) / STEP) * STEP for k in ("roll", "pitch", "yaw")}
    return replace(sample, **angles)


@pytest.fixture(scope="module")
def engine():
    """A copter whose attitude is recorded at 10 Hz, at the very instants of its fixes."""
    spec = FlightSpec(vehicle="copter", seed=8, duration=90.0, rates={"ATTITUDE": 10.0})
    settings = CalibratorSettings(refine=False, buffer_s=3600.0)
    calibrator, decoder = Calibrator(settings), Decoder()
    for _, message in fly_messages(spec):
        for sample in decoder.decode(message):
            calibrator.feed(rounded(sample))
    calibrator.finish()
    engine = calibrator.engine(1)
    engine.tune()
    return engine


@pytest.mark.slow
def test_midway_between_samples_of_the_attitude_all_is_likelier_and_what_a_receiver_says_is_not(
    engine,
):
    """Of its rounding half the variance is left there, whatever the latency is."""
    point, noise, known = engine.point, engine.noise, engine.known
    told = []
    for off in (-0.04, 0.0, 0.04):
        engine._move(replace(point, delay=point.delay + off), noise)
        engine._seed = known
        made = engine._new_pass()
        engine._over([engine.batches], made)
        told.append((made.log_likelihoods()[0], made.log_likelihood_of_fixes()))
    engine._move(point, noise)
    everything, of_fixes = (np.array(x) for x in zip(*told, strict=True))
    assert point.delay == pytest.approx(0.12, abs=2e-3)
    assert (everything[[0, 2]] - everything[1]).min() > 15.0
    assert np.ptp(of_fixes) < 8.0


@pytest.mark.slow
def test_likelihoods_of_fixes_and_of_all_differ_by_what_attitudes_say(engine):
    """Sums of two kinds of innovations, which are all that there are."""
    made = engine._new_pass()
    engine._over([engine.batches], made)
    fixes, everything = made.of_fixes.member(0), made.sums.member(0)
    epochs = sum(len(batch.fixes) for batch in engine.batches)
    assert 2.0 * epochs < fixes.rows <= 4.0 * epochs
    assert 2.0 * epochs < everything.rows - fixes.rows <= 3.0 * epochs
    theta = np.linalg.solve(everything.N + np.diag(engine.model.prior_sigma**-2.0), everything.b)
    assert 0.7 < fixes.residual(theta) / fixes.rows < 1.3
    left = everything - fixes
    assert np.linalg.eigvalsh(left.N).min() > -1e-6 * np.linalg.eigvalsh(everything.N).max()
