"""An offset that jumps twice is two jumps, and nothing slower; what is slower is no two jumps."""

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

pytestmark = pytest.mark.slow
SIGMAS = 4.0


def diagnosed(*effects, vehicle="copter", seed=5, duration=190.0):
    imus = random_imus(seed)
    spec = FlightSpec(vehicle=vehicle, seed=seed, duration=duration, imus=imus, effects=effects)
    return diagnose(heard(spec), 1), imus[0]


def jumps_of(d):
    found = [e.unknowns for e in d.effects if e.name == "bias_step"]
    return sorted(found, key=lambda u: u["time"].value)


@pytest.mark.parametrize(
    ("vehicle", "seed", "first", "second"),
    [
        # It gives way and comes back: on the whole flight hardly a jump at all.
        ("copter", 5, (90.0, (0.25, 0.0, -0.2)), (135.0, (-0.25, 0.0, 0.2))),
        # Another axis, and it stays.
        ("plane", 6, (80.0, (0.25, 0.0, 0.0)), (140.0, (0.0, 0.0, -0.3))),
    ],
)
def test_two_jumps_are_told_and_the_six_are_those_before_them(vehicle, seed, first, second):
    steps = [concealed.BiasStep(time=t, x=x, y=y, z=z) for t, (x, y, z) in (first, second)]
    d, truth = diagnosed(*steps, vehicle=vehicle, seed=seed)
    told = jumps_of(d)
    assert len(told) == 2
    assert not {e.name for e in d.effects} & {"bias_ramp", "temperature_drift", "scale_step"}
    for unknowns, (time, sizes) in zip(told, (first, second), strict=True):
        assert abs(unknowns["time"].value - time) < 2.0
        for axis, size in zip("xyz", sizes, strict=True):
            q = unknowns[axis]
            assert abs(q.value - size) < SIGMAS * np.hypot(q.sigma, 0.003)
    c = d.calibration
    for told, true, sigma in (
        (c.scale, truth.scale, c.scale_sigma),
        (c.offset, truth.offset, c.offset_sigma),
    ):
        assert np.all(np.abs(np.subtract(told, true)) < SIGMAS * np.asarray(sigma))


def test_what_grows_is_no_staircase():
    d, _ = diagnosed(concealed.BiasRamp(x=0.002, z=-0.0015), seed=7)
    assert "bias_ramp" in {e.name for e in d.effects}
    assert not jumps_of(d)
