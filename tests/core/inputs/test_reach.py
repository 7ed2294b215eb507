"""How far from fixes samples are needed."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard.core.inputs.limits import DELAY_RANGE_S
from onboard.core.inputs.reach import FAR, NEAR, apart_of, reach_of


@given(st.floats(0.01, FAR.around), st.floats(0.01, 0.5))
def test_both_ends_of_a_line_between_two_fixes_are_within_it(apart, older):
    """Their spread is that of the span, which is looked for as long as both are."""
    reach = reach_of(apart)
    assert reach.tells(apart)
    ends = older * apart, (1.0 - older) * apart
    assert max(ends) <= reach.around
    window = apart * math.sqrt(12.0 * older * (1.0 - older))
    assert window <= reach.longest_window


@pytest.mark.parametrize("reach", [NEAR, FAR])
def test_samples_reach_as_far_as_any_latency_puts_what_is_around_a_fix(reach):
    early, late = DELAY_RANGE_S
    assert reach.before > late + reach.around
    assert reach.ahead > reach.around - early
    assert reach.around < reach.after < reach.ahead
    assert reach.longest_window < 2.0 * reach.around


def test_fixes_further_apart_than_any_that_are_followed_have_no_neighbours():
    assert not reach_of(1.2).tells(1.2)
    assert reach_of(math.inf) is FAR
    assert apart_of(np.array([3.0])) == math.inf


def test_a_gap_does_not_make_fixes_slow():
    t = np.concatenate([np.arange(0.0, 5.0, 0.2), np.arange(9.0, 14.0, 0.2)])
    assert reach_of(apart_of(t)) is NEAR
    assert reach_of(apart_of(np.arange(9.0))) is FAR
