"""Flight in which gates refuse nearly every fix is told of, single fixes are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from onboard.core.diagnosis.refusals import LONG_S, contradicted, repeated
from onboard.core.filter.refused import Refused
from tests.core.diagnosis.flights import batches

T0 = 100.0
FLIGHT = batches(np.zeros((3000, 3)), t0=T0)
STAMPS = np.unique(np.concatenate([b.fixes.t for b in FLIGHT]))


def told(spans, share=1.0, seed=1):
    """What is said if gates refuse a share of the fixes within spans, s since the start."""
    rng = np.random.default_rng(seed)
    named = [
        (float(t), "velocity")
        for t in STAMPS
        if any(a <= t - T0 <= b for a, b in spans) and rng.uniform() < share
    ]
    return [(u.start_s, u.end_s) for u in contradicted(FLIGHT, Refused(named), None, T0)]


def test_a_spell_is_told_from_its_first_fix_to_its_last():
    assert told([(20.0, 40.0)]) == [pytest.approx((20.0, 40.0), abs=0.2)]


def test_two_spells_are_two():
    assert len(told([(5.0, 15.0), (30.0, 45.0)])) == 2


def test_what_is_refused_for_less_than_that_is_the_gates_own_business():
    assert told([(20.0, 20.0 + LONG_S - 0.5)]) == []


def test_neither_are_single_fixes_all_over_the_flight():
    assert told([(0.0, 60.0)], share=0.3) == []


def test_fixes_that_were_not_believed_at_all_are_told_of_elsewhere():
    doubted = [replace(b, trusted=np.zeros(len(b.fixes), dtype=bool)) for b in FLIGHT]
    named = Refused([(float(t), "velocity") for t in STAMPS])
    assert contradicted(doubted, named, None, T0) == ()


def test_where_an_accelerometer_repeated_one_reading_it_is_said_so():
    (said,) = repeated([(T0 + 12.0, T0 + 30.0)], T0)
    assert (said.start_s, said.end_s, said.reason) == (12.0, 30.0, "imu_stuck")
