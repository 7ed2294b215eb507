"""Shortcuts of the fit give what the long way gives."""

from __future__ import annotations

import numpy as np

from onboard.core.vehicle.airframe import CopterAirframe
from onboard.core.vehicle.copter import copter_model
from onboard.core.vehicle.smoother import Levels, Steps, likelihoods
from tests.core.vehicle.flights import assert_derivatives, copter_flight


def test_derivatives_from_an_effect_on_are_those_of_the_whole_prediction():
    model = copter_model(copter_flight(seed=1), CopterAirframe(), np.full(3, 0.01))
    assert_derivatives(model)


def test_likelihoods_at_once_are_those_one_by_one():
    rng = np.random.default_rng(3)
    n = 40
    measured = rng.standard_normal((n, 3))
    measured[10, 2] = np.nan
    measured[20] = np.nan
    steps = Steps(
        np.full(n, 0.2),
        0.1 * rng.standard_normal((n, 3)),
        1e-3 * rng.standard_normal((n, 3)),
        np.tile(np.eye(3), (n, 1, 1)),
        measured,
    )
    levels = [Levels(a, v) for a in (1e-3, 1e-2) for v in (0.1, 1.0)]
    known = np.full(3, 0.03)
    together = likelihoods(steps, levels, known)
    alone = [likelihoods(steps, [its], known)[0] for its in levels]
    np.testing.assert_allclose(together, alone, rtol=1e-10)
    # Scatter of one is likelier with a noise of one than with a tenth of it.
    assert together[1] > together[0]
