"""What was learned before a gap: added by a flight that would have noticed another sensor."""

import numpy as np
import pytest

from onboard.core.estimate.agreement import STRANGER, passes_for_it
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.settings import CalibratorSettings
from onboard.core.inputs.samples import ImuSample, ParameterValue
from onboard.core.maths.accelerometer import parameter_names
from onboard.core.maths.chi_square import CHI_SQUARE_999
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly_messages

ONCE = CalibratorSettings(refine=False)
OURS = ImuTruth(scale=(1.02, 0.985, 1.015), offset=(0.2, -0.15, 0.3))
ANOTHER = ImuTruth(scale=(0.99, 1.01, 0.995), offset=(-0.1, 0.2, -0.2))
PRIOR = np.diag([0.03**2] * 3 + [0.5**2] * 3)


def samples(imu, *, seed=1, duration=110.0):
    """A flight on a board that says nothing of itself but what every board of its model says."""
    decoder, out = Decoder(1, 1), []
    spec = FlightSpec(vehicle="copter", duration=duration, imus=(imu,), seed=seed)
    for _, message in fly_messages(spec):
        out += decoder.decode(message)
    names = {*parameter_names(1).six, "INS_ACC_ID"}
    told = [s for s in out if isinstance(s, ParameterValue)]
    assert names <= {s.name for s in told}
    return told + [s for s in out if not isinstance(s, ParameterValue)]


def flown(flight, before=b""):
    made = Calibrator.from_bytes(before, ONCE) if before else Calibrator(ONCE)
    for sample in flight:
        made.feed(sample)
    made.finish()
    return made


@pytest.fixture(scope="module")
def saved():
    return flown(samples(OURS)).to_bytes()


@pytest.mark.slow
def test_another_board_of_the_same_model_does_not_get_the_sums_of_this_one(saved):
    flight = samples(ANOTHER, seed=2)
    got = flown(flight, saved)
    assert got.calibration(1).rejected["saved_contradicted"] == 1
    assert got.waiting == ()
    alone = flown(flight)
    assert got.calibration(1).scale == alone.calibration(1).scale
    assert got.calibration(1).offset == alone.calibration(1).offset


@pytest.mark.slow
def test_a_second_flight_of_the_same_board_adds_up(saved):
    flight = samples(OURS, seed=3)
    both, alone = flown(flight, saved), flown(flight)
    assert both.calibration(1).rejected["restored"] == 1
    assert both.calibration(1).trusted_s > 1.5 * alone.calibration(1).trusted_s
    tighter = np.array(both.calibration(1).offset_sigma) / alone.calibration(1).offset_sigma
    assert np.all(tighter < 1.0)


@pytest.mark.slow
@pytest.mark.parametrize("imu", [OURS, ANOTHER])
def test_a_hop_that_would_not_notice_another_sensor_confirms_nothing(saved, imu):
    flight = samples(imu, seed=4, duration=50.0)
    took_off = next(s.t for s in flight if isinstance(s, ImuSample) and s.f_b[2] < -10.5)
    hop = [s for s in flight if s.t is None or s.t < took_off + 12.0]
    got = flown(hop, saved)
    refused = got.calibration(1).rejected if got.imus else {}
    assert "restored" not in refused
    if imu is OURS:
        assert got.waiting == (1,)
        assert len(got.to_bytes()) > len(saved) // 2, "and loses nothing"


def test_the_bound_on_taking_a_stranger_for_the_sensor_is_a_bound():
    rng = np.random.default_rng(5)
    for sigmas in (
        (0.01, 0.01, 0.02, 0.1, 0.1, 0.3),
        (0.03, 0.03, 0.03, 0.02, 0.02, 0.5),
        (0.02, 0.03, 0.03, 0.3, 0.5, 0.5),
    ):
        both = np.diag(np.square(sigmas))
        strange = np.sqrt(np.maximum(np.diag(2.0 * PRIOR - both), 0.0))
        apart = rng.standard_normal((200_000, 6)) * strange
        missed = np.mean(np.sum(apart**2 / np.diag(both), axis=1) < CHI_SQUARE_999[6])
        assert missed <= passes_for_it(both, PRIOR) + 3e-3
    assert passes_for_it(np.diag([1e-6] * 3 + [1e-4] * 3), PRIOR) < STRANGER
    assert passes_for_it(2.0 * PRIOR, PRIOR) == 1.0
