"""What may be set after an ordinary short flight makes the force better: held against the truth."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.answers.recorded import Recorded
from onboard.answers.replay import replay
from onboard.core.estimate.determined import force_moments
from onboard.core.maths.accelerometer import parameter_names
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec, write_tlog

SLOW_STREAMS = {"RAW_IMU": 25.0, "ATTITUDE": 10.0}


def flight(tmp_path, seed, *, dull):
    """A minute and a half of a copter or a plane, two thirds of it in the air.

    If ``dull``, it hovers or flies straight on.
    """
    (imu,) = random_imus(seed, 1)
    path = tmp_path / f"{seed}.tlog"
    vehicle = ("copter", "plane")[seed % 2]
    spec = FlightSpec(
        vehicle=vehicle, duration=90.0, imus=(imu,), seed=seed, rates=SLOW_STREAMS, dull=dull
    )
    write_tlog(spec, path)
    return path, np.array((*imu.scale, *imu.offset))


@pytest.mark.slow
@pytest.mark.parametrize("dull", [False, True])
def test_what_may_be_set_makes_the_force_better(tmp_path, dull):
    settable = 0
    for seed in range(700, 704):
        path, truth = flight(tmp_path, seed, dull=dull)
        result = replay([path], Recorded())
        (c,), (advice,) = result.calibrations, result.advice
        if not advice.settable:
            continue
        settable += 1
        now = c.in_force_scale + c.in_force_offset
        to_set = advice.to_set()
        then = [to_set.get(n, x) for n, x in zip(parameter_names(1).six, now, strict=True)]
        M = force_moments(c.load_mean, c.load_square, truth)
        before, after = (float(e @ M @ e) for e in (np.array(now) - truth, np.array(then) - truth))
        assert after < before, seed
        # With what it claims to be left of the error, at three times its size.
        claimed = advice.plan.worth.error_after
        assert after < (3.0 * claimed) ** 2, seed
    assert settable >= 2
