"""States of the filter come back from their rows as they were."""

import numpy as np

from onboard.core.filter.traces import STATE_NUMBERS, EpochState, StateLog, state_row


def state(t):
    rng = np.random.default_rng(int(t))
    down_unknown = np.array([0.1, -0.2, np.nan])
    return EpochState(
        t, down_unknown, rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3)
    )


def test_states_come_back_in_order():
    log, kept = StateLog(100), [state(float(t)) for t in range(5)]
    log.add(np.concatenate([state_row(x) for x in kept[:3]]))
    log.add(np.zeros((0, STATE_NUMBERS)))
    log.add(np.concatenate([state_row(x) for x in kept[3:]]))
    assert len(log) == 5
    for a, b in zip(log, kept, strict=True):
        assert a.t == b.t
        for name in ("innovation", "R_nb", "v_n", "bias_b"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    log.clear()
    assert not list(log)


def test_the_latest_are_kept_and_never_fewer_than_asked_for():
    log = StateLog(10)
    for first in range(0, 40, 4):
        log.add(np.concatenate([state_row(state(float(first + k))) for k in range(4)]))
        assert min(first + 4, 10) <= len(log) < 10 + 4
    assert [x.t for x in log][-10:] == [float(t) for t in range(30, 40)]
