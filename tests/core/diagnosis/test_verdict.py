"""A verdict is of flight that the fit did not see."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.explaining import heard
from onboard.core.diagnosis.limits import NOISE
from onboard.core.diagnosis.procedure import examine
from onboard.core.diagnosis.records import Verdict
from sitl.builtin.truth import random_imus
from sitl.recording import FlightSpec
from tests.report.diagnoses_by_hand import effect


@pytest.fixture(scope="module")
def judge():
    """Of a flight that is too short for parts of it to contradict each other."""
    spec = FlightSpec(vehicle="copter", seed=5, duration=50.0, imus=random_imus(5))
    return examine(heard(spec), 1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effects", "noise", "more"),
    [
        ([], Verdict.CLEAN, Verdict.UNEXPLAINED),
        ([effect()], Verdict.EXPLAINED, Verdict.PARTLY_EXPLAINED),
    ],
)
def test_a_model_explains_a_flight_if_it_predicts_what_it_has_not_seen_of_it(
    judge, effects, noise, more
):
    mismatch = replace(judge.diagnosis().mismatch, detected=bool(effects))
    for share, verdict in ((0.9, noise), (1.1, more)):
        held_out = replace(mismatch, held_out_after=share * NOISE)
        assert judge._verdict(effects, held_out, (), moving=True)[0] is verdict
    unknown = replace(mismatch, held_out_after=float("nan"))
    assert judge._verdict(effects, unknown, (), moving=True)[0] is noise
