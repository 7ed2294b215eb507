"""What looks like noise in the samples is taken for it, or for real, as the velocity says."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.cleared import cleared
from onboard.core.estimate.calibrator import Calibrator
from onboard.core.inputs.samples import AttitudeSample, GpsFix, ImuSample
from onboard.core.maths.frames import rotation_from_euler
from onboard.core.physics.effect import Origin
from tests.core.estimate.test_simulated_flights import fed, flown

STEP, LATE, SHAKE = 0.02, 0.12, 0.6
"""s between samples, s that the receiver is late by, m/s^2 of white shaking."""


def shaken(samples, *, real):
    """The flight with noise in its samples; in its velocity, too, if it was really shaken so."""
    rng, R_nb, v, made = np.random.default_rng(3), np.eye(3), np.zeros(3), []
    times, speeds = [-np.inf], [v]
    for s in samples:
        out = s
        if isinstance(s, AttitudeSample):
            R_nb = rotation_from_euler(s.roll, s.pitch, s.yaw)
        elif isinstance(s, ImuSample):
            n = SHAKE * rng.normal(size=3)
            out = replace(s, f_b=tuple((np.array(s.f_b) + n).tolist()))
            v = v + STEP * (R_nb @ n)
            times.append(s.t)
            speeds.append(v)
        elif isinstance(s, GpsFix) and real:
            gained = speeds[int(np.searchsorted(times, s.t - LATE, side="right")) - 1]
            down = None if s.v_d is None else s.v_d + gained[2]
            out = replace(s, v_n=s.v_n + gained[0], v_e=s.v_e + gained[1], v_d=down)
        made.append(out)
    return made


@pytest.mark.slow
@pytest.mark.parametrize("real", [False, True])
def test_the_velocity_says_what_is_noise(real):
    samples, _ = flown("copter", 100.0, seed=6)
    made = fed(shaken(samples, real=real), Calibrator())
    sampled = made.engine(1).batches
    full = cleared(made, made.engine(1), sampled, Origin(made.first_sample)).full
    changed = any(
        np.abs(a.segment.raw_s - b.segment.raw_s).max() > 0.1
        for a, b in zip(full.batches, sampled, strict=True)
    )
    assert changed is not real
