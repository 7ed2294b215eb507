"""What jumps twice is two jumps, of either kind, and nothing slower; what is slower is no two."""

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.procedure import diagnose
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

pytestmark = pytest.mark.slow
SIGMAS = 4.0
FIRST_S = 1.0
"""First sample, s on the boot clock, which the simulator's times are of."""


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
    d, _ = diagnosed(concealed.BiasRamp(x=0.002, z=-0.0015), seed=7, duration=160.0)
    assert "bias_ramp" in {e.name for e in d.effects}
    assert not jumps_of(d)


@pytest.mark.parametrize(
    ("seed", "of_scale", "of_offset"),
    [(8, 75.0, 135.0), (9, 120.0, 70.0), (10, 100.0, 100.0)],
)
def test_scale_and_offset_that_jump_are_both_told(seed, of_scale, of_offset):
    """One after the other, or both at once: neither is taken for something slower."""
    steps = (
        concealed.ScaleStep(time=of_scale, z=0.05),
        concealed.BiasStep(time=of_offset, x=-0.4),
    )
    d, truth = diagnosed(*steps, vehicle="plane", seed=seed)
    told = {e.name: e.unknowns for e in d.effects}
    assert {"scale_step", "bias_step"} <= set(told)
    assert not set(told) & {"bias_ramp", "temperature_drift", "throttle_coupling", "clock_skew"}
    for name, time, axis, size in (
        ("scale_step", of_scale, "z", 0.05),
        ("bias_step", of_offset, "x", -0.4),
    ):
        q = told[name]
        assert abs(q["time"].value + FIRST_S - time) < 0.5
        # What reads too much is counted by the calibration's own scale.
        assert abs(q[axis].value - size) < SIGMAS * np.hypot(q[axis].sigma, 0.03 * abs(size))
    c = d.calibration
    off = np.subtract(c.scale + c.offset, truth.scale + truth.offset)
    assert np.all(np.abs(off) < SIGMAS * np.array(c.scale_sigma + c.offset_sigma))
