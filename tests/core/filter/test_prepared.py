"""What the filter is told of an epoch's noise: a stamp that is off turns with the vehicle."""

import numpy as np
import pytest

from onboard.core.filter.limits import STAMP_JITTER_S
from onboard.core.filter.prepared import prepare
from onboard.core.filter.state import PSI, H, V
from onboard.core.inputs.segments import Fixes, Segment
from onboard.core.maths.frames import rotation_from_euler, vector_from_rotation
from onboard.core.model.linearisation import Linearisation
from onboard.core.model.nuisances import Six
from onboard.core.model.regressors import Model


def turning(rate):
    """Six seconds of a yaw at a constant rate, rad/s."""
    t = np.arange(0.0, 6.0, 0.02)
    R = rotation_from_euler(np.zeros(len(t)), np.zeros(len(t)), rate * t)
    w_b = np.tile([0.0, 0.0, rate], (len(t), 1))
    still = np.tile([0.0, 0.0, -9.80665], (len(t), 1))
    return Segment(t, w_b, still, t, R, np.eye(3))


@pytest.mark.parametrize("rate", [0.0, 1.0, 4.0])
def test_an_attitude_whose_stamp_is_off_is_off_by_that_times_the_rate(rate):
    segment = turning(rate)
    at = np.arange(1.0, 5.0, 0.2)
    fixes = Fixes(at, np.zeros((len(at), 3)), np.zeros(len(at)), np.zeros(len(at)))
    point = Linearisation(delay=0.0)
    made = prepare(segment, fixes, np.ones(len(at), bool), Model([Six()]), point, np.zeros(3))
    # Independently: what the recorded attitude is when it is asked for a jitter too late.
    now, _ = segment.attitude_at(at)
    late, _ = segment.attitude_at(at + STAMP_JITTER_S)
    off = np.linalg.norm(vector_from_rotation(np.swapaxes(now, -1, -2) @ late), axis=1)
    for epoch, angle in zip(made.epochs, off, strict=True):
        assert epoch.noise[PSI] == pytest.approx(angle**2, rel=1e-3, abs=1e-15)
        assert not epoch.noise[V].any()
        assert epoch.noise[H] == 0.0
