"""A refinement in flight that is due waits while the force is known well enough without it."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.estimate.calibrator import Calibrator
from onboard.core.estimate.engine import Engine
from onboard.core.estimate.settings import CalibratorSettings
from tests.core.estimate.test_simulated_flights import flown

FIRST_S, SECOND_S = 30.0, 60.0


@pytest.fixture(scope="module")
def samples():
    return flown("plane", 120.0)[0]


@pytest.fixture
def refined(monkeypatch):
    """After how much flight it was refined."""
    out = []
    refine = Engine.refine

    def noted(engine, *args):
        out.append(engine.trusted_s)
        refine(engine, *args)

    monkeypatch.setattr(Engine, "refine", noted)
    return out


def known_from(trusted_s, monkeypatch, until_s=np.inf):
    """Have a flight know enough after so many seconds."""

    def said(_imu, engine, _parameters):
        return trusted_s <= engine.trusted_s < until_s

    monkeypatch.setattr("onboard.core.estimate.engines.known_well_enough", said)


def fed(samples):
    made = Calibrator(CalibratorSettings(refine_at_s=(FIRST_S, SECOND_S)))
    for sample in samples:
        made.feed(sample)
    return made


@pytest.mark.slow
def test_after_the_landing_it_says_the_same(samples, refined, monkeypatch):
    answers = []
    for last, times in ((SECOND_S, 2), (np.inf, 3)):
        refined.clear()
        known_from(last, monkeypatch)
        made = fed(samples)
        assert FIRST_S <= refined[0] < SECOND_S < refined[-1] == made.flown_s
        assert len(refined) == times
        answers.append(made.calibration(1))
    one, other = (np.array(a.scale + a.offset) for a in answers)
    sigma = np.array(answers[0].scale_sigma + answers[0].offset_sigma)
    # Levels are looked for from another start: only their order of magnitude matters.
    assert np.all(np.abs(one - other) < 0.25 * sigma)


@pytest.mark.slow
def test_it_is_made_up_for_once_the_flight_is_not_known_any_more(samples, refined, monkeypatch):
    known_from(SECOND_S, monkeypatch, until_s=SECOND_S + 5.0)
    fed(samples)
    assert len(refined) == 3
    assert SECOND_S + 5.0 <= refined[1] < refined[2]
