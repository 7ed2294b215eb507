"""Parameters that are told late: what was taken for raw before them must not spoil the sums."""

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.samples import ParameterValue
from onboard.core.maths.accelerometer import parameter_names
from onboard.mavlink.codec import Codec
from onboard.mavlink.decode import Decoder
from sitl.builtin.truth import ImuTruth
from sitl.recording import FlightSpec, fly

SIX = parameter_names(1).six
SCALE, OFFSET = (1.02, 0.985, 1.015), (0.2, -0.15, 0.3)
IN_FORCE = dict(zip(SIX, (1.05, 0.97, 0.96, 0.9, -0.8, 0.7), strict=True))


@pytest.fixture(scope="module")
def flight():
    """Samples of a flight whose autopilot has parameters in force that are far from nominal."""
    spec = FlightSpec(
        vehicle="copter",
        duration=90.0,
        imus=(ImuTruth(scale=SCALE, offset=OFFSET),),
        parameters=IN_FORCE,
    )
    codec, decoder = Codec(), Decoder(1, 1)
    return [
        sample
        for _, raw in fly(spec)
        for frame in codec.feed(raw)
        if frame.message is not None
        for sample in decoder.decode(frame.message)
    ]


def estimate(samples, *, told_at):
    """Calibration when the six are told not before ``told_at`` (s)."""
    calibrator = Calibrator()
    held = []
    for sample in samples:
        if isinstance(sample, ParameterValue) and sample.name in SIX:
            held.append(sample)
            continue
        t = getattr(sample, "t", None)
        if held and t is not None and t >= told_at:
            for parameter in held:
                calibrator.feed(parameter)
            held = []
        calibrator.feed(sample)
    calibrator.finish()
    return calibrator.calibration(1)


@pytest.mark.slow
@pytest.mark.parametrize("told_at", [12.0, 40.0])
def test_late_parameters_cost_flight_but_no_truth(flight, told_at):
    late = estimate(flight, told_at=told_at)
    assert late.parameters_known
    assert late.trusted_s < 90.0 - told_at + 10.0
    error = np.array(late.scale + late.offset) - np.array(SCALE + OFFSET)
    sigma = np.array(late.scale_sigma + late.offset_sigma)
    assert np.all(np.abs(error) < 4.0 * sigma)
