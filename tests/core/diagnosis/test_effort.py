"""What only costs time decides nothing: with twice the work a diagnosis says the same."""

import numpy as np
import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis import effort, examination, jumps, onsets, procedure, stepped
from onboard.core.diagnosis.procedure import diagnose, examine
from onboard.core.estimate.noise_search import NoiseSearch
from sitl.builtin import effects as concealed
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec

TENTH = 0.1
"""Sigmas: of one likelihood, whose top is found to half of a unit."""
HALF = 0.5
"""Sigmas: noise levels that were found on a part of a flight are a little other ones."""


@pytest.mark.slow
def test_twice_the_work_says_the_same(monkeypatch):
    # Long enough for noise levels to be tried on a part of it.
    spec = FlightSpec(
        vehicle="plane",
        seed=23,
        duration=330.0,
        imus=random_imus(23),
        effects=(concealed.BiasStep(time=150.0, x=0.2, y=-0.1, z=0.1),),
    )
    calibrator = heard(spec)
    found = diagnose(calibrator, 1)
    more = {
        (examination, "SAMPLE_S"): 2.0 * effort.SAMPLE_S,
        (examination, "NEIGHBOURS"): 2 * effort.NEIGHBOURS,
        (examination, "WORTH_A_PASS"): tuple(0.5 * x for x in effort.WORTH_A_PASS),
        (jumps, "FURTHEST"): 2 * effort.FURTHEST,
        (stepped, "FORGOTTEN_S"): 2.0 * effort.FORGOTTEN_S,
        (onsets, "FORGOTTEN_S"): 2.0 * effort.FORGOTTEN_S,
        (jumps, "ONCE_MORE"): 2 * effort.ONCE_MORE,
        (procedure, "FURTHEST"): 2 * effort.FURTHEST,
    }
    for (module, name), value in more.items():
        monkeypatch.setattr(module, name, value)
    again = diagnose(calibrator, 1)
    assert {e.name for e in again.effects} == {e.name for e in found.effects} >= {"bias_step"}
    for one, two in zip(found.effects, again.effects, strict=True):
        for key, q in one.unknowns.items():
            assert two.unknowns[key].value == pytest.approx(q.value, abs=HALF * q.sigma), key
    one, two = found.calibration, again.calibration
    assert two.scale == pytest.approx(one.scale, abs=HALF * min(one.scale_sigma))
    assert two.offset == pytest.approx(one.offset, abs=HALF * min(one.offset_sigma))


def test_where_an_accelerometers_noise_is_looked_for_first_costs_passes_and_no_answer(monkeypatch):
    """The second one of a flight is asked from where the first has come to, or as if alone."""
    turns = []
    better = NoiseSearch.better
    monkeypatch.setattr(
        NoiseSearch, "better", lambda *a, **k: (turns.append(1), better(*a, **k))[1]
    )
    calibrator = heard(
        FlightSpec(vehicle="copter", seed=29, duration=120.0, imus=random_imus(29, 2))
    )
    first = examine(calibrator, 1).engine
    turns.clear()
    alone, many = examine(calibrator, 2), len(turns)
    turns.clear()
    beside = examine(calibrator, 2, beside=first)
    assert len(turns) < many
    one, two = alone.calibration, beside.calibration
    apart = np.subtract([*two.scale, *two.offset], [*one.scale, *one.offset])
    assert np.all(np.abs(apart) < TENTH * np.array([*one.scale_sigma, *one.offset_sigma]))
    assert beside.engine.point.delay == pytest.approx(alone.engine.point.delay, abs=1e-3)
