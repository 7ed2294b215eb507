"""States of the filter and traces of its epochs come back from their arrays as they were."""

import numpy as np
import pytest

from onboard.core.filter.traces import (
    STATE_NUMBERS,
    TOGETHER,
    EpochState,
    StateLog,
    Traces,
    residual,
    state_row,
)


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
    np.testing.assert_array_equal(log.t, [x.t for x in kept])
    np.testing.assert_array_equal(log.innovation, [x.innovation for x in kept])
    log.clear()
    assert not list(log)
    assert log.t.shape == (0,)
    assert log.innovation.shape == (0, 3)


def test_the_latest_are_kept_and_never_fewer_than_asked_for():
    log = StateLog(10)
    for first in range(0, 40, 4):
        log.add(np.concatenate([state_row(state(float(first + k))) for k in range(4)]))
        assert min(first + 4, 10) <= len(log) < 10 + 4
    assert [x.t for x in log][-10:] == [float(t) for t in range(30, 40)]


def noted(count, m=4, room=0):
    """Traces of so many epochs, and what each of them was made of."""
    rng = np.random.default_rng(count)
    traces, rows = Traces(room, m), []
    for k in range(count):
        v = (3, 2, 0)[k % 3]
        rows.append(rng.normal(size=(v, 1 + m)))
        traces.add(np.array([float(k)]), np.array([v]), rows[-1])
        traces.add_refused(() if v else ("velocity", "height"), rng.normal(size=2 if not v else 0))
        traces.add_rows(rng.normal(size=(v + 1, 1 + m)), height=bool(v))
    return traces, rows


def assert_same(x, y):
    assert (x.t, x.velocities, x.height, x.refused) == (y.t, y.velocities, y.height, y.refused)
    for name in ("innovation", "columns", "y", "h", "refused_by"):
        np.testing.assert_array_equal(getattr(x, name), getattr(y, name))


@pytest.mark.parametrize("room", [0, 5, 40], ids=["none", "too little", "more than enough"])
def test_epochs_come_back_as_they_were(room):
    traces, rows = noted(20, room=room)
    assert len(traces) == 20
    for k, (x, row) in enumerate(zip(traces, rows, strict=True)):
        assert (x.t, x.velocities, x.height) == (k, len(row), len(row) > 0)
        np.testing.assert_array_equal(x.innovation, row[:, 0])
        np.testing.assert_array_equal(x.columns, row[:, 1:].astype(np.float32))
        assert x.refused == (() if len(row) else ("velocity", "height"))
        assert len(x.refused_by) == (0 if len(row) else 2)
        assert x.y.shape == (len(row) + 1,)
        assert x.h.shape == (len(row) + 1, 4)
    assert np.isnan(traces.innovation[2]).all()
    assert np.isnan(traces.innovation[1, 2])
    assert not traces.columns[2].any()


def test_several_epochs_at_once_are_as_one_by_one():
    one, rows = noted(20)
    many = Traces(20, 4)
    many.add(one.t, one.velocities, np.concatenate(rows))
    np.testing.assert_array_equal(many.innovation, one.innovation)
    np.testing.assert_array_equal(many.columns, one.columns)


def test_those_of_several_batches_follow_on_each_other():
    whole = Traces(0, 4)
    parts = [noted(7)[0], noted(11)[0]]
    for part in parts:
        whole.extend(part)
        whole.extend(Traces())  # a segment in which nothing could begin
    for x, y in zip(whole, [*parts[0], *parts[1]], strict=True):
        assert_same(x, y)


def test_residuals_in_parts_are_those_of_each_epoch():
    rng, n = np.random.default_rng(3), 2 * TOGETHER + 5
    innovation, columns = rng.normal(size=(n, 3)), rng.normal(size=(n, 3, 4)).astype(np.float32)
    theta = rng.normal(size=4)
    innovation[7, 2] = np.nan
    left = residual(innovation, columns, theta)
    for k in (0, 7, TOGETHER - 1, TOGETHER, n - 1):
        np.testing.assert_allclose(left[k], innovation[k] - columns[k] @ theta, rtol=1e-12)
