"""Columns that flights share are the derivatives by every unknown, and so are their sums."""

from __future__ import annotations

import numpy as np
import pytest

from onboard.core.vehicle.bordered import Bordered
from onboard.core.vehicle.columns import Columns

PLACES = np.array([[0, 1, 3, 7], [0, 2, 4, 7], [0, 5, 6, 7]])
"""Two unknowns of all three flights, two that each has for itself."""
SIZE = 8


def flights(rng, shape=(2,)):
    """Columns of three flights of 4, 1 and 6 rows, and the same as a column for each unknown."""
    part = np.repeat([0, 1, 2], [4, 1, 6])
    by = rng.normal(size=(len(part), *shape, PLACES.shape[1]))
    whole = np.zeros((len(part), *shape, SIZE))
    for row, its in enumerate(part):
        whole[row][..., PLACES[its]] = by[row]
    return Columns(by, PLACES, part, SIZE), whole


def test_every_unknown_has_its_column() -> None:
    columns, whole = flights(np.random.default_rng(1))
    np.testing.assert_array_equal(columns.whole, whole)
    np.testing.assert_array_equal(columns.axis(1).whole, whole[:, 1])
    np.testing.assert_array_equal(columns.of([6, 0]), whole[..., [6, 0]])
    rows = np.array([0, 5, 9])
    np.testing.assert_array_equal(columns.at(rows).whole, whole[rows])


def test_what_unknowns_make_and_their_sums() -> None:
    rng = np.random.default_rng(2)
    columns, whole = flights(rng)
    x = rng.normal(size=SIZE)
    np.testing.assert_allclose(columns.times(x), whole @ x, atol=1e-13)
    y = rng.normal(size=len(whole))
    N, b = columns.axis(0).normal(y)
    np.testing.assert_allclose(N, whole[:, 0].T @ whole[:, 0], atol=1e-13)
    np.testing.assert_allclose(b, whole[:, 0].T @ y, atol=1e-13)


@pytest.mark.parametrize("place", [0, 3, SIZE])
def test_more_unknowns_go_where_they_are_put(place: int) -> None:
    rng = np.random.default_rng(3)
    columns, whole = flights(rng)
    more = rng.normal(size=(len(whole), 2, 2))
    expected = np.insert(whole, [place, place], more, axis=-1)
    np.testing.assert_array_equal(columns.inserted(place, more).whole, expected)


def test_a_flight_alone_has_its_columns_in_order() -> None:
    rng = np.random.default_rng(4)
    by = rng.normal(size=(5, 3))
    alone = Columns(by, np.arange(3)[None], np.zeros(5, dtype=np.int64), 3)
    np.testing.assert_array_equal(alone.whole, by)
    wide = alone.inserted(1, 2.0 * by[:, :1])
    np.testing.assert_array_equal(wide.whole, np.insert(by, 1, 2.0 * by[:, 0], axis=1))


def test_eliminating_what_is_each_flight_s_own_leaves_the_solution_of_all() -> None:
    rng = np.random.default_rng(5)
    _, whole = flights(rng, ())
    rows = np.vstack([whole, 0.3 * np.eye(SIZE)])
    N, b = rows.T @ rows, rows.T @ rng.normal(size=len(rows))
    x, covariance = np.linalg.solve(N, b), np.linalg.inv(N)
    system = Bordered.of(N, b, {k: np.array(its) for k, its in enumerate([[1, 3], [2, 4], [5, 6]])})
    for numbers in (set(), {1}, {0, 2}, {0, 1, 2}):
        places, reduced, right = system.keeping(numbers)
        np.testing.assert_allclose(np.linalg.solve(reduced, right), x[places], atol=1e-12)
        np.testing.assert_allclose(
            np.linalg.inv(reduced), covariance[np.ix_(places, places)], atol=1e-12
        )


def test_nothing_to_eliminate_is_the_system_itself() -> None:
    N = np.array([[2.0, 0.5], [0.5, 1.0]])
    places, reduced, right = Bordered.of(N, np.ones(2), {0: np.zeros(0, dtype=int)}).keeping({0})
    np.testing.assert_array_equal(places, [0, 1])
    np.testing.assert_array_equal(reduced, N)
    np.testing.assert_array_equal(right, np.ones(2))
