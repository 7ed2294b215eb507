"""Two accelerometers of which one jumps: compared by all that is found, they agree."""

import numpy as np
import pytest

from onboard.answers.recorded import Recorded
from onboard.core.estimate.comparison import compare
from onboard.core.estimate.mean_force import in_the_mean, load_sigma, mean_columns
from onboard.mavlink.decode import Decoder
from sitl.builtin.effects import BiasStep
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

JUMP = BiasStep(time=70.0, x=0.5, y=-0.4, z=0.3, imu=2)
"""What accelerometer 2 reads too much from then on."""
TRUTH = (
    ImuTruth(scale=(1.01, 0.99, 1.02), offset=(0.1, -0.2, 0.1)),
    ImuTruth(scale=(0.98, 1.02, 1.0), offset=(-0.2, 0.1, 0.3)),
)


@pytest.fixture(scope="module")
def flown():
    """The recording, asked about both."""
    made, decoder = Recorded(), Decoder()
    for _, message in fly_messages(
        FlightSpec(vehicle="copter", duration=150.0, imus=TRUTH, effects=(JUMP,), seed=5)
    ):
        for sample in decoder.decode(message):
            made.feed(sample)
    made.finish()
    return made, [made.calibration(imu) for imu in (1, 2)]


def test_a_jump_of_one_is_no_contradiction_between_two(flown):
    made, calibrations = flown
    assert "bias_step" in {e.name for e in made.answer(2).diagnosis.effects}
    (pair,) = made.compared(calibrations).pairs
    assert pair.p_value > 0.01
    off = np.array(pair.estimated) - np.array(pair.own)
    assert np.abs(off).max() < 0.1
    (alone,) = compare(calibrations, (made.kept(),)).pairs
    jumped = np.array(alone.estimated) - np.array(pair.estimated)
    share = 0.5 * np.array([0.5, -0.4, 0.3])
    np.testing.assert_allclose(jumped, -share, atol=0.12)
    assert np.abs(np.array(alone.estimated) - np.array(alone.own)).max() > 0.15
    assert alone.chi_square > pair.chi_square + 3.0


def test_sigmas_of_the_mean_are_those_of_all_that_is_in_it(flown):
    """The mean of a flight is known better than an offset that holds for half of it."""
    made, calibrations = flown
    found = in_the_mean(calibrations[1], made.engine(2))
    sigma, own = np.array(found.offset_sigma), np.array(calibrations[1].offset_sigma)
    assert np.all(sigma <= 1.001 * own)
    assert np.linalg.eigvalsh(np.array(found.covariance)).min() > 0.0


def test_without_anything_beside_the_six_nothing_changes(flown):
    made, calibrations = flown
    assert in_the_mean(calibrations[0], made.engine(1)) is calibrations[0]


def test_columns_of_scale_and_offset_are_the_mean_sample_and_one(flown):
    made, _ = flown
    engine = made.engine(1)
    columns = mean_columns(engine)[:, engine.model.slices["six"]]
    raw = np.concatenate([b.segment.raw_s for b in engine.batches])
    np.testing.assert_allclose(columns[:, 3:], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(columns[:, :3], np.diag(raw.mean(axis=0)), atol=0.05)
    assert mean_columns(engine, lambda batch, t: t < 0.0) is None


def test_how_a_force_changes_with_the_load_is_as_unsure_as_the_scale(flown):
    """Offsets do not change with it, so that no more than the scale's own sigma is left."""
    made, _ = flown
    engine = made.engine(1)
    scale = engine.model.slices["six"].start + np.arange(3)
    sigma = np.sqrt(np.diag(engine.solution().covariance))[scale]
    by_load = load_sigma(engine)
    # Along z loads are the largest, and nothing else of the model changes with them.
    assert by_load[2] == pytest.approx(sigma[2], rel=0.5)
    assert np.all(by_load > 0.0)
