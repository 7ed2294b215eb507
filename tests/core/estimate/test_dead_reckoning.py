"""Dead reckoning against motions that are known in closed form."""

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.estimate.dead_reckoning import Chain, free_drift
from onboard.core.filter.traces import EpochState
from onboard.core.maths.earth import STANDARD_GRAVITY, coriolis_n, earth_rate_n, transport_rate_n
from onboard.core.maths.frames import rotation_from_vector

LATITUDE, STEP = 0.8, 0.2


def steady(v_n, horizon, step=STEP):
    """Level flight at a constant velocity over the turning earth, axes kept along NED.

    Raw force is zero and the whole force is in beta, so that two calibrations are two forces.
    """
    turn = earth_rate_n(LATITUDE) + transport_rate_n(LATITUDE, 0.0, v_n)
    k = np.arange(round(horizon / step))
    chain = Chain(
        start=k * step,
        end=(k + 1) * step,
        turn=np.tile(rotation_from_vector(turn * step), (len(k), 1, 1)),
        by_scale=np.zeros((len(k), 3, 3)),
        by_offset=np.tile(step * np.eye(3), (len(k), 1, 1)),
        velocity=np.tile(v_n, (len(k), 1)),
        latitude=np.full(len(k), LATITUDE),
    )
    state = EpochState(0.0, np.zeros(3), np.eye(3), v_n, np.zeros(3))
    force = -np.array([0.0, 0.0, STANDARD_GRAVITY]) - coriolis_n(LATITUDE, 0.0, v_n)
    return chain, [state], force


@pytest.mark.parametrize("v_n", [(20.0, 0.0, 0.0), (0.0, -25.0, 0.0), (12.0, 9.0, 3.0)])
def test_a_perfect_accelerometer_does_not_drift_over_the_turning_earth(v_n):
    chain, states, force = steady(np.array(v_n), 60.0)
    six = np.concatenate([np.ones(3), force])
    drift = free_drift(chain, states, [six], horizon_s=60.0)
    assert drift is not None
    # Without Coriolis it would be 0.1 to 0.2 m/s; what is left is the sphere for the ellipsoid.
    assert drift.end[0] < 3e-3


def test_an_offset_drifts_with_time():
    chain, states, force = steady(np.array([20.0, 0.0, 0.0]), 60.0)
    off = np.concatenate([np.ones(3), force + np.array([0.0, 0.01, 0.0])])
    drift = free_drift(chain, states, [off], horizon_s=60.0)
    assert drift.end[0] == pytest.approx(0.6, rel=0.01)
    assert drift.rms[0] == pytest.approx(0.6 / np.sqrt(3.0), rel=0.02)


@pytest.mark.parametrize("since", [0.0, 2.739, 16.528, 1234.5678])
def test_which_windows_are_looked_at_does_not_depend_on_when_the_clock_began(since):
    """Windows that follow on a grid of epochs: sums of times must not decide by rounding."""
    chain, states, force = steady(np.array([20.0, 0.0, 0.0]), 240.0, step=0.4)
    chain = replace(chain, start=since + chain.start, end=since + chain.end)
    states = [replace(states[0], t=since)] + [replace(states[0], t=t) for t in chain.end.tolist()]
    six = np.concatenate([np.ones(3), force])
    drift = free_drift(chain, states, [six], horizon_s=10.0, most=24)
    assert drift.windows == 24
